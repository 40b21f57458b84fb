"""The normal equations of a window: landmarks eliminated by the Schur complement, poses and shared parameters left.

The pixel terms are added up in world axes, where a pose and a point that move alike look alike: of an observation that
takes the 3x3 information about its point, crossed with the arm from the IMU to it. Only the sums of whole frames are
turned to the axes of their poses.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray

from ..observations import IntArray
from .window_terms import OFFSET, SHARED, PixelTerms, WindowData

DAMPING = 1e-9
"""1/m^2, on each coordinate of a landmark"""


class Eliminated(NamedTuple):
    """What pixels say of K = W-1 poses and the disparity offset, the landmarks being unknown."""

    H: FloatArray
    """(6K + 1, 6K + 1)"""
    g: FloatArray
    """(6K + 1,)"""
    factor: FloatArray
    """(6, m) Cholesky factors of the landmarks' information, row after row"""
    pull: FloatArray
    """(3, m) their gradients over these"""
    cross: FloatArray
    """(6K + 1, 3, m) the blocks between poses, in world axes, and landmarks over these"""


def eliminated(data: WindowData, terms: PixelTerms, turn: FloatArray, sigma: float, m: int) -> Eliminated:
    """The blocks of right perturbations of all poses but the first, whose rotations are `turn` (K, 3, 3), and of the
    offset, last; the m landmarks taken out."""
    n, K = len(data.frame), len(turn)
    root = np.sqrt(terms.weight)
    A, r, arm = terms.by_point * root, terms.residual * root, terms.arm
    information = np.empty((3, 3, n))
    for i in range(3):
        information[i, i:] = information[i:, i] = (A[:, i : i + 1] * A[:, i:]).sum(axis=0)
    pull = (A * r[:, None]).sum(axis=0)
    by_offset = A[1] * (root / sigma)
    by_point = _summed_by_point(np.concatenate([information.reshape(9, n), pull, by_offset]), data.row, m)
    factor = _cholesky(by_point[:9].reshape(3, 3, m))
    over = _over(factor[:, data.row], information)
    cross = np.zeros((6 * (K + 1) + 1) * 3 * m)
    entry = np.arange(0, 18 * m, m)[:, None] + (18 * m * data.frame + data.row)
    cross[entry] = -np.concatenate([over, _crossed(arm, over)]).reshape(18, n)
    cross = cross.reshape(-1, 3, m)[6:]
    cross[-1] = _over(factor, by_point[12:])
    pulled = _over(factor, by_point[9:12])
    flat = cross.reshape(6 * K + 1, 3 * m)
    H, g = -(flat @ flat.T), -(flat @ pulled.reshape(3 * m))
    torque = _crossed(arm, information)
    sums = _summed_by_frame(
        [
            information,
            torque,
            _crossed(arm, torque.swapaxes(0, 1)),
            pull,
            _crossed(arm, pull),
            by_offset,
            _crossed(arm, by_offset),
            (root / sigma) ** 2,
            r[1] * (root / sigma),
        ],
        data.frame,
        K + 1,
    )
    _add_frames(H, g, sums)
    return Eliminated(_turned(_turned(H, turn).T, turn), _turned(g, turn), factor, pulled, cross)


def landmark_steps(system: Eliminated, turn: FloatArray, delta: FloatArray) -> FloatArray:
    """(m, 3) m, by which the landmarks move when poses and offset move by `delta` (6K + 1,)."""
    moved = np.append((np.repeat(turn, 2, axis=0) @ delta[:-1].reshape(-1, 3, 1)).reshape(-1), delta[-1])
    m = system.pull.shape[1]
    x, y, z = system.pull - (moved @ system.cross.reshape(len(moved), 3 * m)).reshape(3, m)
    l00, l10, l11, l20, l21, l22 = system.factor
    z = z / l22
    y = (y - l21 * z) / l11
    return np.stack([(x - l10 * y - l20 * z) / l00, y, z], axis=1)


def add_motion(
    H: FloatArray, g: FloatArray, r: FloatArray, J_before: FloatArray, J_after: FloatArray, J_shared: FloatArray
) -> None:
    """Adds the terms of K intervals to H (6K + 8, 6K + 8) and g; the pose before the first interval is held."""
    K = len(r)
    n, k = 6 * K, np.arange(K)
    poses = np.zeros((K, 6, K, 6))
    poses[k, :, k] = J_after.swapaxes(1, 2) @ J_after
    poses[k[:-1], :, k[:-1]] += J_before[1:].swapaxes(1, 2) @ J_before[1:]
    off = J_before[1:].swapaxes(1, 2) @ J_after[1:]
    poses[k[:-1], :, k[1:]], poses[k[1:], :, k[:-1]] = off, off.swapaxes(1, 2)
    H[:n, :n] += poses.reshape(n, n)
    right = np.concatenate([J_shared, r[:, :, None]], axis=2)
    onto = J_after.swapaxes(1, 2) @ right
    onto[:-1] += J_before[1:].swapaxes(1, 2) @ right[1:]
    H[:n, n:] += onto[:, :, :SHARED].reshape(n, SHARED)
    H[n:, :n] += onto[:, :, :SHARED].reshape(n, SHARED).T
    g[:n] += onto[:, :, SHARED].reshape(n)
    shared = J_shared.reshape(n, SHARED)
    H[n:, n:] += shared.T @ shared
    g[n:] += shared.T @ r.reshape(n)


