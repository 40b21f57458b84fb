"""Frame-to-frame stereo visual odometry, robust and vectorized over all pairs of frames.

Hypotheses of a motion come from samples of three track segments (Kabsch). The one with the smallest truncated cost
(MSAC, Torr and Zisserman 2000) is refined by iteratively reweighted least squares. Residuals are pixels of the second
frame, whitened by their own noise and by that of the point triangulated in the first.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, StereoCamera, se3

from ..tracks.track_segments import TrackSegments, track_segments
from .ransac import TRUNCATION, best_hypotheses

MIN_LINKS = 6
"""smallest number of links per pair of frames for a motion"""
REFINEMENTS = 12
SINGULAR_CONDITION = 1e12
"""condition number of a motion's information (baselines and rad) beyond which it is undetermined"""
DAMPING = 1e-9
"""1/baseline^2 and 1/rad^2, of each step"""


@dataclass(frozen=True, eq=False, slots=True)
class Odometry:
    """Motions between consecutive frames, for the T-1 intervals."""

    known: BoolArray
    """(T-1,)"""
    motion: FloatArray
    """(T-1, 4, 4) imu_k_T_imu_(k+1) in the axes of imu_T_cam; NaN where unknown"""
    covariance: FloatArray
    """(T-1, 6, 6) of its right perturbation [v, w]"""
    links: TrackSegments
    whitened: FloatArray
    """(n,) squared whitened residual of each link's three rows under its pair's motion, at `pixel_sigma`"""
    pixel_sigma: float
    """px, of each of the four rows, from the bulk of the residuals"""

    @property
    def inlier(self) -> BoolArray:
        """Mask (n,) of the segments consistent with the motion of their pair."""
        return np.asarray(self.whitened < TRUNCATION, dtype=np.bool_)

    def twist(self, dt: FloatArray) -> FloatArray:
        """(T-1, 6) mean body velocity [v, w] over each interval of dt (T-1,), m/s and rad/s; NaN where unknown."""
        twist = np.full((len(dt), 6), np.nan)
        twist[self.known] = se3.log(self.motion[self.known]) / dt[self.known, None]
        return twist


def odometry(sequence: Sequence) -> Odometry:
    """Motions of all pairs of consecutive frames with enough track segments."""
    links, camera, n_pairs = track_segments(sequence), sequence.stereo_camera, sequence.n_frames - 1
    count = np.bincount(links.frame, minlength=n_pairs)
    known = count >= MIN_LINKS
    links = links.select(known[links.frame])
    M = best_hypotheses(camera, links, n_pairs, count, known)
    blocks = [_block(camera, links, chosen) for chosen in links.blocks()]
    damping = DAMPING * np.diag([camera.baseline**-2] * 3 + [1.0] * 3)
    for step in range(REFINEMENTS):
        whitened, squared = _whitened(camera, blocks, M)
        # Geman-McClure kernel, with its scale annealed down to that of the noise.
        scale = _bulk_sigma(squared) ** 2 * max(9.0, 200.0 * 0.5**step)
        H, gradient = _normal_equations(blocks, whitened, scale / (scale + squared), n_pairs)
        delta = np.zeros((n_pairs, 6))
        delta[known] = np.linalg.solve(H[known] + damping, gradient[known][:, :, None])[:, :, 0]
        M = M @ se3.exp(delta)
    whitened, squared = _whitened(camera, blocks, M)
    sigma = _bulk_sigma(squared)
    inlier = squared < TRUNCATION * sigma**2
    H, _ = _normal_equations(blocks, whitened, inlier.astype(np.float64), n_pairs)
    enough = np.bincount(links.frame[inlier], minlength=n_pairs) >= MIN_LINKS
    known &= enough
    unit = np.repeat([camera.baseline, 1.0], 3)
    known[known] = np.linalg.cond(H[known] * unit[:, None] * unit) < SINGULAR_CONDITION
    motion, covariance = _of_imu(sequence.imu_T_cam, M, H, sigma, known)
    return Odometry(known, motion, covariance, links, squared / sigma**2, sigma)


