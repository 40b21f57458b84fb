"""The normal equations of windows: landmarks eliminated by the Schur complement, poses and shared parameters left.

The pixel terms are added up in world axes, where a pose and a point that move alike look alike: of an observation that
takes the 3x3 information about its point, crossed with the arm from the IMU to it. Only the sums of whole frames are
turned to the axes of their poses. What belongs to single observations, frames and intervals is computed for several
windows at once, what is dense for each of them.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, StereoMeasurement

from .residuals import N_CALIBRATION, OFFSET, Joined, MotionTerms, PixelTerms

DAMPING = 3e-10
"""1/baseline^2, on each coordinate of a landmark"""


class Landmarks(NamedTuple):
    """Landmark blocks of the normal equations, for the elimination of m landmarks."""

    factor: FloatArray
    """(6, m) Cholesky factors of their information, row after row"""
    pull: FloatArray
    """(3, m) their gradients over these"""
    with_pose: FloatArray
    """(18, n) each observation's block (6, 3) between its pose, in world axes, and its landmark, over the factor"""
    with_offset: FloatArray
    """(3, m) the blocks between offset and landmark, over the factor"""


class Frames(NamedTuple):
    """Pose blocks of the normal equations of F poses (right perturbations) and the shared parameters."""

    H: FloatArray
    """(F, 6, 6)"""
    with_next: FloatArray
    """(F, 6, 6) between a pose and the one after it"""
    right: FloatArray
    """(F, 6, 9) between a pose and the shared parameters, and its gradient"""
    shared: FloatArray
    """(F, 8, 9) the same of the shared parameters, to be summed over a window"""


class Reduced(NamedTuple):
    """The Schur complement of one window on K = W-1 poses and shared parameters, with its back-substitution."""

    H: FloatArray
    """(6K + 8, 6K + 8)"""
    g: FloatArray
    """(6K + 8,)"""
    cross: FloatArray
    """(6K + 1, 3m) between poses, in world axes, and offset, and landmarks over their factors"""


def terms_of(
    joined: Joined, pixels: PixelTerms, motions: MotionTerms, model: StereoMeasurement
) -> tuple[Landmarks, Frames]:
    """The blocks of all windows, from terms at poses (F, 4, 4)."""
    sigma = np.sqrt(model.variance)
    n, m, F = len(joined.row), joined.n_points, joined.n_frames
    root = np.sqrt(pixels.weight)
    A, r, arm = pixels.by_point * root, pixels.residual * root, pixels.arm
    information = np.empty((3, 3, n))
    for i in range(3):
        information[i, i:] = information[i:, i] = (A[:, i : i + 1] * A[:, i:]).sum(axis=0)
    pull, by_offset = (A * r[:, None]).sum(axis=0), A[1] * (root / sigma)
    by_point = _summed_by_point(np.concatenate([information.reshape(9, n), pull, by_offset]), joined.row, m)
    factor = _cholesky(by_point[:9].reshape(3, 3, m), DAMPING / model.camera.unit_length**2)
    over = _over(factor[:, joined.row], information)
    with_pose = -np.concatenate([over, _crossed(arm, over)]).reshape(18, n)
    landmarks = Landmarks(factor, _over(factor, by_point[9:12]), with_pose, _over(factor, by_point[12:]))
    torque = _crossed(arm, information)
    turning, turned, offset_turned = _crossed(arm, torque.swapaxes(0, 1)), _crossed(arm, pull), _crossed(arm, by_offset)
    offset, gradient = (root / sigma) ** 2, r[1] * (root / sigma)
    parts = [information, torque, turning, by_offset, offset_turned, pull, turned, offset, gradient]
    return landmarks, _frames(joined, _summed_by_frame(parts, joined.frame, F), pixels.turn, motions)


