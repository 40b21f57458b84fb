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

from ..robust_constants import CHI_SQUARE_MEDIAN
from ..tracks.track_segments import TrackSegments, track_segments
from .ransac import TRUNCATION, best_hypotheses

MIN_SEGMENTS = 6
"""smallest number of segments per pair of frames for a motion"""
REFINEMENTS = 12
"""steps of iteratively reweighted least squares"""
SINGULAR_CONDITION = 1e12
"""condition number of a motion's information (baselines and rad) beyond which it is undetermined"""
DAMPING = 1e-9
"""1/baseline^2 and 1/rad^2, of each step"""
BEHIND_RESIDUAL = 1e6
"""px, in place of the residual of a point that the motion takes behind the camera"""


@dataclass(frozen=True, eq=False, slots=True)
class Odometry:
    """Motions between consecutive frames, for the T-1 intervals."""

    known: BoolArray
    """(T-1,) mask of the intervals whose motion is determined"""
    motion: FloatArray
    """(T-1, 4, 4) imu_k_T_imu_(k+1), m, in the IMU axes that imu_T_cam defines; NaN where unknown"""
    covariance: FloatArray
    """(T-1, 6, 6) of the right perturbation [v, w] of `motion`, m and rad"""
    segments: TrackSegments
    """n segments of the intervals with enough of them, sorted by interval"""
    whitened_squared: FloatArray
    """(n,) squared norm of each segment's residual (three rows; one epipolar error for one camera), in sigmas"""
    pixel_sigma: float
    """px, of each of the four rows, from the median of the residuals"""

    @property
    def inlier(self) -> BoolArray:
        """Mask (n,) of the segments consistent with the motion of their pair."""
        return np.asarray(self.whitened_squared < TRUNCATION, dtype=np.bool_)

    def twist(self, dt: FloatArray) -> FloatArray:
        """Mean body velocity [v, w] (T-1, 6), m/s and rad/s, over intervals of dt (T-1,), s; NaN where unknown."""
        twist = np.full((len(dt), 6), np.nan)
        twist[self.known] = se3.log(self.motion[self.known]) / dt[self.known, None]
        return twist


def odometry(sequence: Sequence) -> Odometry:
    """Motions between consecutive frames, where at least `MIN_SEGMENTS` segments determine them.

    Raises FgbaselineError for a recording with one camera (see `monocular_odometry`).
    """
    segments, camera, n_pairs = track_segments(sequence), sequence.stereo_camera, sequence.n_frames - 1
    count = np.bincount(segments.frame, minlength=n_pairs)
    known = count >= MIN_SEGMENTS
    segments = segments.select(known[segments.frame])
    M = best_hypotheses(camera, segments, n_pairs, count, known)
    blocks = [_block(camera, segments, chosen) for chosen in segments.blocks()]
    damping = DAMPING * np.diag([camera.baseline**-2] * 3 + [1.0] * 3)
    for step in range(REFINEMENTS):
        whitened, squared = _whitened(camera, blocks, M)
        # Geman-McClure kernel, with its scale annealed down to that of the noise.
        scale = _pixel_sigma(squared) ** 2 * max(9.0, 200.0 * 0.5**step)
        H, gradient = _normal_equations(blocks, whitened, scale / (scale + squared), n_pairs)
        delta = np.zeros((n_pairs, 6))
        delta[known] = np.linalg.solve(H[known] + damping, gradient[known][:, :, None])[:, :, 0]
        M = M @ se3.exp(delta)
    whitened, squared = _whitened(camera, blocks, M)
    sigma = _pixel_sigma(squared)
    inlier = squared < TRUNCATION * sigma**2
    H, _ = _normal_equations(blocks, whitened, inlier.astype(np.float64), n_pairs)
    enough = np.bincount(segments.frame[inlier], minlength=n_pairs) >= MIN_SEGMENTS
    known &= enough
    unit = np.repeat([camera.baseline, 1.0], 3)
    known[known] = np.linalg.cond(H[known] * unit[:, None] * unit) < SINGULAR_CONDITION
    motion, covariance = _imu_motions(sequence.imu_T_cam, M, H, sigma, known)
    return Odometry(known, motion, covariance, segments, squared / sigma**2, sigma)


