"""Metrics of runs on raw inertial data, which other runs do not have: velocity, biases, NEES of the state; and of one
camera: errors after SE(3) and Sim(3) alignment side by side, and the scale between them.
"""

from math import nan
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import Align, Alignment
from fgbaseline.compare.acceptance_limits import Better
from fgbaseline.geometry.strapdown import BLOCKS

from . import glossary
from .metric_record import EVIDENCE, MAIN, TERMINAL, Metric

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Result, Run

LOWER, PERCENT = Better.LOWER, 100.0
UNITS = {glossary.VELOCITY: "m/s", glossary.GYROSCOPE_BIAS: "rad/s", glossary.ACCELEROMETER_BIAS: "m/s^2"}
"""quantity -> unit; the key of a quantity has _ in place of the space"""
NO_SCALE = "one camera with ground truth has it"


def _of_quantity(quantity: str, unit: str) -> tuple[Metric, ...]:
    key = quantity.replace(" ", "_")
    aligned = ", aligned" if quantity == glossary.VELOCITY else ""
    unaligned = "velocity_unaligned" if quantity == glossary.VELOCITY else key
    return (
        Metric((key, "rmse"), quantity, f"RMSE{aligned}", unit, LOWER, MAIN | TERMINAL),
        *([Metric((unaligned, "rmse"), quantity, "RMSE, unaligned", unit, LOWER, EVIDENCE)] if aligned else []),
        Metric((unaligned, "final"), quantity, f"final{', unaligned' if aligned else ''}", unit, LOWER, EVIDENCE),
        Metric((unaligned, "inside_3_sigma"), quantity, "within 3 sigma", "%", tables=EVIDENCE, scale=PERCENT),
        Metric((f"{key}_divergence", "rmse"), quantity, "RMSE from the reference", unit, LOWER, EVIDENCE),
    )


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


def _rmse(kind: Align, name: str) -> Metric:
    def measure(run: "Run", result: "Result") -> float:
        found = _alignment(run, result, kind)
        return nan if found is None else found[1]

    return Metric((f"ate_{kind}",), glossary.ATE, f"RMSE, {name}", "m", LOWER, MAIN, absent=NO_SCALE, measure=measure)


def _scale_error(run: "Run", result: "Result") -> float:
    found = _alignment(run, result, Align.SIM3)
    return nan if found is None or not found[0].scale > 0.0 else 1.0 / found[0].scale - 1.0


VELOCITY_AND_BIASES = tuple(metric for quantity, unit in UNITS.items() for metric in _of_quantity(quantity, unit))
STATE_NEES = Metric(
    ("nees_state", "median"),
    glossary.CONSISTENCY,
    "state NEES, median (14.3 expected)",
    tables=MAIN | TERMINAL,
    term=glossary.STATE_NEES,
    brief="state NEES (14.3 expected)",
)
BLOCK_NEES = (
    Metric(("nees_state", "mean"), glossary.STATE_NEES, "mean", tables=EVIDENCE),
    *(
        Metric(("nees_state", block, "mean"), glossary.STATE_NEES, f"mean, {block.replace('_', ' ')}", tables=EVIDENCE)
        for block in BLOCKS
    ),
)
SCALE = (
    _rmse(Align.SE3, "SE(3)"),
    _rmse(Align.SIM3, "Sim(3)"),
    Metric(
        ("scale_error",),
        glossary.SCALE_ERROR,
        "by Sim(3)",
        "%",
        tables=MAIN | TERMINAL,
        scale=PERCENT,
        absent=NO_SCALE,
        measure=_scale_error,
    ),
)
