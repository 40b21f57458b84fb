"""Rotation and direction of motion between pairs of views of one camera, robust and vectorized over all pairs.

Rays f of the first view and g of the second one satisfy f . (t x R g) = 0 for the rotation R and the direction t of the
motion. This residual is divided by sqrt(|t x f|^2 + |t x R g|^2), so that its deviation is that of a ray at any
parallax. It is minimized over the five degrees of freedom of R and t by iteratively reweighted least squares. Starts
are the rotation that leaves the smallest flow, no rotation, and the motions of neighboring pairs.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, so3

from ..robust_constants import CHI_SQUARE_MEDIAN

MIN_MATCHES = 12
"""smallest number of matches of a pair for its motion: twice the degrees of freedom, and some for wrong matches"""
ROUNDS, FLOW_ROUNDS, DIRECTION_ROUNDS = 12, 5, 3
FREEDOM = 5
TRUNCATION = 9.0
"""squared whitened residual of an outlier"""
DIRECTED = 0.05
"""rad, sigma of a direction of motion that is known"""
NEARER = 4.0
DAMPING = 1e-6
"""information of each step for rays of unit noise"""
SMALLEST_SIGMA = 1e-6
"""rad, of a ray"""


class RayMatches(NamedTuple):
    """n tracks that two views share, sorted by pair of views."""

    pair: IntArray
    """(n,)"""
    first: FloatArray
    """(n, 3) unit rays of the first view in the axes of the body"""
    second: FloatArray
    """(n, 3) of the second one"""


class Motion(NamedTuple):
    """Motions of p pairs."""

    rotation: FloatArray
    """(p, 3, 3) first_R_second"""
    direction: FloatArray
    """(p, 3) unit vector from the first to the second view in the axes of the first; any where nothing is nearer than
    infinity"""


@dataclass(frozen=True, eq=False, slots=True)
class EpipolarMotions:
    """Motions of p pairs, and how n matches fit them."""

    known: BoolArray
    """(p,)"""
    motion: Motion
    covariance: FloatArray
    """(p, 5, 5) of the right perturbation of the rotation and of the direction's tangent, rad^2; NaN where unknown"""
    whitened_squared: FloatArray
    """(n,) squared residual of each match over `sigma` squared; NaN where the motion is unknown"""
    sigma: float
    """rad, of a ray, from the median of the residuals"""

    def directed(self, least: float) -> BoolArray:
        """Mask (p,): whether the direction has a sigma below `DIRECTED`, for a ray sigma of at least `least`, rad."""
        variance = np.trace(self.covariance[:, 3:, 3:], axis1=1, axis2=2) * max(1.0, least / self.sigma) ** 2
        return np.asarray(np.nan_to_num(variance, nan=np.inf) < DIRECTED**2, dtype=np.bool_)


def epipolar_motions(matches: RayMatches, n_pairs: int) -> EpipolarMotions:
    """Motions of all pairs with at least `MIN_MATCHES` matches."""
    count = np.bincount(matches.pair, minlength=n_pairs)
    enough = count >= MIN_MATCHES
    chosen = np.flatnonzero(enough[matches.pair])
    used = RayMatches(matches.pair[chosen], matches.first[chosen], matches.second[chosen])
    still = np.tile(np.eye(3), (n_pairs, 1, 1))
    if len(chosen) == 0:
        nothing = np.full((n_pairs, FREEDOM, FREEDOM), np.nan), np.full(len(matches.pair), np.nan)
        return EpipolarMotions(enough, Motion(still, still[:, 2]), *nothing, 1.0)
    best = _refined(used, _along(used, _least_flow(used, still)))
    best = _better(used, best, _refined(used, _along(used, still)))
    for shift in (1, -1):
        best = _better(used, best, _refined(used, Motion(*(np.roll(part, shift, axis=0) for part in best))))
    squared = _residuals(used, best)[0] ** 2
    sigma = _bulk_sigma(used, squared, count)
    inlier = squared < TRUNCATION * sigma**2
    H, _ = _normal_equations(used, best, inlier.astype(np.float64), n_pairs)
    known = enough & (np.bincount(used.pair[inlier], minlength=n_pairs) >= MIN_MATCHES)
    known[known] = np.linalg.eigvalsh(H[known])[:, 0] > DAMPING
    covariance, whitened = np.full((n_pairs, FREEDOM, FREEDOM), np.nan), np.full(len(matches.pair), np.nan)
    covariance[known] = sigma**2 * np.linalg.inv(H[known])
    whitened[chosen] = np.where(known[used.pair], squared / sigma**2, np.nan)
    return EpipolarMotions(known, best, covariance, whitened, sigma)


