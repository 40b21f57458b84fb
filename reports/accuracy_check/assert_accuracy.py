"""`assert_accuracy`: limits on one trajectory, for tests with pytest."""

import math
import tempfile
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from fgbaseline.compare import (
    MIN_SAMPLE_SIZE,
    Align,
    MatchedTrajectories,
    absolute_errors,
    associate,
    summarized,
    time_coverage,
)
from fgbaseline.compare.acceptance_limits import Bounds, Outcome
from fgbaseline.compare.trajectory_comparison.conventions import Resolved, resolve
from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data import Estimate, Status, Trajectory, Truth
from fgbaseline.data.formats import Order
from fgbaseline.data.formats.files.file_errors import FilePath
from fgbaseline.geometry import FloatArray, InputError

from ..comparison.sources import opened
from ..phrases.check import bound, number

AnyTrajectory: TypeAlias = Trajectory | Estimate | Truth | FilePath | FloatArray | tuple[FloatArray, FloatArray]
"""a trajectory, an estimate or the truth of a problem, a file (`[NAME=]FILE`: TUM, KITTI, EuRoC, npz), poses (n, 4, 4)
by frame, or stamps (n,) with poses or positions (n, 3)"""
AT_LEAST = ("coverage", "pairs")
"""metrics with lower limits; all others have upper limits"""
UNITS = {"coverage": "", "pairs": "", "rotation.rmse": " (°)"}
"""units of the metrics that are not in meters"""


def assert_accuracy(
    estimate: AnyTrajectory,
    reference: AnyTrajectory,
    *,
    ate: float | None = None,
    ate_max: float | None = None,
    divergence: float | None = None,
    divergence_max: float | None = None,
    rotation_deg: float | None = None,
    coverage: float = 0.95,
    smallest_sample: int = MIN_SAMPLE_SIZE,
    align: Align | str = Align.SE3,
    tolerance: float | None = None,
    time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    quaternion: Order | None = None,
    figure: FilePath | None = None,
) -> dict[str, float]:
    """Raises AssertionError, with a table and a figure, where an estimate exceeds a limit; returns the metrics.

    Upper limits: `ate` and `ate_max`, RMSE and maximum of the position error (m) after alignment; `divergence` and
    `divergence_max`, without alignment; `rotation_deg`, RMSE of the rotation error (deg) after alignment. Lower limits:
    `coverage`, the share of the reference's time with paired poses, and `smallest_sample` pairs of poses. Poses are
    associated by time within `tolerance` (s; see `compare.associate`), those of an Estimate, a Truth or an array by
    frame. The figure goes into the PNG file `figure`, by default in a new temporary folder, where a limit is violated.

    Units and quaternion orders that a file does not state are detected as in `fgbaseline compare`, or given by
    `time_unit` and `quaternion`. Trajectories without orientations are compared by position only.

    The metrics are by name, such as "ate.rmse". Raises InputError for a call without limits, an invalid trajectory,
    ambiguous units, or a limit on orientations that are missing or ambiguous.
    """
    __tracebackhide__ = True
    asked = {
        "ate.rmse": ate,
        "ate.max": ate_max,
        "divergence.rmse": divergence,
        "divergence.max": divergence_max,
        "rotation.rmse": rotation_deg,
        "coverage": coverage,
        "pairs": float(smallest_sample),
    }
    _require_bounds(asked)
    if isinstance(estimate, Estimate) and estimate.status is Status.FAILED:
        raise AssertionError(f"{estimate.name} failed: {estimate.reason}")
    _require_one_clock(estimate, reference)
    settings = Settings(tolerance=tolerance, time_unit=time_unit, quaternion=quaternion)
    given = {"reference": reference, "estimate": estimate}
    sources = [opened(each, name=name if isinstance(each, tuple | np.ndarray) else "") for name, each in given.items()]
    resolved = resolve(sources, (), settings)
    there, here = (each.trajectory(()) for each in resolved)
    is_oriented = there.oriented and here.oriented
    if rotation_deg is not None or Align(align) is Align.FIRST_POSE:
        _require_orientations(resolved, [there, here])
    matched = associate(there, here, tolerance=tolerance)
    up = resolved[0].up
    aligned = matched.aligned(align) if up is None else matched.aligned(align, up=up)
    tables = {"divergence": absolute_errors(matched), "ate": absolute_errors(aligned)}
    values = _values(tables, time_coverage(matched.reference.t, there.t)) | {"pairs": float(len(matched))}
    if not is_oriented:
        del values["rotation.rmse"]
    bounds = {
        metric: Bounds(at_least=limit) if metric in AT_LEAST else Bounds(at_most=limit)
        for metric, limit in asked.items()
        if limit is not None and (metric != "pairs" or values[metric] < limit)
    }
    if all(limit.judge(values[metric]) is Outcome.HOLDS for metric, limit in bounds.items()):
        return values
    recognized = [
        f"{path.name}: {remark}." for path, each in zip((there, here), resolved, strict=True) for remark in each.remarks
    ]
    drawn = _drawn(aligned, tables, asked, figure)
    lines = [*_table(bounds, values), aligned.caption, *recognized, f"The figure is in {drawn}"]
    title = f"{aligned.estimate.name} does not meet its limits, against {aligned.reference.name}:"
    raise AssertionError("\n".join([title, *lines]))