def add_pixels(H: FloatArray, g: FloatArray, system: Eliminated) -> None:
    """Adds the pixel terms to H (6K + 8, 6K + 8) and g."""
    n = len(system.g) - 1
    H[:n, :n] += system.H[:n, :n]
    H[:n, n + OFFSET] += system.H[:n, n]
    H[n + OFFSET, :n] += system.H[n, :n]
    H[n + OFFSET, n + OFFSET] += system.H[n, n]
    g[:n] += system.g[:n]
    g[n + OFFSET] += system.g[n]


def motion_redundancy(
    covariance: FloatArray, J_before: FloatArray, J_after: FloatArray, J_shared: FloatArray
) -> FloatArray:
    """(K, 6) 1 - diag(J Sigma J^T) of each whitened motion residual."""
    K = len(J_after)
    n, k = 6 * K, np.arange(K)
    poses, with_shared = covariance[:n, :n].reshape(K, 6, K, 6), covariance[:n, n:].reshape(K, 6, SHARED)
    before = np.maximum(k - 1, 0)  # of the first interval there is none
    J_before = J_before * (k > 0)[:, None, None]
    JS_before = J_before @ poses[before, :, before] + J_after @ poses[k, :, before]
    JS_before += J_shared @ with_shared[before].swapaxes(1, 2)
    JS_after = J_before @ poses[before, :, k] + J_after @ poses[k, :, k] + J_shared @ with_shared.swapaxes(1, 2)
    JS_shared = J_before @ with_shared[before] + J_after @ with_shared + J_shared @ covariance[n:, n:]
    absorbed = (
        (JS_before * J_before).sum(axis=2) + (JS_after * J_after).sum(axis=2) + (JS_shared * J_shared).sum(axis=2)
    )
    return np.asarray(1.0 - absorbed, dtype=np.float64)


def _add_frames(H: FloatArray, g: FloatArray, sums: FloatArray) -> None:
    """Adds to H and g, in world axes, the sums of each frame; of the first, whose pose is held, the offset's alone."""
    K = (len(g) - 1) // 6
    H[-1, -1] += sums[39].sum()
    g[-1] += sums[40].sum()
    k, sums = np.arange(K), sums[:, 1:]
    blocks = np.empty((K, 6, 6))
    blocks[:, :3, :3] = np.moveaxis(sums[:9].reshape(3, 3, K), 2, 0)
    blocks[:, 3:, :3] = np.moveaxis(sums[9:18].reshape(3, 3, K), 2, 0)
    blocks[:, :3, 3:] = blocks[:, 3:, :3].swapaxes(1, 2)
    blocks[:, 3:, 3:] = np.moveaxis(sums[18:27].reshape(3, 3, K), 2, 0)
    diagonal = np.zeros((K, 6, K, 6))
    diagonal[k, :, k] = blocks
    H[:-1, :-1] += diagonal.reshape(6 * K, 6 * K)
    g[:-1] -= sums[27:33].T.reshape(-1)
    H[:-1, -1] -= sums[33:39].T.reshape(-1)
    H[-1, :-1] -= sums[33:39].T.reshape(-1)


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


def _cholesky(information: FloatArray) -> FloatArray:
    """(6, m) factors, row after row, of information (3, 3, m) with its damping, below which no pivot can be."""
    (a, b, c), (_, d, e), (_, _, f) = information
    l00 = np.sqrt(a + DAMPING)
    l10, l20 = b / l00, c / l00
    l11 = np.sqrt(np.maximum(d + DAMPING - l10**2, DAMPING))
    l21 = (e - l20 * l10) / l11
    l22 = np.sqrt(np.maximum(f + DAMPING - l20**2 - l21**2, DAMPING))
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
    k = len(values)
    entry = np.arange(0, k * m, m)[:, None] + row
    sums = np.bincount(entry.reshape(-1), weights=values.reshape(-1), minlength=k * m)
    return np.asarray(sums.reshape(k, m), dtype=np.float64)


def _summed_by_frame(values: list[FloatArray], frame: IntArray, n_frames: int) -> FloatArray:
    """(k, n_frames) sums of values (..., n), k in all, over the observations of each frame."""
    flat = np.concatenate([value.reshape(-1, len(frame)) for value in values])
    starts = np.flatnonzero(np.diff(frame, prepend=-1))
    sums = np.zeros((len(flat), n_frames))
    sums[:, frame[starts]] = np.add.reduceat(flat, starts, axis=1)
    return sums