def beyond_scene(matches: RayMatches, motion: Motion) -> FloatArray:
    """Angles (n,), rad, by which matches lie outside the part of their epipolar line that points of the scene reach.

    A point lies no farther than infinity, and no nearer than the nearest tenth of its pair's points by a factor of
    `NEARER`.
    """
    moved, t = _turned(matches, motion.rotation), motion.direction[matches.pair]
    across = t - (t * matches.first).sum(axis=1)[:, None] * matches.first
    sine = np.maximum(np.linalg.norm(across, axis=1), SMALLEST_SIGMA)
    shift = -((moved - matches.first) * across).sum(axis=1) / sine
    order = np.lexsort((shift / sine, matches.pair))
    count = np.bincount(matches.pair, minlength=len(motion.rotation))
    place = np.cumsum(count) - count + (0.9 * (count - 1)).astype(np.int64)
    near = (shift / sine)[order][np.clip(place, 0, max(len(order) - 1, 0))] if len(order) else np.zeros(len(count))
    beyond = np.maximum(-shift, shift - NEARER * np.maximum(near, 0.0)[matches.pair] * sine)
    return np.asarray(np.maximum(beyond, 0.0), dtype=np.float64)


def _least_flow(matches: RayMatches, rotation: FloatArray) -> FloatArray:
    """Rotations (p, 3, 3) that bring the rays of both views nearest to each other, by robust small steps."""
    for _ in range(FLOW_ROUNDS):
        moved = _turned(matches, rotation)
        apart = np.cross(moved, matches.first)  # the rotation about this axis, in the axes of the first view
        squared = (apart**2).sum(axis=1)
        weight = _robust(squared, float(np.median(squared)))
        across = np.eye(3) - moved[:, :, None] * moved[:, None, :]
        H = _sums(matches, weight[:, None, None] * across, len(rotation)) + DAMPING * np.eye(3)
        turn = np.linalg.solve(H, _sums(matches, weight[:, None] * apart, len(rotation))[:, :, None])[:, :, 0]
        rotation = so3.exp_so3(turn) @ rotation
    return rotation


def _along(matches: RayMatches, rotation: FloatArray) -> Motion:
    """Motions at given rotations: their direction is in all epipolar planes, and what is passed moves against it."""
    moved = _turned(matches, rotation)
    normal = np.cross(matches.first, moved)
    weight, axis = np.ones(len(normal)), np.zeros((len(rotation), 3))
    for _ in range(DIRECTION_ROUNDS):
        scatter = _sums(matches, (weight[:, None] * normal)[:, :, None] * normal[:, None, :], len(rotation))
        axis = np.linalg.eigh(scatter)[1][:, :, 0]
        squared = (normal * axis[matches.pair]).sum(axis=1) ** 2
        weight = _robust(squared, float(np.median(squared)) / CHI_SQUARE_MEDIAN[1])
    ahead = np.sign(((moved - matches.first) * axis[matches.pair]).sum(axis=1))
    against = _sums(matches, ahead[:, None], len(rotation)) <= 0.0
    return Motion(rotation, np.where(against, axis, -axis))


def _refined(matches: RayMatches, motion: Motion) -> Motion:
    for step in range(ROUNDS):
        residual, _ = _residuals(matches, motion)
        squared = residual**2
        # Geman-McClure kernel, with its scale annealed down to that of the noise
        bulk = float(np.median(squared)) / CHI_SQUARE_MEDIAN[1]
        weight = _robust(squared, bulk * max(9.0, 200.0 * 0.5**step))
        H, g = _normal_equations(matches, motion, weight, len(motion.rotation))
        delta = np.linalg.solve(H + DAMPING * np.eye(FREEDOM), g[:, :, None])[:, :, 0]
        moved = motion.direction + (_basis(motion.direction) @ delta[:, 3:, None])[:, :, 0]
        moved /= np.linalg.norm(moved, axis=1, keepdims=True)
        motion = Motion(motion.rotation @ so3.exp_so3(delta[:, :3]), moved)
    return motion


