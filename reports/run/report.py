"""A run with its tables, sentences and figures, and the page or folder that it writes."""

import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data.dataframes import as_cell_value

from ..notebook import NotebookResult, write_report
from ..phrases.run import verdict
from ..python_arguments import for_python
from ..results.json_files import SUMMARY
from ..results.run import Summary, summarize
from ..tables.run import main_frame, main_table, metrics_table
from ..tables.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class RunReport(NotebookResult, Run):
    """A run with pandas tables, sentences, matplotlib figures, and the folder of `fgbaseline run`."""

    @cached_property
    def summary(self) -> Summary:
        """All metrics, as in `summary.json`."""
        return summarize(self)

    @property
    def table(self) -> pd.DataFrame:
        """One row per main metric, one column per estimator."""
        return main_frame(self, self.summary.content["estimators"])

    @property
    def text_table(self) -> Table:
        """The main metrics as text, for `tables.markdown`, `latex` and `print_table`."""
        return main_table(self, self.summary.content["estimators"]).transposed()

    @property
    def metrics(self) -> pd.DataFrame:
        """Every metric: estimator, metric (its path in `summary.json`) and value."""
        return metrics_table(self.summary)

    @cached_property
    def verdict(self) -> list[str]:
        """Conclusions in sentences, the trust in the reference first."""
        return verdict(self)

    @property
    def heading(self) -> str:
        """Recording, and reference with its trust."""
        reference = "no reference" if self.reference is None else f"reference {self.reference}"
        return f"Run on {self.problem.sequence.name}: {reference}, {self.trust.verdict.name.lower()}"

    def to_frame(self) -> pd.DataFrame:
        """The table, as `table`."""
        return self.table

    def figures(self) -> "dict[str, Figure]":
        """The figures by name, as the page has them."""
        from ..figures import draw

        return {name: as_cell_value(figure) for name, figure in draw(self).items()}

    def plot(self) -> "Figure":
        """The figure of all paths, from above."""
        return self.figures()["paths_overlaid"]

    @for_python
    def report(self, path: str | os.PathLike[str], *, force: bool = False, processes: int = 1) -> Path:
        """Writes the page alone to `NAME.html`, or the folder of `fgbaseline run`; returns the path of the page.

        `force` replaces an earlier file or folder; `processes` draw the folder's figures. Raises InputError where
        the path exists without `force`, or is a folder that is not that of a run.
        """
        from ..html.run_page import render
        from .folder import write_run

        return write_report(
            path,
            lambda: render(self, self.summary.content, self.figures()),
            lambda folder: write_run(self, folder, processes),
            force=force,
            mark=SUMMARY,
        )
