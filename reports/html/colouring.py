"""The colours of a run as style rules: a class for each estimator, lighter on dark ground where that is needed."""

from collections.abc import Mapping

from markupsafe import Markup

from fgbaseline.reports.comparison import Run
from fgbaseline.reports.figures.style import TRUTH, colors, on_dark


def keys(run: Run) -> dict[str, str]:
    """Estimator -> what its class is called after: its number, as its name may be anything."""
    return {name: str(i) for i, name in enumerate(run.results)}


def colour_rules(run: Run) -> Markup:
    """`.who-KEY` sets `--who`, for paper and bright ground, and for dark ground."""
    of = {keys(run)[name]: colour for name, colour in colors(run.results, run.reference).items()} | {"truth": TRUTH}
    dark = {key: on_dark(colour) for key, colour in of.items()}
    return Markup(f"{_rules(of)}\n@media screen and (prefers-color-scheme: dark) {{\n{_rules(dark)}\n}}")


def _rules(of: Mapping[str, str]) -> str:
    return "\n".join(f".who-{key} {{ --who: {colour}; }}" for key, colour in of.items())
