"""Gauss-Newton over keyframes: inertial motions between neighbors, and what the cameras measure of their poses.

Errors are those of `geometry.strapdown`. The first keyframe has no position and no heading to be found, since they
define the world: 11 of its 15 errors are free. Biases have a prior, and relative poses Huber's weight.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.geometry import FloatArray, se3, strapdown

from .states import Motions, RelativePoses, States, motions_between
from .structureless_factors import KeyframeTracks

STATE = strapdown.STATE
GYROSCOPE_BIAS_SIGMA = 0.1
"""rad/s, prior about zero: units of low grade read as much at rest"""
ACCELEROMETER_BIAS_SIGMA = 0.2
"""m/s^2, prior about zero: 20 mg"""
HUBER = 3.5
"""norm of a whitened relative pose, of 6 degrees of freedom, beyond which its weight falls"""
ITERATIONS = 12
CONVERGED = 1e-5
"""largest change of a state, in m, rad and their rates"""
SMALLEST_SIGMA = 1e-9
"""sigma of a noise or walk that is zero: keeps its information finite"""
FARTHEST_BIAS = np.repeat([5e-3, 0.1], 3)
"""rad/s and m/s^2, changes of a bias beyond which samples are integrated anew"""

Blocks = tuple[IntArray, IntArray, FloatArray]
"""rows and columns (b,) of keyframes, and their information (b, 15, 15)"""


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """The solved states."""

    states: States
    covariance: FloatArray
    """(15, 15) of the first keyframe's error, velocity in world axes"""
    scale_sigma: float
    """1-sigma of the distance from the first to the farthest keyframe, as a share of it"""
    whitened: FloatArray
    """(m,) squared whitened residual of each relative pose"""


def solve_least_squares(
    states: States, imu: ImuIntervals, frames: IntArray, seen: RelativePoses, tracks: KeyframeTracks | None = None
) -> Solution:
    """States of keyframes at `frames` (n,) of the imu, from an initial value, by relative poses or by their tracks."""
    motions = motions_between(imu, frames, states.biases[:-1])
    for _ in range(ITERATIONS):
        H, g, whitened, free = _normal_equations(states, motions, imu.gravity_vector, seen, tracks)
        step = free @ _factorized(H).solve(g)
        states = states.stepped(step.reshape(-1, STATE))
        if (np.abs(states.biases[:-1] - motions.biases) > FARTHEST_BIAS).any():
            motions = motions_between(imu, frames, states.biases[:-1])
        elif np.abs(step).max() < CONVERGED:
            break
    H, _, whitened, free = _normal_equations(states, motions, imu.gravity_vector, seen, tracks)
    return Solution(states, _first_covariance(H, free), _scale_sigma(states, H, free), whitened)


def _factorized(H: Any) -> Any:
    from scipy.sparse.linalg import splu

    return splu(H)


def _first_covariance(H: Any, free: Any) -> FloatArray:
    """Marginal covariance (15, 15) of the first keyframe."""
    B = free[[*range(STATE)], :].toarray()
    covariance = B @ _factorized(H).solve(np.ascontiguousarray(B.T))
    return np.asarray(0.5 * (covariance + covariance.T), dtype=np.float64)


def _scale_sigma(states: States, H: Any, free: Any) -> float:
    apart = states.pose[:, :3, 3] - states.pose[0, :3, 3]
    squared = np.sum(apart**2, axis=1)
    far = int(np.argmax(squared))
    if not squared[far] > 0.0:
        return np.inf
    slope = np.zeros(STATE * len(states))
    slope[STATE * far :][strapdown.TRANSLATION] = states.pose[far, :3, :3].T @ apart[far] / squared[far]
    of_free = free.T @ slope
    return float(np.sqrt(of_free @ _factorized(H).solve(of_free)))


def _normal_equations(
    states: States, motions: Motions, gravity: FloatArray, seen: RelativePoses, tracks: KeyframeTracks | None
) -> tuple[Any, FloatArray, FloatArray, Any]:
    """Information and gradient of the free errors, squared residuals of the relative poses, and the basis of errors."""
    from scipy.sparse import block_diag, coo_array, csc_array, identity

    n = len(states)
    g = np.zeros((n, STATE))
    numbers = np.arange(n - 1)
    blocks = _added(g, numbers, numbers + 1, *_inertial(states, motions.at(states.biases[:-1]), gravity))
    residual, J_first, J_second = _relative(states, seen)
    information = np.linalg.inv(seen.covariance)
    whitened = np.einsum("mi,mij,mj->m", residual, information, residual)
    weight = np.minimum(1.0, HUBER / np.sqrt(np.maximum(whitened, 1e-300)))
    information = weight[:, None, None] * information
    blocks += _added(g, seen.first, seen.second, residual, J_first, J_second, information)
    if tracks is not None:
        H_tracks, g_tracks = tracks.normal_equations(states.pose)
        g[:, :6] += g_tracks.reshape(n, 6)
        padded = np.zeros((n, n, STATE, STATE))
        padded[:, :, :6, :6] = H_tracks.reshape(n, 6, n, 6).transpose(0, 2, 1, 3)
        row, column = np.indices((n, n)).reshape(2, -1)
        blocks.append((row, column, padded.reshape(-1, STATE, STATE)))
    prior = np.repeat([0.0, 0.0, 0.0, GYROSCOPE_BIAS_SIGMA**-2, ACCELEROMETER_BIAS_SIGMA**-2], 3)
    g[0, 9:] -= prior[9:] * states.biases[0]
    first = np.zeros(1, dtype=np.int64)
    blocks.append((first, first, np.diag(prior)[None]))
    rows, columns, values = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    inner_row, inner_column = np.indices((STATE, STATE))
    at = ((rows[:, None, None] * STATE + inner_row).ravel(), (columns[:, None, None] * STATE + inner_column).ravel())
    H = coo_array((values.ravel(), at), shape=(n * STATE, n * STATE)).tocsc()
    free = csc_array(block_diag([_free_errors(states.pose[0]), identity((n - 1) * STATE)]))
    return csc_array(free.T @ H @ free), free.T @ g.ravel(), whitened, free


