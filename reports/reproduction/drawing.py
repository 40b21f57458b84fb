"""All figures of a reproduction, in the order in which the page shows them."""

from collections.abc import Sequence as Several

from matplotlib.figure import Figure

from ..figures.layout import lay_out
from ..figures.style import in_style
from .plots import numbered
from .stages_figure import stages_figure
from .study import Study
from .sweep_figure import sweep_figure


def draw(studies: Several[Study]) -> dict[str, Figure]:
    """The report's figures by their numbers, those of other recordings by name, then `sweep` and `causes_NAME`."""
    figures: dict[str, Figure] = {}
    with in_style():
        for study in studies:
            figures |= numbered(study)
        in_report = sorted(name for name in figures if name.startswith("figure_"))
        figures = {name: figures[name] for name in [*in_report, *figures]}
        figures["sweep"] = sweep_figure(studies)
        figures |= {f"causes_{study.subject.name}": stages_figure(study) for study in studies}
        for figure in figures.values():
            lay_out(figure)
    return figures
