"""Stereo visual odometry from frame to frame: what the cameras alone say of the motion. Robust, and vectorised over
all pairs of frames at once.

Every pair of frames has its own motion. Hypotheses come from three links each (Kabsch), the one with the least
truncated cost wins (MSAC, Torr and Zisserman 2000) and is refined by iteratively reweighted least squares on the pixels
of the second frame, each whitened by its own noise and by that of the point it is predicted from.
"""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray, StereoCamera, se3

from ..observations import BoolArray, IntArray
from ..sequence import Sequence
from .links import Links, links_of, three_row_jacobian, three_rows

HYPOTHESES = 48
"""per pair of frames; with half of the links wrong, one of them is right with probability 0.998"""
TRUNCATION = 16.0
"""of a squared whitened residual of three rows"""
MIN_LINKS = 6
"""per pair of frames, for a motion to be told"""
REFINEMENTS = 12
SEED = 20260


@dataclass(frozen=True, eq=False, slots=True)
class Odometry:
    """The motion between consecutive frames, for those of the T-1 intervals that have one."""

    known: BoolArray
    """(T-1,)"""
    motion: FloatArray
    """(T-1, 4, 4) imu_k_T_imu_(k+1) in the axes of imu_T_cam; NaN where unknown"""
    covariance: FloatArray
    """(T-1, 6, 6) of its right perturbation [v, w]"""
    links: Links
    whitened: FloatArray
    """(n,) squared whitened residual of each link's three rows under its pair's motion, at `pixel_sigma`"""
    pixel_sigma: float
    """px, of each of the four rows, from the bulk of the residuals"""

    @property
    def inlier(self) -> BoolArray:
        """(n,) links that agree with the motion of their pair."""
        return np.asarray(self.whitened < TRUNCATION, dtype=np.bool_)

    def twist(self, dt: FloatArray) -> FloatArray:
        """(T-1, 6) mean body velocity [v, w] over each interval of dt (T-1,), m/s and rad/s; NaN where unknown."""
        twist = np.full((len(dt), 6), np.nan)
        twist[self.known] = se3.log(self.motion[self.known]) / dt[self.known, None]
        return twist


def odometry(sequence: Sequence) -> Odometry:
    """The motion of every pair of consecutive frames that enough links tell of."""
    links, camera, n_pairs = links_of(sequence), sequence.camera, sequence.n_frames - 1
    count = np.bincount(links.frame, minlength=n_pairs)
    known = count >= MIN_LINKS
    links = links.select(known[links.frame])
    M = _best_hypotheses(camera, links, n_pairs, count, known)
    sigma = 1.0
    for step in range(REFINEMENTS):
        residual, S, J = _linearised(camera, links, M)
        squared = _mahalanobis(residual, S)
        sigma = _bulk_sigma(squared)
        # Geman-McClure, its scale coming down to that of the noise.
        scale = sigma**2 * max(9.0, 200.0 * 0.5**step)
        weight = (scale / (scale + squared)) ** 2
        H, gradient = _normal_equations(residual, S, J, weight, links.frame, n_pairs)
        delta = np.zeros((n_pairs, 6))
        delta[known] = np.linalg.solve(H[known] + 1e-9 * np.eye(6), gradient[known][:, :, None])[:, :, 0]
        M = M @ se3.exp(delta)
    residual, S, J = _linearised(camera, links, M)
    squared = _mahalanobis(residual, S)
    sigma = _bulk_sigma(squared)
    inlier = squared < TRUNCATION * sigma**2
    H, _ = _normal_equations(residual, S, J, inlier.astype(np.float64), links.frame, n_pairs)
    enough = np.bincount(links.frame[inlier], minlength=n_pairs) >= MIN_LINKS
    known &= enough
    known[known] = np.linalg.cond(H[known]) < 1e12
    motion, covariance = _of_imu(sequence.imu_T_cam, M, H, sigma, known)
    return Odometry(known, motion, covariance, links, squared / sigma**2, sigma)