def _added(
    g: FloatArray,
    i: IntArray,
    j: IntArray,
    residual: FloatArray,
    J_i: FloatArray,
    J_j: FloatArray,
    information: FloatArray,
) -> list[Blocks]:
    """The blocks of m residuals between keyframes i and j (m,); their gradient is added to g (n, 15)."""
    blocks = []
    for a, J_a in ((i, J_i), (j, J_j)):
        weighted = np.swapaxes(J_a, 1, 2) @ information
        np.subtract.at(g, a, (weighted @ residual[:, :, None])[:, :, 0])
        blocks += [(a, b, weighted @ J_b) for b, J_b in ((i, J_i), (j, J_j))]
    return blocks


def _free_errors(pose: FloatArray) -> FloatArray:
    """Basis (15, 11) of the errors that the first keyframe may have: tilt, velocity and biases."""
    up = pose[2, :3]
    tilt = np.linalg.svd(up[None])[2][1:].T
    basis = np.zeros((STATE, 11))
    basis[strapdown.ROTATION, :2] = tilt
    basis[6:, 2:] = np.eye(9)
    return basis


def _inertial(
    states: States, motions: Motions, gravity: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Residuals (m, 15) of keyframes 1 to m against their prediction, Jacobians by both states, and information."""
    before, dt, m = states.pose[:-1, :3, :3], motions.dt[:, None], len(motions.dt)
    pose = np.tile(np.eye(4), (m, 1, 1))
    pose[:, :3, :3] = before @ motions.rotation
    forward = states.pose[:-1, :3, 3] + states.velocity[:-1] * dt + 0.5 * gravity * dt**2
    pose[:, :3, 3] = forward + (before @ motions.position[:, :, None])[:, :, 0]
    velocity = states.velocity[:-1] + gravity * dt + (before @ motions.velocity[:, :, None])[:, :, 0]
    twist = se3.log(se3.inverse(pose) @ states.pose[1:])
    residual = np.concatenate([twist, states.velocity[1:] - velocity, np.diff(states.biases, axis=0)], axis=1)
    J = np.tile(np.eye(STATE), (m, 1, 1))
    J[:, :6, :6] = se3.inverse_right_jacobian(twist)
    # velocity errors from body to world axes, as `strapdown.world_axes` for one motion
    F, Q, after = motions.transition.copy(), motions.noise.copy(), pose[:, :3, :3]
    F[:, strapdown.VELOCITY] = after @ F[:, strapdown.VELOCITY]
    F[:, :, strapdown.VELOCITY] = F[:, :, strapdown.VELOCITY] @ np.swapaxes(before, 1, 2)
    Q[:, strapdown.VELOCITY] = after @ Q[:, strapdown.VELOCITY]
    Q[:, :, strapdown.VELOCITY] = Q[:, :, strapdown.VELOCITY] @ np.swapaxes(after, 1, 2)
    return residual, -F, J, _information(Q)


def _information(Q: FloatArray) -> FloatArray:
    """The inverses of noises (m, 15, 15), scaled since their blocks have very different units."""
    variance = np.maximum(np.einsum("mii->mi", Q), SMALLEST_SIGMA**2)
    scale = 1.0 / np.sqrt(variance)
    scaled = Q * scale[:, :, None] * scale[:, None, :]
    scaled[:, range(STATE), range(STATE)] = 1.0 + 1e-9
    return np.asarray(np.linalg.inv(scaled) * scale[:, :, None] * scale[:, None, :], dtype=np.float64)


def _relative(states: States, seen: RelativePoses) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Residuals (m, 6) of the relative poses, and their Jacobians (m, 6, 15) by both states."""
    relative = se3.inverse(states.pose[seen.first]) @ states.pose[seen.second]
    residual = se3.log(se3.inverse(seen.motion) @ relative)
    inverse = se3.inverse_right_jacobian(residual)
    J_first, J_second = np.zeros((2, len(residual), 6, STATE))
    J_second[:, :, :6] = inverse
    J_first[:, :, :6] = -inverse @ se3.adjoint(se3.inverse(relative))
    return residual, J_first, J_second
