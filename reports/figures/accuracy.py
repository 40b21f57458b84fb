"""Where an estimate that falls short parts from its reference: the paths, and the distance over time."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.compare import Matched
from fgbaseline.data.formats.beside import written_beside
from fgbaseline.geometry import FloatArray

from ..figures.lettering import plain
from ..figures.palette import TRUTH
from ..figures.style import in_style

COLOURS = {"ate": "#0072b2", "divergence": "#d55e00"}
SAID = {"ate": "aligned", "divergence": "not aligned"}


def draw(aligned: Matched, errors: Mapping[str, tuple[pd.DataFrame, float | None]], path: Path) -> None:
    """Draws into the PNG `path`, whose folder is made: both paths, and each table's `translation` with its bound.

    `errors` has the tables of `absolute_errors` by what was aligned, and the largest distance allowed, m.
    """
    with in_style():
        figure = Figure(figsize=(8.0, 7.0))
        above, below = figure.subplots(2, 1, height_ratios=(2, 1))
        _paths(above, aligned)
        for name, (table, largest) in errors.items():
            below.plot(table["t"] - table["t"].iloc[0], table["translation"], color=COLOURS[name], label=SAID[name])
            if largest is not None:
                below.axhline(largest, color=COLOURS[name], linestyle=(0, (4, 2)), linewidth=1.0)
        below.set(
            xlabel="time since the first pose, s" if aligned.reference.stamped else "frame",
            ylabel="distance, m",
            ylim=(0, None),
        )
        below.legend()
        stream = BytesIO()
        figure.savefig(stream, format="png", dpi=120)
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_beside(path) as file:
        file.write(stream.getvalue())


def _paths(axes: Axes, aligned: Matched) -> None:
    plane = widest_plane(aligned.reference.position)
    here = aligned.reference.position @ plane
    axes.plot(*here.T, color=TRUTH, linestyle=(0, (4, 2)), linewidth=1.8, label=plain(aligned.reference.name))
    axes.plot(*(aligned.estimate.position @ plane).T, color=COLOURS["ate"], label=plain(aligned.estimate.name))
    axes.plot(*here[0], color=TRUTH, marker="o", linestyle="none", label="start")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="m", ylabel="m", title=f"in the plane in which {plain(aligned.reference.name)} is widest, aligned")
    axes.legend()


def widest_plane(positions: FloatArray) -> FloatArray:
    """(3, 2) orthonormal directions in which positions (n, 3) spread most."""
    _, _, Vt = np.linalg.svd(positions - positions.mean(axis=0), full_matrices=True)
    return np.asarray(Vt[:2].T)
