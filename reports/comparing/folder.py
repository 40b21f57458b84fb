"""Folder of a comparison: tables in every form, aligned paths, series, figures and the page."""

import json
from pathlib import Path

import numpy as np

from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.data import write_tum
from fgbaseline.data.formats.atomic_folder import atomic_folder

from ..figures import save
from ..figures.comparison import draw
from ..html.comparison_page import render
from ..results.comparison import MARK, Summary
from ..tables import latex, markdown
from ..tables.comparison import comparison_table, main_table, metrics_table


def write(comparison: Comparison, summary: Summary, place: Path, *, force: bool) -> Path:
    """Writes the folder atomically and returns the path of its report. Raises InputError where it may not."""
    with atomic_folder(place, force=force, mark=MARK) as folder:
        _fill(comparison, summary, folder)
    return place / "report.html"


def _fill(comparison: Comparison, summary: Summary, folder: Path) -> None:
    maps = {name: result.map for name, result in comparison.results.items() if result.map is not None}
    for name in ("series", "trajectories", "figures", *(["maps"] if maps else [])):
        (folder / name).mkdir()
    for name, landmarks in maps.items():
        landmarks[["landmark", "distance", "seen", "depth"]].to_csv(folder / "maps" / f"{name}.csv", index=False)
    for name, result in comparison.results.items():
        _write_series(result, folder / "series" / f"{name}.csv")
        aligned = result.matched.estimate
        write_tum(folder / "trajectories" / f"{name}.tum", aligned.t, aligned.world_T_body)
    main_table(comparison, summary).to_csv(folder / "table.csv")
    metrics_table(summary).to_csv(folder / "metrics.csv", index=False)
    table = comparison_table(comparison, summary)
    figures = draw(comparison)
    save(figures, folder / "figures")
    as_dict = summary.model_dump(mode="json", by_alias=True)
    for file, text in {
        "table.md": markdown(table),
        "table.tex": latex(table),
        "report.html": render(comparison, summary, figures),
        MARK: json.dumps(as_dict, indent=2, allow_nan=False) + "\n",
    }.items():
        (folder / file).write_text(text, encoding="utf-8")


def _write_series(result: Result, path: Path) -> None:
    """One row per pair of poses: stamps of both, and every difference."""
    reference, estimate = result.matched.reference, result.matched.estimate
    table = result.departure.drop(columns="t").assign(pose=result.absolute["pose"].to_numpy())
    if result.reported_covariance is not None:
        table["nees"] = result.reported_covariance.nees
    for column, t in (("t_estimate", estimate.t), ("t", reference.t)):
        table.insert(0, column, [repr(stamp) for stamp in np.asarray(t).tolist()])  # in full
    table.rename_axis("pair").to_csv(path, float_format="%.9g")