def _require_bounds(asked: dict[str, float | None]) -> None:
    if all(limit is None for metric, limit in asked.items() if metric not in AT_LEAST):
        raise InputError("accuracy: there is no limit; give ate=0.5 or another one")
    for metric, limit in asked.items():
        if limit is not None and not (math.isfinite(limit) and limit >= 0):
            raise InputError(f"accuracy: the limit on {metric} is {limit!r}; give a number of at least 0")


def _require_one_clock(estimate: AnyTrajectory, reference: AnyTrajectory) -> None:
    """Raises InputError where only one of both has time stamps, or their frames are of different problems."""
    frames = [_frames(each) for each in (estimate, reference)]
    by_frame = [n is not None for n in frames]
    if any(by_frame) and not all(by_frame):
        raise InputError(
            "accuracy: an Estimate, a Truth and an array are by frame and have no time stamps; give the stamps with "
            "the poses, such as (sequence.t, estimate.world_T_imu), or two of them"
        )
    if frames[0] != frames[1]:
        raise InputError(
            f"accuracy: the estimate has {frames[0]} frames and the reference {frames[1]}; give two of one problem"
        )


def _frames(given: AnyTrajectory) -> int | None:
    """Number of frames of what has no time stamps; None of what has stamps, or is in a file."""
    if isinstance(given, Estimate | Truth):
        return len(given.world_T_imu)
    return len(given) if isinstance(given, np.ndarray) else None


def _require_orientations(resolved: list[Resolved], paths: list[Trajectory]) -> None:
    """Raises InputError where orientations are missing or their quaternion order is ambiguous."""
    for each, path in zip(resolved, paths, strict=True):
        file = path.source or path.name
        if not path.oriented:
            raise InputError(f"{file}: it has no orientations; leave out rotation_deg and align='first-pose'")
        if each.order_in_doubt:
            raise InputError(f"{file}: {each.remarks[-1]}".replace("--quaternion", "quaternion"))


def _values(tables: dict[str, pd.DataFrame], coverage: float) -> dict[str, float]:
    values = {"coverage": coverage, "rotation.rmse": summarized(tables["ate"]["rotation_deg"])["rmse"]}
    for name, table in tables.items():
        statistics = summarized(table["translation"])
        values |= {f"{name}.rmse": statistics["rmse"], f"{name}.max": statistics["max"]}
    return dict(sorted(values.items()))


def _drawn(
    aligned: MatchedTrajectories,
    tables: dict[str, pd.DataFrame],
    asked: dict[str, float | None],
    place: FilePath | None,
) -> Path:
    from ..figures.comparison import draw_failed_check  # matplotlib: only where a limit is violated

    path = Path(tempfile.mkdtemp(prefix="fgbaseline-")) / "accuracy.png" if place is None else Path(place)
    limited = {metric.partition(".")[0] for metric, limit in asked.items() if limit is not None}
    shown = [name for name in tables if name in limited] or ["ate"]
    draw_failed_check(aligned, {name: (tables[name], asked[f"{name}.max"]) for name in shown}, path)
    return path


def _table(bounds: dict[str, Bounds], values: dict[str, float]) -> list[str]:
    """The lines of the table of limits."""
    rows = [("limit", "metric", "value", "bound", "margin")]
    for metric, limit in bounds.items():
        value, name = values[metric], metric + UNITS.get(metric, " (m)")
        rows.append(
            (limit.judge(value).value, name, number(value), bound(limit), number(limit.margin(value), sign=True))
        )
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