def schur_complement(joined: Joined, window: int, landmarks: Landmarks, frames: Frames, turn: FloatArray) -> Reduced:
    """The equations of one window, its landmarks eliminated; the poses (F) have rotations `turn` (F, 3, 3)."""
    o, f, p = joined.observations[window], joined.frames[window], joined.points[window]
    K, m = f.stop - f.start - 1, p.stop - p.start
    n, k = 6 * K, np.arange(K)
    cross = np.zeros((6 * (K + 1) + 1) * 3 * m)
    entry = 18 * m * (joined.frame[o] - f.start) + (joined.row[o] - p.start)
    cross[np.arange(0, 18 * m, m)[:, None] + entry] = landmarks.with_pose[:, o]
    cross = cross.reshape(-1, 3 * m)[6:]
    cross[-1] = landmarks.with_offset[:, p].reshape(3 * m)
    own = slice(f.start + 1, f.stop)
    poses = np.zeros((K, 6, K, 6))
    poses[k, :, k] = frames.H[own]
    off = frames.with_next[f.start + 1 : f.stop - 1]
    poses[k[:-1], :, k[1:]], poses[k[1:], :, k[:-1]] = off, off.swapaxes(1, 2)
    H, g = np.empty((n + N_CALIBRATION, n + N_CALIBRATION)), np.empty(n + N_CALIBRATION)
    right, shared = frames.right[own].reshape(n, N_CALIBRATION + 1), frames.shared[f].sum(axis=0)
    H[:n, :n], H[:n, n:], H[n:, :n] = poses.reshape(n, n), right[:, :N_CALIBRATION], right[:, :N_CALIBRATION].T
    H[n:, n:], g[:n], g[n:] = shared[:, :N_CALIBRATION], right[:, N_CALIBRATION], shared[:, N_CALIBRATION]
    schur = _turned(_turned(cross @ cross.T, turn[own]).T, turn[own])
    H[:n, :n] -= schur[:n, :n]
    H[:n, n + OFFSET] -= schur[:n, n]
    H[n + OFFSET, :n] -= schur[n, :n]
    H[n + OFFSET, n + OFFSET] -= schur[n, n]
    pulled = _turned(cross @ landmarks.pull[:, p].reshape(3 * m), turn[own])
    g[:n] -= pulled[:n]
    g[n + OFFSET] -= pulled[n]
    return Reduced(H, g, cross)


def back_substitute(system: Reduced, turn: FloatArray, delta: FloatArray) -> FloatArray:
    """(3, m) what the solution `delta` (6K + 8,) takes off the pull of a window's landmarks."""
    n = 6 * len(turn)
    moved = (np.repeat(turn, 2, axis=0) @ delta[:n].reshape(-1, 3, 1)).reshape(n)
    return np.asarray((np.append(moved, delta[n + OFFSET]) @ system.cross).reshape(3, -1), dtype=np.float64)


def landmark_steps(factor: FloatArray, pull: FloatArray) -> FloatArray:
    """(m, 3) m, of landmarks with this pull (3, m) left."""
    l00, l10, l11, l20, l21, l22 = factor
    z = pull[2] / l22
    y = (pull[1] - l21 * z) / l11
    return np.stack([(pull[0] - l10 * y - l20 * z) / l00, y, z], axis=1)


def around_intervals(covariance: FloatArray) -> FloatArray:
    """(K, 20, 20) the parts of a window's covariance (6K + 8, 6K + 8) that an interval's residual depends on: of the
    poses before and after it and of the shared parameters. Before the first is the held pose: that part means nothing.
    """
    K = (len(covariance) - N_CALIBRATION) // 6
    own = 6 * np.arange(K)[:, None] + np.arange(6)
    shared = np.broadcast_to(6 * K + np.arange(N_CALIBRATION), (K, N_CALIBRATION))
    index = np.concatenate([np.concatenate([own[:1], own[:-1]]), own, shared], axis=1)
    return np.asarray(covariance[index[:, :, None], index[:, None, :]], dtype=np.float64)


