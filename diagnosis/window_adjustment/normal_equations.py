"""Normal equations of windows: landmarks eliminated by the Schur complement, poses and calibration parameters left.

Pixel terms are summed in world axes. There the pose blocks of an observation follow from the 3x3 information about its
point and the arm from the IMU to the point, by cross products; only the sums of a frame are rotated to the axes of its
pose. Terms of observations, frames and intervals are computed for a batch of windows at once, dense matrices for each.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, MeasurementModel

from .residuals import N_CALIBRATION, OFFSET, MotionTerms, PixelTerms, WindowBatch

DAMPING = 3e-10
"""1/baseline^2, on each coordinate of a landmark"""


class Landmarks(NamedTuple):
    """Landmark blocks of the normal equations, for the elimination of m landmarks."""

    factor: FloatArray
    """(6, m) Cholesky factors L of the landmarks' information, row by row"""
    gradient: FloatArray
    """(3, m) whitened gradients L^-1 b"""
    with_pose: FloatArray
    """(18, n) block (6, 3) of each observation between its pose, in world axes, and its landmark, times L^-T"""
    with_offset: FloatArray
    """(3, m) blocks between disparity offset and landmark, times L^-T"""


class Frames(NamedTuple):
    """Pose blocks of the normal equations of F poses (right perturbations) and the calibration parameters."""

    H: FloatArray
    """(F, 6, 6)"""
    with_next: FloatArray
    """(F, 6, 6) between a pose and the next one"""
    right: FloatArray
    """(F, 6, 9) between a pose and the calibration parameters, then the gradient of the pose"""
    calibration: FloatArray
    """(F, 8, 9) information of the calibration parameters, then their gradient; to be summed over a window"""


class ReducedSystem(NamedTuple):
    """The Schur complement of one window on K = W-1 poses and calibration parameters, with its back-substitution."""

    H: FloatArray
    """(6K + 8, 6K + 8)"""
    g: FloatArray
    """(6K + 8,)"""
    cross: FloatArray
    """(6K + 1, 3m) between poses (in world axes) and offset, and landmarks, times L^-T"""


def normal_equation_blocks(
    batch: WindowBatch, pixels: PixelTerms, motions: MotionTerms, model: MeasurementModel
) -> tuple[Landmarks, Frames]:
    """Blocks of all windows of a batch, from terms at poses (F, 4, 4)."""
    sigma = np.sqrt(model.variance)
    n, m, F = len(batch.landmark), batch.n_points, batch.n_frames
    root = np.sqrt(pixels.weight)
    A, r, arm = pixels.J_point * root, pixels.residual * root, pixels.arm
    information = np.empty((3, 3, n))
    for i in range(3):
        information[i, i:] = information[i:, i] = (A[:, i : i + 1] * A[:, i:]).sum(axis=0)
    gradient, by_offset = (A * r[:, None]).sum(axis=0), A[1] * (root / sigma)
    by_point = _summed_by_point(np.concatenate([information.reshape(9, n), gradient, by_offset]), batch.landmark, m)
    factor = _cholesky(by_point[:9].reshape(3, 3, m), DAMPING / model.camera.unit_length**2)
    over = _over(factor[:, batch.landmark], information)
    with_pose = -np.concatenate([over, _crossed(arm, over)]).reshape(18, n)
    landmarks = Landmarks(factor, _over(factor, by_point[9:12]), with_pose, _over(factor, by_point[12:]))
    torque = _crossed(arm, information)
    rotational, crossed_gradient = _crossed(arm, torque.swapaxes(0, 1)), _crossed(arm, gradient)
    offset, offset_gradient = (root / sigma) ** 2, r[1] * (root / sigma)
    parts = [information, torque, rotational, by_offset, _crossed(arm, by_offset), gradient, crossed_gradient]
    parts += [offset, offset_gradient]
    return landmarks, _frames(batch, _summed_by_frame(parts, batch.frame, F), pixels.rotation, motions)


