"""Comparison in one call, for a notebook or a script, and all that it reports."""

from collections.abc import Sequence
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from fgbaseline.compare.trajectory_comparison.comparison import Comparison
from fgbaseline.compare.trajectory_comparison.metrics import compare_entries
from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings
from fgbaseline.data import Trajectory

from ..phrases import comparison as phrases
from ..results.comparison import Summary
from ..results.comparison_summary import summarize
from ..tables import Table
from ..tables.comparison import comparison_table, main_table, metrics_table
from .inputs import Given, read_entries

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILES = ("sequence", "extrinsic")


class ComparisonReport(Comparison):
    """A comparison with its pandas tables, sentences, matplotlib figures, and a folder of everything."""

    @cached_property
    def summary(self) -> Summary:
        """All figures, as `comparison.json` has them."""
        return summarize(self, self.caption)

    @property
    def table(self) -> pd.DataFrame:
        """One row per estimate, one column per main figure; see `caption`."""
        return main_table(self, self.summary)

    @property
    def text_table(self) -> Table:
        """The main figures as text, with a column per trajectory, for `tables.markdown`, `latex` and `print_table`."""
        return comparison_table(self, self.summary)

    @property
    def metrics(self) -> pd.DataFrame:
        """Every figure: estimate, metric, value, and low and high of its confidence interval."""
        return metrics_table(self.summary)

    @property
    def caption(self) -> str:
        """Association and alignment, without which no table can be read."""
        return phrases.caption(self)

    @property
    def verdict(self) -> list[str]:
        """Conclusions in sentences, the trust in the reference first."""
        return phrases.verdict(self)

    def figures(self) -> "dict[str, Figure]":
        """The figures by name."""
        from ..figures.comparison import draw  # matplotlib takes longer to import than a short comparison

        return draw(self)

    def write(self, folder: str | Path, *, force: bool = False) -> Path:
        """Writes tables, figures and report.html into a folder atomically; returns the path of the report."""
        from .folder import write

        return write(self, self.summary, Path(folder), force=force)


def compare(
    reference: Given,
    *estimates: Given,
    landmarks: Sequence[str | Path] = (),
    deltas: Sequence[str] = (),
    **options: Any,
) -> ComparisonReport:
    """Compares estimates with a reference, each a `[NAME=]FILE` (TUM, KITTI, EuRoC, npz) or a `Trajectory`.

    The reference may be the folder of a run: then its other estimators are compared too. `landmarks` are CSV files
    (`[NAME=]FILE`), `deltas` texts such as "1s" or "10m"; the other options are the fields of `Settings`.

        result = compare("truth.tum", "mine.tum", align="se3")
        result.table, result.caption, result.verdict
        result.write("out/comparison")

    Raises InputError, in one sentence, for an invalid file or option.
    """
    options |= {name: Path(options[name]) for name in FILES if options.get(name) is not None}
    times = options.pop("times", None) or ()
    options["times"] = tuple(map(Path, [times] if isinstance(times, str | Path) else times))
    settings = Settings(**options, deltas=tuple(Delta.parse(text) for text in deltas))
    given = [item if isinstance(item, Trajectory) else str(item) for item in (reference, *estimates)]
    with np.errstate(all="ignore"):
        entries = read_entries(given[0], given[1:], [str(file) for file in landmarks], settings)
        comparison = compare_entries(entries, settings)
    return ComparisonReport(**{field.name: getattr(comparison, field.name) for field in fields(comparison)})
