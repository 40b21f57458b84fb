"""Tables (pandas) and plots (matplotlib) of recordings, problems and paths; both libraries are imported at a call."""

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.geometry import FloatArray, so3

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def pose_columns(poses: FloatArray) -> dict[str, FloatArray]:
    """Columns x, y, z, m, and qx, qy, qz, qw of poses (n, 4, 4); NaN where a pose is."""
    values = np.full((len(poses), 7), np.nan)
    known = np.isfinite(poses).all(axis=(1, 2))
    values[known] = np.hstack([poses[known, :3, 3], so3.quaternion_xyzw(poses[known, :3, :3])])
    return dict(zip(POSE, values.T, strict=True))


def axis_columns(prefix: str, vectors: FloatArray) -> dict[str, FloatArray]:
    """Columns such as vx, vy, vz of vectors (n, 3)."""
    return {f"{prefix}{axis}": column for axis, column in zip("xyz", vectors.T, strict=True)}


def table(columns: Mapping[str, object], index: str) -> "pd.DataFrame":
    """Columns (n,) by name, in rows that are numbered from 0 under the title `index`."""
    import pandas as pd

    frame = pd.DataFrame(dict(columns))
    frame.index.name = index
    return frame


def plot_path(positions: FloatArray, label: str, axes: "Axes | None") -> "Axes":
    """Draws positions (n, 3), m, in the plane of the two world axes along which they extend farthest.

    Draws into `axes`, by default into a new figure of pyplot; several paths in one drawing need the same plane, so
    later ones take it from the labels of the axes.
    """
    from matplotlib import pyplot as plt

    if axes is None:
        axes = plt.subplots()[1]
    labels = [f"{axis}, m" for axis in "xyz"]
    if axes.get_xlabel() in labels and axes.get_ylabel() in labels:
        chosen = [labels.index(axes.get_xlabel()), labels.index(axes.get_ylabel())]
    else:
        known = positions[np.isfinite(positions).all(axis=1)]
        extent = np.ptp(known, axis=0) if len(known) else np.zeros(3)
        chosen = sorted(np.argsort(-extent, kind="stable")[:2].tolist())
        axes.set(xlabel=labels[chosen[0]], ylabel=labels[chosen[1]])
        axes.set_aspect("equal", adjustable="datalim")
    axes.plot(positions[:, chosen[0]], positions[:, chosen[1]], label=label)
    axes.legend()
    return axes


def plot_over_time(panels: Mapping[str, Mapping[str, tuple[FloatArray, FloatArray]]], title: str) -> "Figure":
    """Draws panels below each other: label of the vertical axis -> name of a line -> its times (n,), s, and values."""
    from matplotlib import pyplot as plt

    figure, rows = plt.subplots(len(panels), sharex=True, squeeze=False, layout="constrained")
    for axes, (label, lines) in zip(rows[:, 0], panels.items(), strict=True):
        for name, (t, values) in lines.items():
            axes.plot(t, values, label=name)
        axes.set_ylabel(label)
        if len(lines) > 1:
            axes.legend()
    rows[-1, 0].set_xlabel("time, s")
    figure.suptitle(title)
    return as_cell_value(figure)


def as_cell_value(figure: "Figure") -> "Figure":
    """The figure, ready to be the value of a notebook's cell, which displays it once; elsewhere it is unchanged."""
    if "ipykernel" in sys.modules:
        from matplotlib import get_backend
        from matplotlib import pyplot as plt

        plt.switch_backend(get_backend())  # loads it: until then a notebook displays only the name of a figure
        plt.close(figure)  # else pyplot displays it again at the end of the cell
    return figure