def _imu_motions(
    imu_T_cam: FloatArray, M: FloatArray, H: FloatArray, sigma: float, known: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """IMU motions with covariances, from the motions of points between camera frames (cam_k+1_T_cam_k)."""
    motion, covariance = np.full_like(M, np.nan), np.full((len(M), 6, 6), np.nan)
    motion[known] = imu_T_cam @ se3.inverse(M[known]) @ se3.inverse(imu_T_cam)
    A = se3.adjoint(se3.inverse(motion[known]) @ imu_T_cam)
    covariance[known] = A @ (sigma**2 * np.linalg.inv(H[known])) @ np.swapaxes(A, 1, 2)
    return motion, covariance


class _Block(NamedTuple):
    """n consecutive segments, coordinates as the first axis, because stacks of small matrices are far slower."""

    chosen: slice
    """slice of these segments among all"""
    pair: IntArray
    """(n,)"""
    point: FloatArray
    """(3, n) m"""
    pixel: FloatArray
    """(3, n) px"""
    by_disparity: FloatArray
    """(3, n) m/px: derivative of the point w.r.t. a disparity that decreases, point / disparity"""
    by_column: FloatArray
    """(n,) m/px: derivative of x w.r.t. uL at a constant disparity"""
    by_row: FloatArray
    """(n,) m: sigma of y, which comes from the mean row, for noise of 1 px in each of vL and vR"""


def _block(camera: StereoCamera, segments: TrackSegments, chosen: slice) -> _Block:
    point, pixel = np.ascontiguousarray(segments.point[chosen].T), np.ascontiguousarray(segments.pixel[chosen].T)
    return _Block(
        chosen=chosen,
        pair=segments.frame[chosen],
        point=point,
        pixel=pixel,
        by_disparity=point * (point[2] / (camera.fu * camera.baseline)),
        by_column=point[2] / camera.fu,
        by_row=point[2] * (np.sqrt(0.5) / camera.fv),
    )


def _whitened(camera: StereoCamera, blocks: list[_Block], M: FloatArray) -> tuple[list[FloatArray], FloatArray]:
    """Whitened Jacobian and residual of each block, side by side (3, 7, n), and all squared whitened residuals.

    The Jacobian is w.r.t. delta = [v, w] in M exp(delta). The covariance of a residual is that of its pixels plus that
    of the prediction, as the point was triangulated; both for a noise of 1 px.
    """
    R, p = np.ascontiguousarray(np.moveaxis(M[:, :3, :3], 0, 2)), np.ascontiguousarray(M[:, :3, 3].T)
    whitened = [
        _whitened_block(camera, block, np.take(R, block.pair, axis=2), np.take(p, block.pair, axis=1))
        for block in blocks
    ]
    return whitened, np.concatenate([np.empty(0), *((A[:, 6] ** 2).sum(axis=0) for A in whitened)])


def _whitened_block(camera: StereoCamera, segments: _Block, R: FloatArray, p: FloatArray) -> FloatArray:
    x, y, z = segments.point
    moved = R[:, 0] * x + R[:, 1] * y + R[:, 2] * z + p
    behind = ~(moved[2] > camera.min_depth)
    moved[:, behind] = [[0.0], [0.0], [1.0]]
    along, seen = np.empty((3, 4, len(x))), camera.rows(moved)
    along[:, :3] = camera.row_derivatives(seen, R)
    along[:, 3] = segments.pixel - seen.pixel
    along[:, 3, behind] = BEHIND_RESIDUAL
    whitened = _forward_substituted(_cholesky(_point_noise(segments, along)), along)
    A = np.empty((3, 7, len(x)))
    A[:, :3], A[:, 6] = whitened[:, :3], whitened[:, 3]
    # rotation w: M exp(delta) moves the point s = (x, y, z) by w x s, in the axes of s
    A[:, 3] = y * A[:, 2] - z * A[:, 1]
    A[:, 4] = z * A[:, 0] - x * A[:, 2]
    A[:, 5] = x * A[:, 1] - y * A[:, 0]
    return A


def _point_noise(segments: _Block, along: FloatArray) -> FloatArray:
    """Square root B (3, 3, n) of the covariance B B^T of predicted rows, with derivatives along[:, :3] by the point.

    Its columns belong to the noise of uL, of uR, and of the mean of vL and vR, 1 px in each pixel coordinate.
    """
    B = np.empty((3, 3, along.shape[2]))
    B[:, 1] = (along[:, :3] * segments.by_disparity).sum(axis=1)
    B[:, 0] = along[:, 0] * segments.by_column - B[:, 1]
    B[:, 2] = along[:, 1] * segments.by_row
    return B


def _cholesky(B: FloatArray) -> FloatArray:
    """Cholesky factor of B B^T + diag(1, 1, 1/2): its lower triangle (6, n), row after row."""
    a, b, c = B
    l00 = np.sqrt((a * a).sum(axis=0) + 1.0)
    l10, l20 = (a * b).sum(axis=0) / l00, (a * c).sum(axis=0) / l00
    l11 = np.sqrt((b * b).sum(axis=0) + 1.0 - l10**2)
    l21 = ((b * c).sum(axis=0) - l20 * l10) / l11
    l22 = np.sqrt((c * c).sum(axis=0) + 0.5 - l20**2 - l21**2)
    return np.stack([l00, l10, l11, l20, l21, l22])


def _forward_substituted(factor: FloatArray, rows: FloatArray) -> FloatArray:
    """Solution (3, k, n) of L x = rows (3, k, n) for the factor L of `_cholesky`."""
    l00, l10, l11, l20, l21, l22 = factor
    first = rows[0] / l00
    second = (rows[1] - l10 * first) / l11
    return np.stack([first, second, (rows[2] - l20 * first - l21 * second) / l22])


def _normal_equations(
    blocks: list[_Block], whitened: list[FloatArray], factor: FloatArray, n_pairs: int
) -> tuple[FloatArray, FloatArray]:
    """J^T J (n_pairs, 6, 6) and J^T r (n_pairs, 6), summed over the segments of each pair, rows times `factor` (n,)."""
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


def _pixel_sigma(squared: FloatArray) -> float:
    """Pixel sigma, px, at which squared residuals (n,) of three rows have the median of chi-square."""
    return float(np.sqrt(np.median(squared) / CHI_SQUARE_MEDIAN[3])) if len(squared) else 1.0