def _of_imu(
    imu_T_cam: FloatArray, M: FloatArray, H: FloatArray, sigma: float, known: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Motions of the IMU, with their covariances, from those of points between camera frames (cam_k+1_T_cam_k)."""
    motion, covariance = np.full_like(M, np.nan), np.full((len(M), 6, 6), np.nan)
    motion[known] = imu_T_cam @ se3.inverse(M[known]) @ se3.inverse(imu_T_cam)
    A = se3.adjoint(se3.inverse(motion[known]) @ imu_T_cam)
    covariance[known] = A @ (sigma**2 * np.linalg.inv(H[known])) @ np.swapaxes(A, 1, 2)
    return motion, covariance


def _best_hypotheses(camera: StereoCamera, links: Links, n_pairs: int, count: IntArray, known: BoolArray) -> FloatArray:
    """(n_pairs, 4, 4) the motion of least truncated cost among three-link hypotheses and standing still."""
    rng = np.random.default_rng(SEED)
    best = np.tile(np.eye(4), (n_pairs, 1, 1))
    best_cost = _truncated_cost(camera, links, best, n_pairs)
    start = np.concatenate([[0], np.cumsum(np.where(known, count, 0))])[:-1]
    after = camera.triangulate(_four_rows(links.pixel))
    pairs = np.flatnonzero(known)
    for _ in range(HYPOTHESES):
        pick = start[pairs, None] + _three_of(rng, count[pairs])
        M = np.tile(np.eye(4), (n_pairs, 1, 1))
        M[pairs] = _kabsch(links.point[pick], after[pick])
        cost = _truncated_cost(camera, links, M, n_pairs)
        better = cost < best_cost
        best[better], best_cost[better] = M[better], cost[better]
    for shift in (1, -1):  # a neighbour's motion is a good guess where few links are right
        M = np.roll(best, shift, axis=0)
        cost = _truncated_cost(camera, links, M, n_pairs)
        better = cost < best_cost
        best[better], best_cost[better] = M[better], cost[better]
    return best


def _three_of(rng: np.random.Generator, count: IntArray) -> IntArray:
    """(p, 3) three different indices below each count (p,)."""
    first = rng.integers(0, count)
    second = rng.integers(0, count - 1)
    second += second >= first
    low, high = np.minimum(first, second), np.maximum(first, second)
    third = rng.integers(0, count - 2)
    third += third >= low
    third += third >= high
    return np.stack([first, second, third], axis=1)


def _kabsch(points: FloatArray, moved: FloatArray) -> FloatArray:
    """(p, 4, 4) the rigid motions that take points (p, m, 3) to (p, m, 3) best, nearer points counting more."""
    weight = 1.0 / (np.linalg.norm(points, axis=2) + np.linalg.norm(moved, axis=2)) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    centre, moved_centre = (weight[:, :, None] * points).sum(axis=1), (weight[:, :, None] * moved).sum(axis=1)
    covariance = np.einsum("pm,pmi,pmj->pij", weight, moved - moved_centre[:, None], points - centre[:, None])
    U, _, Vt = np.linalg.svd(covariance)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    R = U @ Vt
    M = np.tile(np.eye(4), (len(points), 1, 1))
    M[:, :3, :3] = R
    M[:, :3, 3] = moved_centre - (R @ centre[:, :, None])[:, :, 0]
    return M


def _truncated_cost(camera: StereoCamera, links: Links, M: FloatArray, n_pairs: int) -> FloatArray:
    """(n_pairs,) sum of the squared pixel residuals, each truncated; no whitening, for speed."""
    residual = links.pixel - _predicted(camera, links, M)[0]
    squared = np.minimum(np.einsum("ni,ni->n", residual, residual), TRUNCATION)
    return np.asarray(np.bincount(links.frame, weights=squared, minlength=n_pairs), dtype=np.float64)


def _predicted(camera: StereoCamera, links: Links, M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Predicted rows (n, 3), infinite behind the camera, and the moved points (n, 3)."""
    moved = se3.transform(M[links.frame], links.point)
    with np.errstate(all="ignore"):
        rows = three_rows(camera.project(moved))
    rows[~(moved[:, 2] > 0.1)] = np.inf
    return rows, moved


def _linearised(camera: StereoCamera, links: Links, M: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Residuals (n, 3), their covariances (n, 3, 3) at 1 px and Jacobians (n, 3, 6) of M @ exp(delta), [v, w]."""
    rows, moved = _predicted(camera, links, M)
    behind = ~np.isfinite(rows[:, 0])
    moved[behind] = [0.0, 0.0, 1.0]
    residual = np.where(behind[:, None], 1e6, links.pixel - rows)
    J = three_row_jacobian(camera, moved) @ M[links.frame, :3, :3]
    S = J @ links.point_covariance @ np.swapaxes(J, 1, 2) + np.diag([1.0, 1.0, 0.5])
    skew = np.zeros((len(links), 3, 3))
    x, y, z = links.point.T
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -z, y, -x
    skew -= np.swapaxes(skew, 1, 2)
    return residual, S, np.concatenate([J, -J @ skew], axis=2)


def _normal_equations(
    residual: FloatArray, S: FloatArray, J: FloatArray, weight: FloatArray, pair: IntArray, n_pairs: int
) -> tuple[FloatArray, FloatArray]:
    """(n_pairs, 6, 6) and (n_pairs, 6): J^T S^-1 J and J^T S^-1 r summed over each pair's links."""
    half = np.linalg.inv(np.linalg.cholesky(S)) * np.sqrt(weight)[:, None, None]
    A = np.concatenate([half @ J, half @ residual[:, :, None]], axis=2)
    products = np.swapaxes(A, 1, 2) @ A
    starts = np.searchsorted(pair, np.arange(n_pairs))
    present = np.bincount(pair, minlength=n_pairs) > 0
    sums = np.zeros((n_pairs, 7, 7))
    if len(pair):
        sums[present] = np.add.reduceat(products, starts[present], axis=0)
    return sums[:, :6, :6], sums[:, :6, 6]


def _mahalanobis(residual: FloatArray, S: FloatArray) -> FloatArray:
    solved = np.linalg.solve(S, residual[:, :, None])[:, :, 0]
    return np.asarray(np.einsum("ni,ni->n", residual, solved), dtype=np.float64)


def _bulk_sigma(squared: FloatArray) -> float:
    """px: the pixel deviation at which the median squared residual of three rows is that of chi-square (2.366)."""
    return float(np.sqrt(np.median(squared) / 2.366)) if len(squared) else 1.0


def _four_rows(rows: FloatArray) -> FloatArray:
    return rows[:, [0, 2, 1, 2]]
