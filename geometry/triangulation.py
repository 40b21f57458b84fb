"""Points from many views, with the poses given: damped Gauss-Newton over all tracks at once.

Every point has its own damping and is done when its own step is small. Each coordinate is in an array of its own over
the observations, which are sorted by point: with stacks of small matrices it takes several times as long.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import se3
from .so3 import FloatArray
from .stereo import StereoCamera, disparity

MAX_ITERATIONS = 30
STEP_TOLERANCE = 1e-8
"""relative to the point's distance"""
NEWTON = 1e-2
"""step, relative to the point's distance, from which on the curvature of the kernel counts: without it a point with
outliers comes nearer by no more than half with every step, with it far away it may be led astray"""
DAMPED = 1.0
"""damping from which on a small step may be one that was held back, and is no sign that the point has arrived"""
FEWER = 0.5
"""share of the points that still move, below which the others are put aside"""


class Triangulated(NamedTuple):
    """m points, in the frame that the poses lead to."""

    position: FloatArray
    """(m, 3) m; NaN where no observation has a positive disparity"""
    information: FloatArray
    """(m, 3, 3) J^T W J at the position, 1/m^2"""


class _Sights(NamedTuple):
    """n observations of m points, sorted by point; every point has one."""

    row: NDArray[np.int64]
    """(n,) 0..m-1"""
    start: NDArray[np.int64]
    """(m,) the first of each point"""
    axes: FloatArray
    """(3, 3, n) of the camera, the second index, in the world"""
    centre: FloatArray
    """(3, n) m, of the camera"""
    pixel: FloatArray
    """(4, n)"""

    def of(self, chosen: NDArray[np.bool_]) -> "_Sights":
        """Those of the chosen points (m,), numbered anew."""
        keep = np.flatnonzero(chosen[self.row])
        row = (np.cumsum(chosen) - 1)[self.row[keep]]
        return _Sights(row, _starts(row), self.axes[:, :, keep], self.centre[:, keep], self.pixel[:, keep])


def triangulate_tracks(
    camera: StereoCamera,
    world_T_cam: FloatArray,
    row: NDArray[np.int64],
    pixel: FloatArray,
    n_points: int,
    pixel_variance: float,
    huber: float | None = None,
    tolerance: float = STEP_TOLERANCE,
) -> Triangulated:
    """The points that minimise the (Huber) reprojection error of n stereo observations, poses held.

    `world_T_cam` (n, 4, 4) is the left camera's pose of each observation, `row` (n,) the point (0..m-1) it sees,
    `pixel` (n, 4) what it measured; `huber` is the kernel's threshold in sigmas of an observation's norm. Starts at
    the back-projection with the largest disparity; a step that raises a point's cost is refused and damped. A point is
    done when its step is at most `tolerance` of its distance.
    """
    position, information = np.full((n_points, 3), np.nan), np.zeros((n_points, 3, 3))
    nearest = _nearest_sights(row, pixel, n_points)
    place = np.flatnonzero(nearest >= 0)
    nearest = nearest[place]
    start = se3.transform(world_T_cam[nearest], camera.triangulate(pixel[nearest]))
    finite = np.isfinite(start).all(axis=1)
    place, p = place[finite], np.ascontiguousarray(start[finite].T)
    if len(place) == 0:
        return Triangulated(position, information)
    sights = _sorted(world_T_cam, row, pixel, n_points, place)
    # Points at a camera's plane divide by zero; they cost infinitely much and nothing else comes of it.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        damping = np.full(len(place), 1e-6)
        sums = _linearised(camera, sights, p, pixel_variance, huber)
        arrived = near = np.zeros(len(place), dtype=np.bool_)
        for _ in range(MAX_ITERATIONS):
            step = _damped_step(sums, damping, near)
            trial = _linearised(camera, sights, p + step, pixel_variance, huber)
            better = trial[0] <= sums[0]
            p, sums = np.where(better, p + step, p), np.where(better, trial, sums)
            length = np.sqrt((step * step).sum(axis=0)) / (1.0 + np.sqrt((p * p).sum(axis=0)))
            small, near = length <= tolerance, better & (length <= NEWTON)
            arrived = arrived | (small & (damping < DAMPED))
            damping *= np.where(better, 0.1, 10.0)
            if (arrived | small).all():
                break
            if arrived.sum() > (1.0 - FEWER) * len(arrived):
                _put(position, information, place[arrived], p[:, arrived], sums[:, arrived])
                left = ~arrived
                sights, place, p, sums = sights.of(left), place[left], p[:, left], sums[:, left]
                damping, near, arrived = damping[left], near[left], arrived[left]
    _put(position, information, place, p, sums)
    return Triangulated(position, information)


def _nearest_sights(row: NDArray[np.int64], pixel: FloatArray, n_points: int) -> NDArray[np.int64]:
    """(m,) the observation of each point with the largest positive disparity, the last of equals; -1 where none has."""
    apart = disparity(pixel)
    order = np.argsort(apart, kind="stable")
    order = order[apart[order] > 0.0]
    nearest = np.full(n_points, -1, dtype=np.int64)
    nearest[row[order]] = order  # the last write wins
    return nearest


