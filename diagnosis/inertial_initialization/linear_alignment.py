"""Initial values: gyroscope bias, then gravity and velocities by linear least squares.

Qin, Li and Shen, *VINS-Mono*, IEEE T-RO 2018, section V-B, with the metric scale of a stereo camera: the bias of the
gyroscope from rotations, then gravity and velocities, and then gravity held to its magnitude. Positions are unknowns
too, so that an interval may be without odometry.
"""

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.geometry import FloatArray, so3, strapdown

from ..robust_constants import MAD_TO_SIGMA
from .least_squares import ACCELEROMETER_BIAS_SIGMA, GYROSCOPE_BIAS_SIGMA
from .states import Motions, RelativePoses, States, motions_between

ROUNDS = 4
"""refinements of gravity on the tangent plane of its sphere"""
BIAS_ROUNDS = 3
FLOOR = 1e-3
"""m and m/s, smallest deviation of an inertial motion in these equations"""


def aligned(imu: ImuIntervals, frames: IntArray, seen: RelativePoses) -> States:
    """Initial states of keyframes at `frames` (n,), in a world whose z axis points up; `seen` joins neighbors.

    Position and heading of the first are those of `so3.rotation_to_z`.
    """
    n = len(frames)
    known = np.zeros(n - 1, dtype=np.bool_)
    known[seen.first] = True
    rotation = np.tile(np.eye(3), (n - 1, 1, 1))
    rotation[seen.first] = seen.motion[:, :3, :3]
    bias = gyroscope_bias(imu, frames, rotation, known)
    identity = np.tile(np.eye(4), (n, 1, 1))
    biases, none = np.tile(bias, (n, 1)), np.zeros((n, 3))
    motions = motions_between(imu, frames, np.concatenate([biases, none], axis=1)[:-1])
    rotation[~known] = motions.rotation[~known]
    R = np.tile(np.eye(3), (n, 1, 1))
    for i in range(n - 1):
        R[i + 1] = R[i] @ rotation[i]
    position, velocity, gravity = _gravity_and_velocities(imu, motions, R, seen)
    world_R = so3.rotation_to_z(-gravity)
    pose = identity.copy()
    pose[:, :3, :3] = world_R @ R
    pose[:, :3, 3] = position @ world_R.T
    return States(pose, velocity @ world_R.T, biases, none)


def gyroscope_bias(imu: ImuIntervals, frames: IntArray, rotation: FloatArray, known: BoolArray) -> FloatArray:
    """Gyroscope bias (3,), rad/s, that fits the visual rotations (n-1, 3, 3) of the `known` intervals."""
    bias, none = np.zeros(3), np.zeros(3)
    integrated = motions_between(imu, frames, np.zeros((len(frames) - 1, 6)))
    for _ in range(BIAS_ROUNDS):
        motions = integrated.at(np.tile(np.concatenate([bias, none]), (len(frames) - 1, 1)))
        J = motions.transition[known, strapdown.ROTATION, strapdown.GYROSCOPE_BIAS]
        residual = so3.log_so3(np.swapaxes(motions.rotation[known], 1, 2) @ rotation[known])
        dt = motions.dt[known]
        scatter = MAD_TO_SIGMA * np.median(np.linalg.norm(residual - np.median(residual, axis=0), axis=1)) + 1e-6
        norm = np.linalg.norm(residual - np.median(residual / dt[:, None], axis=0) * dt[:, None], axis=1)
        weight = np.minimum(1.0, 2.0 * scatter / np.maximum(norm, 1e-12)) / scatter**2
        H = np.einsum("n,nij,nik->jk", weight, J, J) + np.eye(3) * GYROSCOPE_BIAS_SIGMA**-2
        gradient = np.einsum("n,nij,ni->j", weight, J, residual) - bias * GYROSCOPE_BIAS_SIGMA**-2
        bias = bias + np.linalg.solve(H, gradient)
    return np.asarray(bias, dtype=np.float64)


def _gravity_and_velocities(
    imu: ImuIntervals, motions: Motions, R: FloatArray, seen: RelativePoses
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions and velocities (n, 3) and gravity (3,), in the axes of the first keyframe.

    Unknowns are positions and velocities after the first position, an accelerometer bias under its prior, and gravity.
    """
    A, b, n = *_equations(motions, R, seen), len(R)
    gravity = np.linalg.lstsq(A, b, rcond=None)[0][-3:]
    gravity *= imu.gravity / max(float(np.linalg.norm(gravity)), 1e-9)
    solution = np.zeros(A.shape[1] - 1)
    for _ in range(ROUNDS):
        tangent = np.linalg.svd(gravity[None])[2][1:].T
        reduced = np.concatenate([A[:, :-3], A[:, -3:] @ tangent], axis=1)
        solution = np.linalg.lstsq(reduced, b - A[:, -3:] @ gravity, rcond=None)[0]
        gravity = gravity + tangent @ solution[-2:]
        gravity *= imu.gravity / float(np.linalg.norm(gravity))
    states = np.concatenate([np.zeros(3), solution[: 6 * n - 3]]).reshape(-1, 3)
    return states[:n], states[n : 2 * n], np.asarray(gravity, dtype=np.float64)


def _equations(motions: Motions, R: FloatArray, seen: RelativePoses) -> tuple[FloatArray, FloatArray]:
    """Whitened rows and right side of [positions but the first, velocities, accelerometer bias, gravity]."""
    n = len(R)
    width = 6 * n - 3 + 6
    rows: list[FloatArray] = []
    right: list[FloatArray] = []

    def add(terms: dict[int, FloatArray], value: FloatArray, sigma: float) -> None:
        row = np.zeros((3, width + 3))
        for start, block in terms.items():
            row[:, start : start + 3] += block
        rows.append(row[:, 3:] / sigma)
        right.append(value / sigma)

    def p(i: int) -> int:
        return 3 * i

    def v(i: int) -> int:
        return 3 * n + 3 * i

    bias, gravity, unit = 6 * n, 6 * n + 3, np.eye(3)
    for i, dt in enumerate(motions.dt.tolist()):
        sigma = np.maximum(FLOOR, np.sqrt(motions.noise[i, [0, 6], [0, 6]]))
        half = 0.5 * dt**2
        terms = {p(i + 1): unit, p(i): -unit, v(i): -dt * unit, gravity: -half * unit, bias: half * R[i]}
        add(terms, R[i] @ motions.position[i], sigma[0])
        terms = {v(i + 1): unit, v(i): -unit, gravity: -dt * unit, bias: dt * R[i]}
        add(terms, R[i] @ motions.velocity[i], sigma[1])
    for i, motion, covariance in zip(seen.first.tolist(), seen.motion, seen.covariance, strict=True):
        sigma_seen = float(np.sqrt(np.trace(covariance[:3, :3]) / 3.0))
        add({p(i + 1): unit, p(i): -unit}, R[i] @ motion[:3, 3], sigma_seen)
    add({bias: unit}, np.zeros(3), ACCELEROMETER_BIAS_SIGMA)
    return np.concatenate(rows), np.concatenate(right)
