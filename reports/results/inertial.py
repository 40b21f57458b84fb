"""Velocity and biases of runs on raw inertial data in `summary.json`: models, how they are filled, notes."""

from collections.abc import Mapping
from typing import Annotated, Any

import pandas as pd
from pydantic import Field

from fgbaseline import compare
from fgbaseline.compare.consistency.state_nees import QUANTITIES
from fgbaseline.compare.estimate_comparison import InertialEvidence, Result, Run
from fgbaseline.geometry.strapdown import BLOCKS

from .evidence import REFERENCE
from .parts import Number, Part, Spread


class QuantityDivergence(Spread):
    """Difference of a velocity (m/s) or bias (rad/s, m/s^2) by frame: statistics of its norm, RMSE of each axis."""

    final: Annotated[Number, Field(description="of the last frame that has one")]
    rmse_x: Number
    rmse_y: Number
    rmse_z: Number


class QuantityError(QuantityDivergence):
    """Error to ground truth of a velocity (m/s) or bias (rad/s, m/s^2)."""

    inside_3_sigma: Annotated[Number, Field(description="share of the components within 3 sigma; 0.9973 is expected")]


class BlockNees(Part):
    """NEES of a block of the error state, 3 degrees of freedom."""

    mean: Annotated[Number, Field(description="the degrees of freedom are expected")]
    median: Number
    inside_95: Annotated[Number, Field(description="share of the frames inside the 95 % bounds of a single one")]
    frames: int


class StateNees(BlockNees):
    """NEES of the state of 15 degrees of freedom, and of each of its blocks."""

    translation: BlockNees
    rotation: BlockNees
    velocity: BlockNees
    gyroscope_bias: BlockNees
    accelerometer_bias: BlockNees


ESTIMATES_NONE = "it estimates no velocity and biases"
NO_COVARIANCE = "it gives no covariance of velocity and biases"


def summarize_inertial(result: Result) -> dict[str, Any]:
    """Values, which may be NaN, of the keys that `InertialEstimatorSummary` adds; None without any value."""
    inertial = result.inertial or InertialEvidence(pd.DataFrame(), None, None, None, None)
    return {
        **{name: _figures(inertial.aligned, name) for name in QUANTITIES},
        "velocity_unaligned": _figures(inertial.errors, "velocity"),
        **{f"{name}_divergence": _figures(inertial.divergence, name, "inside_3_sigma") for name in QUANTITIES},
        "nees_state": _nees(inertial.nees),
    }


def inertial_notes(run: Run, result: Result) -> dict[str, str]:
    """Why a value of `summarize_inertial` may be null, by key."""
    truth, estimate = run.problem.sequence.truth, result.estimate
    none = ESTIMATES_NONE if result.inertial is None else ""
    no_truth = none or ("the recording has no ground truth" if truth is None else "")
    alone = REFERENCE if result.name == run.reference else "" if run.reference else "there is no reference"
    notes = {
        "nees_state": no_truth
        or (NO_COVARIANCE if estimate.state_covariance is None else "")
        or "no frame has both ground truth of it and a positive definite covariance"
    }
    for name in QUANTITIES:
        lacking = f"the ground truth has no {name.replace('_', ' ')}"
        missing = no_truth or ("" if getattr(truth, name) is not None else lacking)
        for key in (name, *(["velocity_unaligned"] if name == "velocity" else [])):
            notes[key] = missing or "no frame has both an estimate and ground truth of it"
            notes[f"{key}.inside_3_sigma"] = missing or NO_COVARIANCE
        notes[f"{name}_divergence"] = none or alone or "no frame has it of both the estimator and the reference"
    return notes


def _figures(table: pd.DataFrame | None, name: str, *without: str) -> dict[str, float] | None:
    """`compare.quantity_summary`; None where the table has no error of the quantity."""
    if table is None or table[name].isna().all():
        return None
    return {key: value for key, value in compare.quantity_summary(table, name).items() if key not in without}


def _nees(table: pd.DataFrame | None) -> Mapping[str, Any] | None:
    if table is None or table.isna().all(axis=None):
        return None
    degrees = {"state": 15.0, **dict.fromkeys(BLOCKS, 3.0)}
    each = {name: compare.nees_summary(table[name].to_numpy(), dof) for name, dof in degrees.items()}
    return {**each.pop("state"), **each}