def _of_imu(
    imu_T_cam: FloatArray, M: FloatArray, H: FloatArray, sigma: float, known: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """IMU motions with covariances, from the motions of points between camera frames (cam_k+1_T_cam_k)."""
    motion, covariance = np.full_like(M, np.nan), np.full((len(M), 6, 6), np.nan)
    motion[known] = imu_T_cam @ se3.inverse(M[known]) @ se3.inverse(imu_T_cam)
    A = se3.adjoint(se3.inverse(motion[known]) @ imu_T_cam)
    covariance[known] = A @ (sigma**2 * np.linalg.inv(H[known])) @ np.swapaxes(A, 1, 2)
    return motion, covariance


class _Block(NamedTuple):
    """Consecutive links (n), each coordinate as a separate array, because stacks of small matrices are far slower."""

    chosen: slice
    """slice of these links among all"""
    pair: IntArray
    """(n,)"""
    point: FloatArray
    """(3, n) m"""
    pixel: FloatArray
    """(3, n) px"""
    by_disparity: FloatArray
    """(3, n) m/px: the point over its disparity, which is how it moves when that shrinks by one pixel"""
    by_column: FloatArray
    """(n,) m/px: how x moves with uL, the disparity kept"""
    by_row: FloatArray
    """(n,) m: the deviation of y, which comes from the mean row, for 1 px of noise in both vL and vR"""


def _block(camera: StereoCamera, links: TrackSegments, chosen: slice) -> _Block:
    point, pixel = np.ascontiguousarray(links.point[chosen].T), np.ascontiguousarray(links.pixel[chosen].T)
    return _Block(
        chosen=chosen,
        pair=links.frame[chosen],
        point=point,
        pixel=pixel,
        by_disparity=point * (point[2] / (camera.fu * camera.baseline)),
        by_column=point[2] / camera.fu,
        by_row=point[2] * (np.sqrt(0.5) / camera.fv),
    )


def _whitened(camera: StereoCamera, blocks: list[_Block], M: FloatArray) -> tuple[list[FloatArray], FloatArray]:
    """Jacobians by delta in M @ exp(delta), [v, w], of each block, and the residuals, whitened (3, 7, n); and the
    squared whitened residuals of all links.

    What whitens a link is the noise of its pixels and that of the point it is predicted from, for 1 px in each row.
    """
    R, p = np.ascontiguousarray(np.moveaxis(M[:, :3, :3], 0, 2)), np.ascontiguousarray(M[:, :3, 3].T)
    whitened = [
        _whitened_block(camera, block, np.take(R, block.pair, axis=2), np.take(p, block.pair, axis=1))
        for block in blocks
    ]
    return whitened, np.concatenate([np.empty(0), *((A[:, 6] ** 2).sum(axis=0) for A in whitened)])


def _whitened_block(camera: StereoCamera, links: _Block, R: FloatArray, p: FloatArray) -> FloatArray:
    x, y, z = links.point
    moved = R[:, 0] * x + R[:, 1] * y + R[:, 2] * z + p
    behind = ~(moved[2] > camera.min_depth)
    moved[:, behind] = [[0.0], [0.0], [1.0]]
    along, seen = np.empty((3, 4, len(x))), camera.rows(moved)
    along[:, :3] = camera.row_derivatives(seen, R)
    along[:, 3] = links.pixel - seen.pixel
    along[:, 3, behind] = 1e6
    whitened = _lowered(_cholesky(_deviations(links, along)), along)
    A = np.empty((3, 7, len(x)))
    A[:, :3], A[:, 6] = whitened[:, :3], whitened[:, 3]
    A[:, 3] = y * A[:, 2] - z * A[:, 1]
    A[:, 4] = z * A[:, 0] - x * A[:, 2]
    A[:, 5] = x * A[:, 1] - y * A[:, 0]
    return A


def _deviations(links: _Block, along: FloatArray) -> FloatArray:
    """(3, 3, n) B: B B^T is the covariance of predicted rows, whose derivatives w.r.t. the point are along[:, :3]."""
    B = np.empty((3, 3, along.shape[2]))
    B[:, 1] = (along[:, :3] * links.by_disparity).sum(axis=1)
    B[:, 0] = along[:, 0] * links.by_column - B[:, 1]
    B[:, 2] = along[:, 1] * links.by_row
    return B


def _cholesky(B: FloatArray) -> FloatArray:
    """(6, n) the factor of B B^T + diag(1, 1, 1/2), row after row."""
    a, b, c = B
    l00 = np.sqrt((a * a).sum(axis=0) + 1.0)
    l10, l20 = (a * b).sum(axis=0) / l00, (a * c).sum(axis=0) / l00
    l11 = np.sqrt((b * b).sum(axis=0) + 1.0 - l10**2)
    l21 = ((b * c).sum(axis=0) - l20 * l10) / l11
    l22 = np.sqrt((c * c).sum(axis=0) + 0.5 - l20**2 - l21**2)
    return np.stack([l00, l10, l11, l20, l21, l22])


def _lowered(factor: FloatArray, rows: FloatArray) -> FloatArray:
    """(3, k, n) the rows (3, k, n) multiplied by the inverse of the factor."""
    l00, l10, l11, l20, l21, l22 = factor
    first = rows[0] / l00
    second = (rows[1] - l10 * first) / l11
    return np.stack([first, second, (rows[2] - l20 * first - l21 * second) / l22])


def _normal_equations(
    blocks: list[_Block], whitened: list[FloatArray], factor: FloatArray, n_pairs: int
) -> tuple[FloatArray, FloatArray]:
    """(n_pairs, 6, 6) and (n_pairs, 6): J^T J and J^T r summed over each pair's links, their rows times `factor`."""
    H, gradient = np.zeros((n_pairs, 6, 6)), np.zeros((n_pairs, 6))
    for block, A in zip(blocks, whitened, strict=True):
        A = A * factor[block.chosen]
        starts = np.flatnonzero(np.diff(block.pair, prepend=-1))
        present = block.pair[starts]
        for i in range(6):
            sums = np.add.reduceat((A[:, i : i + 1] * A[:, i:]).sum(axis=0), starts, axis=1).T
            H[present, i, i:] = H[present, i:, i] = sums[:, :-1]
            gradient[present, i] = sums[:, -1]
    return H, gradient


def _bulk_sigma(squared: FloatArray) -> float:
    """px: the pixel deviation at which the median squared residual of three rows is that of chi-square (2.366)."""
    return float(np.sqrt(np.median(squared) / 2.366)) if len(squared) else 1.0
