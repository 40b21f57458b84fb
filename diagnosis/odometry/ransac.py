"""RANSAC over motions between two frames, with minimal samples of three track segments and MSAC's truncated cost.

Each coordinate is in an array of its own, over all pairs of frames: stacks of small matrices take ten times as long.
"""

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, StereoCamera

from ..tracks.track_segments import BLOCK, TrackSegments

HYPOTHESES = 48
"""per pair of frames; with half of the segments wrong, one of them is right with probability 0.998"""
TRUNCATION = 16.0
"""limit of a squared whitened residual of three rows"""
SEED = 20260


def best_hypotheses(
    camera: StereoCamera, segments: TrackSegments, n_pairs: int, count: IntArray, known: BoolArray
) -> FloatArray:
    """Motions (n_pairs, 4, 4) with the smallest truncated cost among three-point hypotheses and the identity.

    `segments` are the segments of the `known` pairs, sorted by pair, `count` (n_pairs,) their number in each pair.
    """
    pairs = np.flatnonzero(known)
    best = np.tile(np.eye(4), (n_pairs, 1, 1))
    best_cost = _truncated_costs(camera, segments, count[pairs], _columns(best[pairs]))[0]

    def compete(motions: FloatArray) -> None:
        costs = _truncated_costs(camera, segments, count[pairs], motions)
        least, of_pair = np.argmin(costs, axis=0), np.arange(len(pairs))
        better = costs[least, of_pair] < best_cost
        best[pairs[better], :3] = motions[:, :, least[better], of_pair[better]].transpose(2, 0, 1)
        best_cost[better] = costs[least, of_pair][better]

    point = np.ascontiguousarray(segments.point.T)
    after = np.ascontiguousarray(camera.triangulate_rows(segments.pixel).T)
    rng = np.random.default_rng(SEED)
    start = (np.cumsum(count[pairs]) - count[pairs])[:, None]
    pick = np.concatenate([start + _three_of(rng, count[pairs]) for _ in range(HYPOTHESES)])
    compete(_through_three(point[:, pick.T], after[:, pick.T]).reshape(3, 4, HYPOTHESES, len(pairs)))
    for shift in (1, -1):  # a neighbor's motion is a good guess where few segments are right
        compete(_columns(np.roll(best, shift, axis=0)[pairs]))
    return best


def _columns(M: FloatArray) -> FloatArray:
    """Motions (p, 4, 4) with coordinates as the first axes (3, 4, 1, p)."""
    return np.moveaxis(M[:, :3], 0, 2)[:, :, None]


def _three_of(rng: np.random.Generator, count: IntArray) -> IntArray:
    """Samples (p, 3) of three different indices below each count (p,)."""
    first = rng.integers(0, count)
    second = rng.integers(0, count - 1)
    second += second >= first
    low, high = np.minimum(first, second), np.maximum(first, second)
    third = rng.integers(0, count - 2)
    third += third >= low
    third += third >= high
    return np.stack([first, second, third], axis=1)


def _through_three(points: FloatArray, moved: FloatArray) -> FloatArray:
    """Least-squares rigid motions (3, 4, p) from three points (3, 3, p) each, coordinates first, to `moved` (3, 3, p).

    Near points have larger weights. NaN where three points are on a line. The rotation is Kabsch's: it maps the plane
    of the points to that of the moved ones, and rotates in it.
    """
    weight = 1.0 / (np.sqrt((points**2).sum(axis=0)) + np.sqrt((moved**2).sum(axis=0))) ** 2
    weight /= weight.sum(axis=0)
    center, moved_center = (weight * points).sum(axis=1), (weight * moved).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        axes, moved_axes = _axes_of_plane(points), _axes_of_plane(moved)
        a = (axes[:2, :, None] * (points - center[:, None])).sum(axis=1)
        b = (moved_axes[:2, :, None] * (moved - moved_center[:, None])).sum(axis=1)
        cosine = (weight * (a * b).sum(axis=0)).sum(axis=0)
        sine = (weight * (a[0] * b[1] - a[1] * b[0])).sum(axis=0)
        length = np.hypot(cosine, sine)
        cosine, sine = cosine / length, sine / length
    f, g, normal = moved_axes
    turned = np.stack([cosine * f + sine * g, cosine * g - sine * f, normal])
    M = np.empty((3, 4, points.shape[2]))
    M[:, :3] = (turned[:, :, None] * axes[:, None]).sum(axis=0)
    M[:, 3] = moved_center - (M[:, :3] * center).sum(axis=1)
    return M


def _axes_of_plane(points: FloatArray) -> FloatArray:
    """Axes (3, 3, p): two unit vectors in the plane of three points (3, 3, p), and its normal."""
    first, second = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    normal = np.cross(first, second, axis=0)
    normal /= np.sqrt((normal**2).sum(axis=0))
    first = first / np.sqrt((first**2).sum(axis=0))
    return np.stack([first, np.cross(normal, first, axis=0), normal])


def _truncated_costs(camera: StereoCamera, segments: TrackSegments, count: IntArray, motions: FloatArray) -> FloatArray:
    """Costs (h, p) of h motions (3, 4, h, p) of each pair: its truncated squared pixel residuals, summed.

    Residuals are not whitened, for speed. The pairs have `count` (p,) segments each.
    """
    h, p = motions.shape[2:]
    P = np.ascontiguousarray((camera.K @ motions.reshape(3, -1)).reshape(3, 4, h, p).transpose(3, 0, 2, 1))
    point = np.concatenate([segments.point.T, np.ones((1, len(segments)))])
    starts, costs = np.cumsum(count) - count, np.empty((h, p))
    first = 0
    for block in segments.blocks(1 + BLOCK // h):
        last = int(np.searchsorted(starts, block.stop))
        moved = np.empty((3, h, block.stop - block.start))
        own = starts[first:last].tolist()
        for pair, start, end in zip(range(first, last), own, (*own[1:], block.stop), strict=True):
            at = slice(start - block.start, end - block.start)
            np.matmul(P[pair], point[:, start:end], out=moved[:, :, at])
        squared = _truncated(camera, moved, segments.pixel[block].T)
        costs[:, first:last] = np.add.reduceat(squared, starts[first:last] - block.start, axis=1)
        first = last
    return costs


def _truncated(camera: StereoCamera, moved: FloatArray, pixel: FloatArray) -> FloatArray:
    """Truncated squared residuals (h, n) of segments whose points project to moved[:2] / moved[2] (3, h, n)."""
    u, v, depth = moved
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        near = 1.0 / depth
        u, v = u * near, v * near
        squared = (u - pixel[0]) ** 2
        squared += (u - camera.fu * camera.baseline * near - pixel[1]) ** 2
        squared += (v - pixel[2]) ** 2
        return np.where(depth > camera.min_depth, np.minimum(squared, TRUNCATION), TRUNCATION)