def schur_complement(
    batch: WindowBatch, window: int, landmarks: Landmarks, frames: Frames, rotation: FloatArray
) -> ReducedSystem:
    """Reduced system of one window, its landmarks eliminated; `rotation` (F, 3, 3) is that of the poses."""
    o, f, p = batch.observations[window], batch.frames[window], batch.points[window]
    K, m = f.stop - f.start - 1, p.stop - p.start
    n, k = 6 * K, np.arange(K)
    cross = np.zeros((6 * (K + 1) + 1) * 3 * m)
    entry = 18 * m * (batch.frame[o] - f.start) + (batch.landmark[o] - p.start)
    cross[np.arange(0, 18 * m, m)[:, None] + entry] = landmarks.with_pose[:, o]
    cross = cross.reshape(-1, 3 * m)[6:]
    cross[-1] = landmarks.with_offset[:, p].reshape(3 * m)
    own = slice(f.start + 1, f.stop)
    poses = np.zeros((K, 6, K, 6))
    poses[k, :, k] = frames.H[own]
    off = frames.with_next[f.start + 1 : f.stop - 1]
    poses[k[:-1], :, k[1:]], poses[k[1:], :, k[:-1]] = off, off.swapaxes(1, 2)
    H, g = np.empty((n + N_CALIBRATION, n + N_CALIBRATION)), np.empty(n + N_CALIBRATION)
    right, calibration = frames.right[own].reshape(n, N_CALIBRATION + 1), frames.calibration[f].sum(axis=0)
    H[:n, :n], H[:n, n:], H[n:, :n] = poses.reshape(n, n), right[:, :N_CALIBRATION], right[:, :N_CALIBRATION].T
    H[n:, n:], g[:n], g[n:] = calibration[:, :N_CALIBRATION], right[:, N_CALIBRATION], calibration[:, N_CALIBRATION]
    schur = _rotated(_rotated(cross @ cross.T, rotation[own]).T, rotation[own])
    H[:n, :n] -= schur[:n, :n]
    H[:n, n + OFFSET] -= schur[:n, n]
    H[n + OFFSET, :n] -= schur[n, :n]
    H[n + OFFSET, n + OFFSET] -= schur[n, n]
    reduced = _rotated(cross @ landmarks.gradient[:, p].reshape(3 * m), rotation[own])
    g[:n] -= reduced[:n]
    g[n + OFFSET] -= reduced[n]
    return ReducedSystem(H, g, cross)


def back_substitute(system: ReducedSystem, rotation: FloatArray, delta: FloatArray) -> FloatArray:
    """Part (3, m) of the whitened landmark gradients that the solution `delta` (6K + 8,) explains."""
    n = 6 * len(rotation)
    moved = (np.repeat(rotation, 2, axis=0) @ delta[:n].reshape(-1, 3, 1)).reshape(n)
    return np.asarray((np.append(moved, delta[n + OFFSET]) @ system.cross).reshape(3, -1), dtype=np.float64)


def landmark_steps(factor: FloatArray, gradient: FloatArray) -> FloatArray:
    """Steps L^-T g (m, 3), m, of landmarks with the remaining whitened gradients g (3, m)."""
    l00, l10, l11, l20, l21, l22 = factor
    z = gradient[2] / l22
    y = (gradient[1] - l21 * z) / l11
    return np.stack([(gradient[0] - l10 * y - l20 * z) / l00, y, z], axis=1)


def interval_covariances(covariance: FloatArray) -> FloatArray:
    """Covariances (K, 20, 20) of the parameters that each interval's residual depends on.

    They are the poses before and after it and the calibration parameters, out of a window's covariance
    (6K + 8, 6K + 8). The pose before the first interval is fixed, and its part has no meaning.
    """
    K = (len(covariance) - N_CALIBRATION) // 6
    own = 6 * np.arange(K)[:, None] + np.arange(6)
    calibration = np.broadcast_to(6 * K + np.arange(N_CALIBRATION), (K, N_CALIBRATION))
    index = np.concatenate([np.concatenate([own[:1], own[:-1]]), own, calibration], axis=1)
    return np.asarray(covariance[index[:, :, None], index[:, None, :]], dtype=np.float64)