def _frames(joined: Joined, sums: FloatArray, turn: FloatArray, motions: MotionTerms) -> Frames:
    F = joined.n_frames
    H, right = np.empty((F, 6, 6)), np.zeros((F, 6, N_CALIBRATION + 1))
    shared = np.zeros((F, N_CALIBRATION, N_CALIBRATION + 1))
    back = turn.swapaxes(1, 2)
    H[:, :3, :3] = back @ _blocks(sums[:9]) @ turn
    H[:, 3:, :3] = back @ _blocks(sums[9:18]) @ turn
    H[:, :3, 3:] = H[:, 3:, :3].swapaxes(1, 2)
    H[:, 3:, 3:] = back @ _blocks(sums[18:27]) @ turn
    columns = -(back @ sums[27:39].reshape(4, 3, F).transpose(2, 1, 0))
    right[:, :3, OFFSET], right[:, 3:, OFFSET] = columns[:, :, 0], columns[:, :, 1]
    right[:, :3, N_CALIBRATION], right[:, 3:, N_CALIBRATION] = columns[:, :, 2], columns[:, :, 3]
    shared[:, OFFSET, OFFSET], shared[:, OFFSET, N_CALIBRATION] = sums[39], sums[40]
    before, after = joined.interval, joined.interval + 1
    J_before, J_after, J_shared = motions.by_before, motions.by_after, motions.by_shared
    on = np.concatenate([J_shared, motions.residual[:, :, None]], axis=2)
    H[after] += J_after.swapaxes(1, 2) @ J_after
    right[after] += J_after.swapaxes(1, 2) @ on
    H[before] += J_before.swapaxes(1, 2) @ J_before
    right[before] += J_before.swapaxes(1, 2) @ on
    shared[after] += J_shared.swapaxes(1, 2) @ on
    with_next = np.zeros((F, 6, 6))
    with_next[before] = J_before.swapaxes(1, 2) @ J_after
    return Frames(H, with_next, right, shared)


def _blocks(sums: FloatArray) -> FloatArray:
    """(F, 3, 3) of (9, F)."""
    return sums.reshape(3, 3, -1).transpose(2, 0, 1)


def _turned(rows: FloatArray, turn: FloatArray) -> FloatArray:
    """Rows (6K + 1, ...) of poses in world axes to those of the poses, whose rotations are `turn` (K, 3, 3)."""
    n = 6 * len(turn)
    turned = rows.copy()
    back = np.repeat(turn.swapaxes(1, 2), 2, axis=0)
    turned[:n] = (back @ rows[:n].reshape(len(back), 3, -1)).reshape(rows[:n].shape)
    return turned


def _crossed(arm: FloatArray, columns: FloatArray) -> FloatArray:
    """(3, ..., n) arm (3, n) x columns (3, ..., n)."""
    a, (x, y, z) = arm, columns
    return np.stack([a[1] * z - a[2] * y, a[2] * x - a[0] * z, a[0] * y - a[1] * x])


def _cholesky(information: FloatArray, damping: float) -> FloatArray:
    """(6, m) factors, row after row, of information (3, 3, m) with its damping, below which no pivot can be."""
    (a, b, c), (_, d, e), (_, _, f) = information
    l00 = np.sqrt(a + damping)
    l10, l20 = b / l00, c / l00
    l11 = np.sqrt(np.maximum(d + damping - l10**2, damping))
    l21 = (e - l20 * l10) / l11
    l22 = np.sqrt(np.maximum(f + damping - l20**2 - l21**2, damping))
    return np.stack([l00, l10, l11, l20, l21, l22])


def _over(factor: FloatArray, rows: FloatArray) -> FloatArray:
    """Rows (..., 3, n) times the inverse transposed of factors (6, n)."""
    l00, l10, l11, l20, l21, l22 = factor
    over = np.empty(rows.shape)
    over[..., 0, :] = rows[..., 0, :] / l00
    over[..., 1, :] = (rows[..., 1, :] - l10 * over[..., 0, :]) / l11
    over[..., 2, :] = (rows[..., 2, :] - l20 * over[..., 0, :] - l21 * over[..., 1, :]) / l22
    return over


def _summed_by_point(values: FloatArray, row: IntArray, m: int) -> FloatArray:
    """(k, m) sums of values (k, n) over the observations of each landmark."""
    sums = np.empty((len(values), m))
    for i, value in enumerate(values):
        sums[i] = np.bincount(row, weights=value, minlength=m)
    return sums


def _summed_by_frame(values: list[FloatArray], frame: IntArray, n_frames: int) -> FloatArray:
    """(k, n_frames) sums of values (..., n), k in all, over the observations of each frame."""
    flat = np.concatenate([value.reshape(-1, len(frame)) for value in values])
    starts = np.flatnonzero(np.diff(frame, prepend=-1))
    sums = np.zeros((len(flat), n_frames))
    sums[:, frame[starts]] = np.add.reduceat(flat, starts, axis=1)
    return sums
