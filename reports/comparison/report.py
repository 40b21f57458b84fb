"""Comparison as a result: its tables, sentences and figures, and the folder that it writes."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fgbaseline.compare.column_tables import Columns
from fgbaseline.compare.trajectory_comparison.comparison import ASSUMED_UP, Comparison, Result
from fgbaseline.compare.trajectory_comparison.computation import PairedEntries, compare_paired, pair_entries
from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data import write_tum
from fgbaseline.data.dataframes import as_cell_value
from fgbaseline.data.formats.files.file_errors import FilePath

from ..phrases import comparison as phrases
from ..python_interface import NotebookResult, for_python, write_report
from ..results.comparison_summary import results_by_name, summarize
from ..results.json_files import COMPARISON
from ..tables.comparison import comparison_table, main_columns, main_frame, metrics_columns
from ..tables.table import Table
from ..tables.writers import latex, markdown, write_csv
from .inputs import Given, GivenLandmarks, read_entries

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fgbaseline.compare.estimate_comparison import Run

    from ..results.comparison import Summary


class ComparisonReport(NotebookResult, Comparison):
    """A comparison with pandas tables, sentences, matplotlib figures, and a folder with all of them."""

    @cached_property
    def by_name(self) -> dict[str, dict[str, Any]]:
        """Values of the reference and of every estimate, as `comparison.json` has them."""
        return results_by_name(self)

    @cached_property
    def summary(self) -> "Summary":
        """All metrics, as in `comparison.json`."""
        return summarize(self, self.by_name, self.caption)

    @property
    def table(self) -> "pd.DataFrame":
        """One row per main metric, one column per estimate; see `caption`, and `metrics` for the intervals."""
        return main_frame(self, self.by_name)

    @property
    def text_table(self) -> Table:
        """The main metrics as text, one column per trajectory, for `tables.markdown`, `latex` and `print_table`."""
        return comparison_table(self, self.by_name, self.caption)

    @property
    def metrics(self) -> "pd.DataFrame":
        """Every metric: estimate, metric, value, and low and high of its 95 % interval."""
        import pandas as pd

        return pd.DataFrame(metrics_columns(self, self.by_name))

    @property
    def caption(self) -> str:
        """Association, alignment and kind of interval of the tables."""
        return phrases.caption(self)

    @property
    def heading(self) -> str:
        """Reference and estimates."""
        return f"Comparison with {self.reference.name}: {', '.join(self.results)}"

    @cached_property
    def verdict(self) -> list[str]:
        """Conclusions in sentences, the trust in the reference first."""
        return phrases.verdict(self)

    def to_frame(self) -> "pd.DataFrame":
        """The table, as `table`."""
        return self.table

    def plot(self) -> "Figure":
        """The figure of all paths, from above."""
        return self.figures()["paths"]

    def figures(self) -> "dict[str, Figure]":
        """The figures by name."""
        from ..figures.comparison import figure_functions  # matplotlib takes longer to import than a short comparison
        from ..figures.drawing import drawn

        return {name: as_cell_value(figure) for name, figure in drawn(figure_functions(self)).items()}

    @for_python
    def report(self, path: FilePath, *, force: bool = False) -> Path:
        """Writes the page alone to `NAME.html`, or a folder with tables, paths, series, figures and page.

        Returns the path of the page. Raises InputError where the path exists without `force`, or is a folder that is
        not that of a comparison.
        """
        from ..html.comparison_page import render

        return write_report(
            path, lambda: render(self, self.summary, self.figures()), self._fill, force=force, mark=COMPARISON
        )

    def _fill(self, folder: Path) -> None:
        from fgbaseline.data.parallel import cores

        from ..figures.comparison import figure_functions
        from ..figures.drawing import encoded_in_background, save

        with encoded_in_background(figure_functions(self), cores()) as drawn:
            from ..html.comparison_page import render  # while the figures are drawn

            self._fill_tables(folder)
            figures = drawn()
        (folder / "figures").mkdir()
        save(figures, folder / "figures")
        (folder / "report.html").write_text(render(self, self.summary, figures), encoding="utf-8")

    def _fill_tables(self, folder: Path) -> None:
        maps = {name: result.map for name, result in self.results.items() if result.map is not None}
        relative = {name: result.relative for name, result in self.results.items() if result.relative}
        optional = {"maps": maps, "relative": relative}
        for name in ("series", "trajectories", *(name for name, tables in optional.items() if tables)):
            (folder / name).mkdir()
        for name, landmarks in maps.items():
            columns = ["landmark", "distance", "seen", "depth", "sigmas"]
            landmarks[columns].to_csv(folder / "maps" / f"{name}.csv", index=False)
        for name, motions in relative.items():
            write_csv(folder / "relative" / f"{name}.csv", _by_delta(motions), "%.9g")
        for name, result in self.results.items():
            _write_series(result, folder / "series" / f"{name}.csv")
        up = None if self.up_from == ASSUMED_UP else self.up
        paths = [self.reference.trajectory, *(result.matched.estimate for result in self.results.values())]
        for path in paths:
            write_tum(folder / "trajectories" / f"{path.name}.tum", path.t, path.world_T_body, up)
        write_csv(folder / "table.csv", main_columns(self, self.by_name))
        write_csv(folder / "metrics.csv", metrics_columns(self, self.by_name))
        for file, text in {
            "table.md": markdown(self.text_table),
            "table.tex": latex(self.text_table),
            COMPARISON: json.dumps(self.summary.content, indent=2, allow_nan=False) + "\n",
        }.items():
            (folder / file).write_text(text, encoding="utf-8")


def report_of(
    reference: "Given | Run", estimates: Sequence[Given], landmarks: GivenLandmarks, settings: Settings, *, drawn: bool
) -> ComparisonReport:
    """Compares inputs, whose files may be open. Raises InputError.

    With `drawn`, figures are to follow: what draws them is imported while a fork compares. A recording's observations
    are too many to send from there.
    """
    with np.errstate(all="ignore"):
        paired = pair_entries(read_entries(reference, estimates, landmarks, settings), settings)
        in_a_fork = drawn and paired.entries.problem is None
        comparison = _compared_meanwhile(paired) if in_a_fork else compare_paired(paired)
    return ComparisonReport(**{field.name: getattr(comparison, field.name) for field in fields(comparison)})


def _compared_meanwhile(paired: PairedEntries) -> Comparison:
    """Compares all estimates in a fork, while this process imports the drawing libraries."""
    from fgbaseline.data.parallel import background_map, cores

    with background_map(lambda _: compare_paired(paired), 1, cores()) as compared:
        import_module("fgbaseline.reports.figures.comparison")
        (comparison,) = compared()
    return comparison


def _write_series(result: Result, path: Path) -> None:
    """One row per pair of poses: stamps of both, and all errors."""
    reference, estimate = result.matched.reference, result.matched.estimate
    stamps = {"t": reference.t, "t_estimate": estimate.t}
    in_full = {name: [repr(stamp) for stamp in np.asarray(t).tolist()] for name, t in stamps.items()}
    columns = {name: column for name, column in result.divergence.items() if name != "t"}
    columns["pose"] = result.absolute["pose"]
    if result.reported_covariance is not None:
        columns["nees"] = result.reported_covariance.nees
    write_csv(path, {"pair": range(len(reference.t)), **in_full, **columns}, "%.9g")


def _by_delta(motions: Mapping[str, Columns]) -> dict[str, list[Any]]:
    """Columns of the motions over all deltas, one delta after the other."""
    names = next(iter(motions.values()))
    deltas = [delta for delta, of in motions.items() for _ in next(iter(of.values()))]
    return {"delta": deltas} | {name: [v for of in motions.values() for v in of[name].tolist()] for name in names}
