"""Metrics of runs with one camera: errors after SE(3) and Sim(3) alignment side by side, and the scale between them."""

from math import nan
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import Align, Alignment
from fgbaseline.compare.limits import Better

from .metric import ATE, MAIN, SCALE_ERROR, TERMINAL, Metric

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Result, Run

NO_SCALE = "one camera with ground truth has it"


def _alignment(run: "Run", result: "Result", kind: Align) -> tuple[Alignment, float] | None:
    """Alignment to the truth, and the RMSE after it, m; None for a stereo pair or without truth."""
    sequence, poses = run.problem.sequence, result.estimate.world_T_imu
    if not sequence.monocular or sequence.truth is None:
        return None
    both = sequence.truth.known & np.isfinite(poses).all(axis=(1, 2))
    if both.sum() < 3:
        return None
    found = compare.align(poses[both], sequence.truth.world_T_imu[both], kind)
    apart = found.apply(poses[both])[:, :3, 3] - sequence.truth.world_T_imu[both, :3, 3]
    return found, float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def _rmse(kind: Align) -> Metric:
    def measure(run: "Run", result: "Result") -> float:
        found = _alignment(run, result, kind)
        return nan if found is None else found[1]

    name = {Align.SE3: "SE(3)", Align.SIM3: "Sim(3)"}[kind]
    return Metric(
        (f"ate_{kind.value}",), ATE, f"RMSE, {name}", "m", Better.LOWER, MAIN, absent=NO_SCALE, measure=measure
    )


def _scale_error(run: "Run", result: "Result") -> float:
    found = _alignment(run, result, Align.SIM3)
    return nan if found is None or not found[0].scale > 0.0 else 1.0 / found[0].scale - 1.0


SCALE = (
    _rmse(Align.SE3),
    _rmse(Align.SIM3),
    Metric(
        ("scale_error",),
        SCALE_ERROR,
        "by Sim(3)",
        "%",
        tables=MAIN | TERMINAL,
        scale=100.0,
        absent=NO_SCALE,
        measure=_scale_error,
    ),
)
