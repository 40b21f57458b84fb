"""Comparison in one call, its tables, sentences and figures, and the folder that it writes."""

import json
from collections.abc import Sequence
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.metrics import compare_entries
from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings
from fgbaseline.data import Trajectory, write_tum
from fgbaseline.data.formats.atomic_folder import atomic_folder

from ..phrases import comparison as phrases
from ..results.comparison import MARK, Summary
from ..results.comparison_summary import summarize
from ..tables import Table, latex, markdown
from ..tables.comparison import comparison_table, main_table, metrics_table
from .inputs import Given, read_entries

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILES = ("sequence", "extrinsic")


class ComparisonReport(Comparison):
    """A comparison with pandas tables, sentences, matplotlib figures, and a folder with all of them."""

    @cached_property
    def summary(self) -> Summary:
        """All metrics, as in `comparison.json`."""
        return summarize(self, self.caption)

    @property
    def table(self) -> pd.DataFrame:
        """One row per estimate, one column per main metric; see `caption`."""
        return main_table(self, self.summary)

    @property
    def text_table(self) -> Table:
        """The main metrics as text, one column per trajectory, for `tables.markdown`, `latex` and `print_table`."""
        return comparison_table(self, self.summary)

    @property
    def metrics(self) -> pd.DataFrame:
        """Every metric: estimate, metric, value, and low and high of its 95 % interval."""
        return metrics_table(self.summary)

    @property
    def caption(self) -> str:
        """Association, alignment and kind of interval of the tables."""
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
        """Writes tables, paths, series, figures and report.html into a folder atomically; returns the report's path.

        Raises InputError where the folder exists without `force` or is not that of a comparison.
        """
        place = Path(folder)
        with atomic_folder(place, force=force, mark=MARK) as building:
            self._fill(building)
        return place / "report.html"

    def _fill(self, folder: Path) -> None:
        from ..figures import save
        from ..html.comparison_page import render

        maps = {name: result.map for name, result in self.results.items() if result.map is not None}
        relative = {name: result.relative for name, result in self.results.items() if result.relative}
        optional = {"maps": maps, "relative": relative}
        for name in ("series", "trajectories", "figures", *(name for name, tables in optional.items() if tables)):
            (folder / name).mkdir()
        for name, landmarks in maps.items():
            columns = ["landmark", "distance", "seen", "depth", "sigmas"]
            landmarks[columns].to_csv(folder / "maps" / f"{name}.csv", index=False)
        for name, motions in relative.items():
            joined = pd.concat(motions, names=["delta"]).reset_index(level="delta")
            joined.to_csv(folder / "relative" / f"{name}.csv", index=False, float_format="%.9g")
        for name, result in self.results.items():
            _write_series(result, folder / "series" / f"{name}.csv")
        paths = [self.reference.trajectory, *(result.matched.estimate for result in self.results.values())]
        for path in paths:
            write_tum(folder / "trajectories" / f"{path.name}.tum", path.t, path.world_T_body)
        self.table.to_csv(folder / "table.csv")
        self.metrics.to_csv(folder / "metrics.csv", index=False)
        figures = self.figures()
        save(figures, folder / "figures")
        as_dict = self.summary.model_dump(mode="json", by_alias=True)
        for file, text in {
            "table.md": markdown(self.text_table),
            "table.tex": latex(self.text_table),
            "report.html": render(self, self.summary, figures),
            MARK: json.dumps(as_dict, indent=2, allow_nan=False) + "\n",
        }.items():
            (folder / file).write_text(text, encoding="utf-8")


def compare(
    reference: Given,
    *estimates: Given,
    landmarks: Sequence[str | Path] = (),
    deltas: Sequence[str] = (),
    **options: Any,
) -> ComparisonReport:
    """Compares estimates with a reference, each a `[NAME=]FILE` (TUM, KITTI, EuRoC, npz) or a `Trajectory`.

    The reference may be the folder of a run: then its other estimators are compared too. `landmarks` are CSV files
    (`[NAME=]FILE`), `deltas` are texts such as "1s" or "10m"; the other options are the fields of `Settings`.

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


def _write_series(result: Result, path: Path) -> None:
    """One row per pair of poses: stamps of both, and all errors."""
    reference, estimate = result.matched.reference, result.matched.estimate
    table = result.departure.drop(columns="t").assign(pose=result.absolute["pose"].to_numpy())
    if result.reported_covariance is not None:
        table["nees"] = result.reported_covariance.nees
    for column, t in (("t_estimate", estimate.t), ("t", reference.t)):
        table.insert(0, column, [repr(stamp) for stamp in np.asarray(t).tolist()])  # in full
    table.rename_axis("pair").to_csv(path, float_format="%.9g")
