"""What a comparison leaves behind: tables in every form, aligned paths, series, figures and the page."""

import json
from pathlib import Path

import numpy as np

from fgbaseline.data import write_tum

from ..figures import save
from ..figures.comparison import draw
from ..whole_folder import whole_folder
from .comparison import Comparison, Result
from .page import render
from .paper import latex, markdown
from .settings import MARK
from .summary import summarise
from .tables import main_table, metrics_table


def write(comparison: Comparison, place: Path, *, force: bool) -> Path:
    """Writes the folder, all or nothing; gives the path of its report. Raises InputError where that may not be."""
    with whole_folder(place, force=force, mark=MARK) as folder:
        _fill(comparison, folder)
    return place / "report.html"


def _fill(comparison: Comparison, folder: Path) -> None:
    for name in ("series", "trajectories", "figures"):
        (folder / name).mkdir()
    maps = {name: result.map for name, result in comparison.results.items() if result.map is not None}
    if maps:
        (folder / "maps").mkdir()
    for name, table in maps.items():
        table[["landmark", "distance", "seen", "depth"]].to_csv(folder / "maps" / f"{name}.csv", index=False)
    for name, result in comparison.results.items():
        _series(result, folder / "series" / f"{name}.csv")
        aligned = result.matched.estimate
        write_tum(folder / "trajectories" / f"{name}.tum", aligned.t, aligned.world_T_body)
    main_table(comparison).to_csv(folder / "table.csv")
    metrics_table(comparison).to_csv(folder / "metrics.csv", index=False)
    (folder / "table.md").write_text(markdown(comparison), encoding="utf-8")
    (folder / "table.tex").write_text(latex(comparison), encoding="utf-8")
    drawn = draw(comparison)
    save(drawn, folder / "figures")
    (folder / "report.html").write_text(render(comparison, drawn), encoding="utf-8")
    as_dict = summarise(comparison).model_dump(mode="json", by_alias=True)
    (folder / MARK).write_text(json.dumps(as_dict, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _series(result: Result, path: Path) -> None:
    """One row per pair of poses: stamps of both, and every difference."""
    reference, estimate = result.matched.reference, result.matched.estimate
    table = result.departure.drop(columns="t").assign(pose=result.absolute["pose"].to_numpy())
    if result.claimed is not None:
        table["nees"] = result.claimed.nees
    for column, t in (("t_estimate", estimate.t), ("t", reference.t)):
        table.insert(0, column, [repr(stamp) for stamp in np.asarray(t).tolist()])  # in full
    table.rename_axis("pair").to_csv(path, float_format="%.9g")