def _better(matches: RayMatches, best: Motion, other: Motion) -> Motion:
    """For each pair the motion with the smaller truncated cost."""
    squared = np.stack([_residuals(matches, each)[0] ** 2 for each in (best, other)], axis=1)
    bulk = max(float(np.median(squared[:, 0])) / CHI_SQUARE_MEDIAN[1], SMALLEST_SIGMA**2)
    cost = _sums(matches, np.minimum(squared, TRUNCATION * bulk), len(best.rotation))
    better = cost[:, 1] < cost[:, 0]
    rotation = np.where(better[:, None, None], other.rotation, best.rotation)
    return Motion(rotation, np.where(better[:, None], other.direction, best.direction))


def _residuals(matches: RayMatches, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Residuals (n,), rad, and their divisors (n,)."""
    moved, t = _turned(matches, motion.rotation), motion.direction[matches.pair]
    plane = np.cross(t, moved)
    scale = np.sqrt((plane**2).sum(axis=1) + (np.cross(t, matches.first) ** 2).sum(axis=1))
    scale = np.maximum(scale, SMALLEST_SIGMA)
    return (matches.first * plane).sum(axis=1) / scale, scale


def _normal_equations(
    matches: RayMatches, motion: Motion, weight: FloatArray, n_pairs: int
) -> tuple[FloatArray, FloatArray]:
    """Information (p, 5, 5) and gradient (p, 5) of the rotation's right perturbation and the direction's tangent."""
    residual, scale = _residuals(matches, motion)
    R, t = motion.rotation[matches.pair], motion.direction[matches.pair]
    f, moved = matches.first, _turned(matches, motion.rotation)
    back, along = (np.einsum("nji,nj->ni", R, vector) for vector in (np.cross(f, t), t))
    # the divisor moves as well: without its derivative the motion is biased, since small parallax is mostly noise
    near, far = (t * f).sum(axis=1)[:, None], (t * moved).sum(axis=1)[:, None]
    relative = (residual / scale)[:, None]
    by_rotation = np.cross(matches.second, back + relative * far * along)
    by_direction = np.cross(moved, f) + relative * (near * f + far * moved)
    tangent = (by_direction[:, None] @ _basis(motion.direction)[matches.pair])[:, 0]
    J = np.concatenate([by_rotation, tangent], axis=1) / scale[:, None]
    weighted = weight[:, None] * J
    H = _sums(matches, weighted[:, :, None] * J[:, None, :], n_pairs)
    return H, _sums(matches, -weighted * residual[:, None], n_pairs)


def _turned(matches: RayMatches, rotation: FloatArray) -> FloatArray:
    """Rays (n, 3) of the second view in the axes of the first."""
    return np.asarray((rotation[matches.pair] @ matches.second[:, :, None])[:, :, 0])


def _basis(direction: FloatArray) -> FloatArray:
    """Pairs of unit vectors (p, 3, 2) orthogonal to the directions (p, 3)."""
    least = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    first = np.cross(direction, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(direction, first)], axis=2)


def _robust(squared: FloatArray, scale: float) -> FloatArray:
    scale = max(scale, SMALLEST_SIGMA**2)
    return np.asarray((scale / (scale + squared)) ** 2, dtype=np.float64)


def _bulk_sigma(matches: RayMatches, squared: FloatArray, count: IntArray) -> float:
    """rad: the deviation at which the median squared residual is that of chi-square, the fitted freedom counted."""
    freed = squared / (1.0 - FREEDOM / count[matches.pair])
    return max(SMALLEST_SIGMA, float(np.sqrt(np.median(freed) / CHI_SQUARE_MEDIAN[1])))


def _sums(matches: RayMatches, values: FloatArray, n_pairs: int) -> FloatArray:
    """Sums (p, ...) of values (n, ...) over the matches of each pair; zero for pairs without any."""
    total = np.zeros((n_pairs, *values.shape[1:]))
    starts = np.flatnonzero(np.diff(matches.pair, prepend=-1))
    total[matches.pair[starts]] = np.add.reduceat(values, starts, axis=0)
    return total
