"""Errors and consistency of the states that raw inertial data determine: pose, velocity and biases.

Errors are those of `geometry.strapdown`: [translation, rotation, velocity, gyroscope bias, accelerometer bias]. The
error of a pose X is e = log(X^-1 X_true) in the estimated body frame. The other errors are true minus estimated value,
with velocities in world axes.

The NEES uses the velocity error of the extended pose instead (Brossard et al., IEEE T-RO 2022):
R J(theta)^-1 R^T (v_true - v), with J the left Jacobian of the rotation error theta. Both errors are equal to first
order, so the covariance is the same. The second-order difference matters: P relates position and velocity to 0.02 mm
per frame by the samples, and theta times the velocity error would be 1 mm at 2 degrees and 0.3 m/s. In the extended
pose, the errors of position and velocity rotate alike with theta.

No alignment precedes the NEES: position and heading of frame 0 define the world of truth and estimate. Where the truth
begins later, the worlds are aligned over its first frames, and the NEES of position and heading is too low.
"""

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Truth
from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, se3, strapdown
from fgbaseline.geometry.strapdown import BLOCKS

from ..statistics.chi_square import mahalanobis_squared
from ..statistics.descriptive import summarized
from .covariance import is_positive_definite
from .nees import body_error

QUANTITIES = ("velocity", "gyroscope_bias", "accelerometer_bias")
"""blocks that are additive, in m/s, rad/s and m/s^2"""
AXES = "xyz"


def state_error(estimate: Estimate, other: Truth | Estimate) -> FloatArray:
    """Error (T, 15) of the state, `other` minus `estimate`, see the module; NaN where either lacks a value."""
    T = len(estimate.world_T_imu)
    error = np.full((T, strapdown.STATE), np.nan)
    error[:, :6] = body_error(estimate, other)
    for name in QUANTITIES:
        here, there = getattr(estimate, name), getattr(other, name)
        if here is not None and there is not None:
            error[:, BLOCKS[name]] = there - here
    return error


def _extended_pose_error(estimate: Estimate, other: Truth | Estimate) -> FloatArray:
    """`state_error` (T, 15) with the velocity error of the extended pose, in world axes."""
    error = state_error(estimate, other)
    k = np.flatnonzero(np.isfinite(error[:, :9]).all(axis=1))
    X, X_other = _with_velocity(estimate, k), _with_velocity(other, k)
    in_body = se3.log(se3.inverse(X) @ X_other)[:, :3]
    error[k, strapdown.VELOCITY] = (X[:, :3, :3] @ in_body[:, :, None])[..., 0]
    return error


def _with_velocity(states: Truth | Estimate, k: IntArray) -> FloatArray:
    """Poses (n, 4, 4) of the frames k (n,) with velocities in place of positions."""
    poses = states.world_T_imu[k]
    if states.velocity is not None:
        poses[:, :3, 3] = states.velocity[k]
    return poses


def state_nees(estimate: Estimate, truth: Truth) -> pd.DataFrame:
    """NEES by frame of the whole `state` (15 degrees of freedom) and of each of `BLOCKS` (3 each).

    NaN where truth or estimate lacks a value or the block's covariance is not positive definite: position and heading
    of frame 0 have no variance. Bar-Shalom, Li and Kirubarajan (2001), section 5.4.
    """
    blocks = {"state": slice(0, strapdown.STATE), **BLOCKS}
    table = pd.DataFrame(
        np.nan, index=pd.RangeIndex(len(estimate.world_T_imu), name="frame"), columns=list(blocks), dtype=np.float64
    )
    if estimate.state_covariance is None:
        return table
    error = _extended_pose_error(estimate, truth)
    for name, block in blocks.items():
        e, P = error[:, block], estimate.state_covariance[:, block, block]
        k = np.flatnonzero(np.isfinite(e).all(axis=1) & np.isfinite(P).all(axis=(1, 2)))
        k = k[is_positive_definite(P[k])]
        table.loc[k, name] = mahalanobis_squared(e[k], P[k])
    return table