def _frames(batch: WindowBatch, sums: FloatArray, rotation: FloatArray, motions: MotionTerms) -> Frames:
    F = batch.n_frames
    H, right = np.empty((F, 6, 6)), np.zeros((F, 6, N_CALIBRATION + 1))
    calibration = np.zeros((F, N_CALIBRATION, N_CALIBRATION + 1))
    back = rotation.swapaxes(1, 2)
    H[:, :3, :3] = back @ _blocks(sums[:9]) @ rotation
    H[:, 3:, :3] = back @ _blocks(sums[9:18]) @ rotation
    H[:, :3, 3:] = H[:, 3:, :3].swapaxes(1, 2)
    H[:, 3:, 3:] = back @ _blocks(sums[18:27]) @ rotation
    columns = -(back @ sums[27:39].reshape(4, 3, F).transpose(2, 1, 0))
    right[:, :3, OFFSET], right[:, 3:, OFFSET] = columns[:, :, 0], columns[:, :, 1]
    right[:, :3, N_CALIBRATION], right[:, 3:, N_CALIBRATION] = columns[:, :, 2], columns[:, :, 3]
    calibration[:, OFFSET, OFFSET], calibration[:, OFFSET, N_CALIBRATION] = sums[39], sums[40]
    before, after = batch.interval, batch.interval + 1
    J_before, J_after, J_calibration = motions.J_before, motions.J_after, motions.J_calibration
    on = np.concatenate([J_calibration, motions.residual[:, :, None]], axis=2)
    H[after] += J_after.swapaxes(1, 2) @ J_after
    right[after] += J_after.swapaxes(1, 2) @ on
    H[before] += J_before.swapaxes(1, 2) @ J_before
    right[before] += J_before.swapaxes(1, 2) @ on
    calibration[after] += J_calibration.swapaxes(1, 2) @ on
    with_next = np.zeros((F, 6, 6))
    with_next[before] = J_before.swapaxes(1, 2) @ J_after
    return Frames(H, with_next, right, calibration)


def _blocks(sums: FloatArray) -> FloatArray:
    """Blocks (F, 3, 3) from sums (9, F)."""
    return sums.reshape(3, 3, -1).transpose(2, 0, 1)


def _rotated(rows: FloatArray, rotation: FloatArray) -> FloatArray:
    """Rows (6K + 1, ...) of poses, rotated from world axes to those of the poses by `rotation` (K, 3, 3)."""
    n = 6 * len(rotation)
    turned = rows.copy()
    back = np.repeat(rotation.swapaxes(1, 2), 2, axis=0)
    turned[:n] = (back @ rows[:n].reshape(len(back), 3, -1)).reshape(rows[:n].shape)
    return turned


def _crossed(arm: FloatArray, columns: FloatArray) -> FloatArray:
    """Cross products (3, ..., n) of arm (3, n) and columns (3, ..., n)."""
    a, (x, y, z) = arm, columns
    return np.stack([a[1] * z - a[2] * y, a[2] * x - a[0] * z, a[0] * y - a[1] * x])


def _cholesky(information: FloatArray, damping: float) -> FloatArray:
    """Cholesky factors (6, m), row by row, of information (3, 3, m) plus damping, the lower bound of the pivots."""
    (a, b, c), (_, d, e), (_, _, f) = information
    l00 = np.sqrt(a + damping)
    l10, l20 = b / l00, c / l00
    l11 = np.sqrt(np.maximum(d + damping - l10**2, damping))
    l21 = (e - l20 * l10) / l11
    l22 = np.sqrt(np.maximum(f + damping - l20**2 - l21**2, damping))
    return np.stack([l00, l10, l11, l20, l21, l22])


def _over(factor: FloatArray, rows: FloatArray) -> FloatArray:
    """Rows (..., 3, n) times L^-T of factors L (6, n)."""
    l00, l10, l11, l20, l21, l22 = factor
    over = np.empty(rows.shape)
    over[..., 0, :] = rows[..., 0, :] / l00
    over[..., 1, :] = (rows[..., 1, :] - l10 * over[..., 0, :]) / l11
    over[..., 2, :] = (rows[..., 2, :] - l20 * over[..., 0, :] - l21 * over[..., 1, :]) / l22
    return over


def _summed_by_point(values: FloatArray, landmark: IntArray, m: int) -> FloatArray:
    """Sums (k, m) of values (k, n) over the observations of each landmark."""
    sums = np.empty((len(values), m))
    for i, value in enumerate(values):
        sums[i] = np.bincount(landmark, weights=value, minlength=m)
    return sums


def _summed_by_frame(values: list[FloatArray], frame: IntArray, n_frames: int) -> FloatArray:
    """Sums (k, n_frames) of values (..., n), k in all, over the observations of each frame."""
    flat = np.concatenate([value.reshape(-1, len(frame)) for value in values])
    starts = np.flatnonzero(np.diff(frame, prepend=-1))
    sums = np.zeros((len(flat), n_frames))
    sums[:, frame[starts]] = np.add.reduceat(flat, starts, axis=1)
    return sums