def _sorted(
    world_T_cam: FloatArray, row: NDArray[np.int64], pixel: FloatArray, n_points: int, place: NDArray[np.int64]
) -> _Sights:
    """The observations of the points `place` (m,), which are numbered by their place in it."""
    number = np.full(n_points, -1, dtype=np.int64)
    number[place] = np.arange(len(place))
    order = np.argsort(number[row], kind="stable")
    row = number[row[order]]
    first = int(np.searchsorted(row, 0))
    order, row = order[first:], row[first:]
    poses = np.ascontiguousarray(np.moveaxis(world_T_cam[order, :3], 0, 2))
    return _Sights(row, _starts(row), poses[:, :3], poses[:, 3], np.ascontiguousarray(pixel[order].T))


def _starts(row: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.flatnonzero(np.concatenate([[True], row[1:] != row[:-1]]))


def _linearised(
    camera: StereoCamera, sights: _Sights, p: FloatArray, pixel_variance: float, huber: float | None
) -> FloatArray:
    """(16, m) of points p (3, m): cost, then the upper triangle of J^T W J row by row, each row followed by its entry
    of J^T W r, then the upper triangle of what the kernel's curvature takes off J^T W J."""
    axes = sights.axes
    x, y, z = (axes * (p[:, sights.row] - sights.centre)[:, None]).sum(axis=0)
    near = 1.0 / z
    u, v, far = x * near, y * near, ~(z > 0.0)
    uL, row, apart = camera.fu * u + camera.cu, camera.fv * v + camera.cv, camera.fu * camera.baseline * near
    residual = sights.pixel - np.stack([uL, row, uL - apart, row])
    squared = (residual * residual).sum(axis=0) / pixel_variance
    squared[far] = np.inf
    if huber is None:
        cost, root = squared, np.full(len(squared), 1.0 / np.sqrt(pixel_variance))
        flatter = np.zeros(len(squared))
    else:
        norm = np.sqrt(np.maximum(squared, huber**2))
        beyond = squared > huber**2
        cost = np.where(beyond, 2.0 * huber * norm - huber**2, squared)
        flatter = np.where(beyond, 1.0 / (huber * norm), 0.0)
        root = np.sqrt(huber / (norm * pixel_variance))
    # The rows of both images have the same derivatives and count as one of twice the weight.
    A, both = np.empty((3, 4, len(z))), np.sqrt(2.0)
    A[0, :3] = (camera.fu * near) * (axes[:, 0] - u * axes[:, 2])
    A[1, :3] = A[0, :3] + (apart * near) * axes[:, 2]
    A[2, :3] = (both * camera.fv * near) * (axes[:, 1] - v * axes[:, 2])
    A[0, 3], A[1, 3], A[2, 3] = residual[0], residual[2], (residual[1] + residual[3]) / both
    A *= root
    A[:, :, ~np.isfinite(squared)] = 0.0
    terms = np.empty((16, len(z)))
    terms[0] = cost
    terms[1:5] = (A[:, :1] * A).sum(axis=0)
    terms[5:8] = (A[:, 1:2] * A[:, 1:]).sum(axis=0)
    terms[8:10] = (A[:, 2:3] * A[:, 2:]).sum(axis=0)
    pull = terms[[4, 7, 9]]
    along = flatter * pull
    terms[10:13], terms[13:15], terms[15] = along[0] * pull, along[1] * pull[1:], along[2] * pull[2]
    return np.add.reduceat(terms, sights.start, axis=1)


def _damped_step(sums: FloatArray, damping: FloatArray, near: NDArray[np.bool_]) -> FloatArray:
    """(3, m) m, by Cholesky's factors; with the kernel's curvature for the points that are near."""
    a, b, c, d, e, f = sums[[1, 2, 3, 5, 6, 8]] - sums[10:] * near
    x, y, z = sums[[4, 7, 9]]
    more, least = 1.0 + damping, 1e-12  # no pivot can be less, but by rounding
    l00 = np.sqrt(a * more + least)
    l10, l20, x = b / l00, c / l00, x / l00
    l11 = np.sqrt(np.maximum(d * more + least - l10 * l10, least))
    l21, y = (e - l20 * l10) / l11, (y - l10 * x) / l11
    squared = np.maximum(f * more + least - l20 * l20 - l21 * l21, least)
    z = (z - l20 * x - l21 * y) / squared
    y = (y - l21 * z) / l11
    return np.stack([(x - l10 * y - l20 * z) / l00, y, z])


def _put(
    position: FloatArray, information: FloatArray, place: NDArray[np.int64], p: FloatArray, sums: FloatArray
) -> None:
    position[place] = p.T
    information[place] = sums[[1, 2, 3, 2, 5, 6, 3, 6, 8]].T.reshape(-1, 3, 3)