def velocity_and_bias_errors(
    estimate: Estimate, other: Truth | Estimate, rotation: FloatArray | None = None
) -> pd.DataFrame:
    """Errors of velocity and biases against truth or another estimate, one row per `frame`.

    For each Q of `QUANTITIES` there are the columns Q, the norm of the error; Q_x to Q_z, estimate minus other; and
    Q_sigma_x to Q_sigma_z, 1-sigma of the estimate. `velocity` is in m/s and world axes, `gyroscope_bias` in rad/s and
    `accelerometer_bias` in m/s^2 in IMU axes. `rotation` (3, 3), other_R_estimate, aligns the worlds. NaN where either
    lacks a value.
    """
    table = velocity_and_biases(estimate, rotation)
    columns: dict[str, FloatArray] = {}
    for name in QUANTITIES:
        there = getattr(other, name)
        each = [f"{name}_{axis}" for axis in AXES]
        error = np.full((len(table), 3), np.nan) if there is None else table[each].to_numpy() - there
        columns[name] = np.linalg.norm(error, axis=1)
        columns |= dict(zip(each, error.T, strict=True))
        columns |= {f"{name}_sigma_{axis}": table[f"{name}_sigma_{axis}"].to_numpy() for axis in AXES}
    return pd.DataFrame(columns, index=table.index)


def velocity_and_biases(estimate: Estimate, rotation: FloatArray | None = None) -> pd.DataFrame:
    """Estimated velocity and biases, one row per `frame`.

    For each Q of `QUANTITIES` there are the columns Q_x to Q_z and their 1-sigma, Q_sigma_x to Q_sigma_z, in the units
    and axes of `velocity_and_bias_errors`; NaN where unknown. `rotation` (3, 3), other_R_estimate, rotates velocities
    into another world.
    """
    T, P = len(estimate.world_T_imu), estimate.state_covariance
    columns: dict[str, FloatArray] = {}
    for name in QUANTITIES:
        value, unknown = getattr(estimate, name), np.full((T, 3), np.nan)
        variance = None if P is None else P[:, BLOCKS[name], BLOCKS[name]]
        if name == "velocity" and rotation is not None:
            value = None if value is None else value @ rotation.T
            variance = None if variance is None else rotation @ variance @ rotation.T
        value = unknown if value is None else value
        sigma = unknown if variance is None else np.sqrt(np.maximum(np.einsum("tii->ti", variance), 0.0))
        columns |= {f"{name}_{axis}": value[:, i] for i, axis in enumerate(AXES)}
        columns |= {f"{name}_sigma_{axis}": sigma[:, i] for i, axis in enumerate(AXES)}
    return pd.DataFrame(columns, index=pd.RangeIndex(T, name="frame"))


def quantity_summary(table: pd.DataFrame, name: str) -> dict[str, float]:
    """RMSE, mean, median, p95, maximum and last known value of the norm, and the RMSE of each axis.

    `inside_3_sigma` is the share of components within 3 sigma (0.9973 of Gaussian errors); all NaN without an error.
    """
    norm = table[name].to_numpy()
    error, sigma = (table[[f"{name}_{part}{axis}" for axis in AXES]].to_numpy() for part in ("", "sigma_"))
    known = np.isfinite(norm)
    judged = known[:, None] & (sigma > 0.0)
    inside = float((np.abs(error) <= 3.0 * sigma)[judged].mean()) if judged.any() else float("nan")
    per_axis = np.sqrt((error[known] ** 2).mean(axis=0)) if known.any() else np.full(3, np.nan)
    return {
        **summarized(table[name]),
        "final": float(norm[known][-1]) if known.any() else float("nan"),
        **{f"rmse_{axis}": float(value) for axis, value in zip(AXES, per_axis, strict=True)},
        "inside_3_sigma": inside,
    }
