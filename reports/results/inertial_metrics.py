"""Metrics of runs on raw inertial data: velocity, biases and the NEES of the state. Other runs have none of them."""

from fgbaseline.compare.limits import Better
from fgbaseline.geometry.strapdown import BLOCKS

from .metric import (
    ACCELEROMETER_BIAS,
    CONSISTENCY,
    EVIDENCE,
    GYROSCOPE_BIAS,
    MAIN,
    STATE_NEES,
    TERMINAL,
    VELOCITY,
    Metric,
)

LOWER, PERCENT = Better.LOWER, 100.0
UNITS = {VELOCITY: "m/s", GYROSCOPE_BIAS: "rad/s", ACCELEROMETER_BIAS: "m/s^2"}
"""quantity -> unit; the key of a quantity has _ in place of the space"""


def _of_quantity(quantity: str, unit: str) -> tuple[Metric, ...]:
    key = quantity.replace(" ", "_")
    aligned = ", aligned" if quantity == VELOCITY else ""
    unaligned = "velocity_unaligned" if quantity == VELOCITY else key
    return (
        Metric((key, "rmse"), quantity, f"RMSE{aligned}", unit, LOWER, MAIN | TERMINAL),
        *([Metric((unaligned, "rmse"), quantity, "RMSE, unaligned", unit, LOWER, EVIDENCE)] if aligned else []),
        Metric((unaligned, "final"), quantity, f"final{', unaligned' if aligned else ''}", unit, LOWER, EVIDENCE),
        Metric((unaligned, "inside_3_sigma"), quantity, "within 3 sigma", "%", tables=EVIDENCE, scale=PERCENT),
        Metric((f"{key}_divergence", "rmse"), quantity, "RMSE from the reference", unit, LOWER, EVIDENCE),
    )


VELOCITY_AND_BIASES = tuple(metric for quantity, unit in UNITS.items() for metric in _of_quantity(quantity, unit))
MAIN_STATE_NEES = (
    Metric(
        ("nees_state", "median"), CONSISTENCY, "NEES of 15", tables=MAIN | TERMINAL, term=STATE_NEES, brief="NEES of 15"
    ),
)
BLOCK_NEES = (
    Metric(("nees_state", "mean"), STATE_NEES, "mean", tables=EVIDENCE),
    *(
        Metric(("nees_state", block, "mean"), STATE_NEES, f"mean, {block.replace('_', ' ')}", tables=EVIDENCE)
        for block in BLOCKS
    ),
)
