"""Multi-view triangulation with known poses: damped Gauss-Newton over all tracks at once.

Each point has its own damping and its own convergence test. Each coordinate is a separate array over the observations,
sorted by point, because stacks of small matrices are several times slower.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .measurement import StereoMeasurement
from .monocular import Camera, MonocularCamera
from .ray_intersection import PointStart, ray_intersections
from .so3 import FloatArray
from .stereo import disparity

MAX_ITERATIONS = 30
STEP_TOLERANCE = 1e-8
"""step at convergence, relative to the distance from the nearest camera that observed the point"""
NEWTON = 1e-2
"""Relative step below which the second-order term of the kernel is used. Without it a point with outliers converges
only linearly; with it far from the minimum the step may point away from it."""
DAMPED = 1.0
"""damping above which a small step is due to the damping and no sign of convergence"""
FEWER = 0.5
"""share of unconverged points below which the converged ones are removed from the iteration"""
LEAST_PIVOT = 1e-12
"""1/unit length^2: lower bound of a pivot of an information matrix, against rounding"""


class Triangulated(NamedTuple):
    """m points, in the reference frame of the poses."""

    position: FloatArray
    """(m, 3) m; NaN where no observation has a positive disparity, or where the rays of one camera do not intersect"""
    information: FloatArray
    """(m, 3, 3) J^T W J at the position, 1/m^2"""


class _Observed(NamedTuple):
    """n observations of m points, sorted by point; each point has at least one.

    The origin of each point is the nearest camera that observed it. The result does not depend on the world origin.
    """

    row: NDArray[np.int64]
    """(n,) 0..m-1"""
    start: NDArray[np.int64]
    """(m,) index of the first observation of each point"""
    axes: FloatArray
    """(3, 3, n) camera axes (second index) in the world"""
    center: FloatArray
    """(3, n) m, camera center relative to the origin of the point"""
    measured: FloatArray
    """(r, n) rows of the measurement model, px"""

    def of(self, chosen: NDArray[np.bool_]) -> "_Observed":
        """Observations of the chosen points (m,), renumbered."""
        keep = np.flatnonzero(chosen[self.row])
        row = (np.cumsum(chosen) - 1)[self.row[keep]]
        return _Observed(row, _starts(row), self.axes[:, :, keep], self.center[:, keep], self.measured[:, keep])


def triangulate_tracks(
    measurement: StereoMeasurement,
    world_T_cam: FloatArray,
    row: NDArray[np.int64],
    pixel: FloatArray,
    n_points: int,
    tolerance: float = STEP_TOLERANCE,
) -> Triangulated:
    """Triangulates n observations of m points by minimizing the loss of the measurement model, poses held fixed.

    `world_T_cam` (n, 4, 4) is the left camera pose of each observation, `row` (n,) the index of its point (0..m-1) and
    `pixel` (n, 4) the measurement. Starts at the back-projection with the largest disparity, or where the rays of one
    camera intersect. A step that raises the cost of a point is rejected and the damping raised. A point has converged
    when its relative step is at most `tolerance`.
    """
    position, information = np.full((n_points, 3), np.nan), np.zeros((n_points, 3, 3))
    place, nearest, p = _start(measurement.camera, world_T_cam, row, pixel, n_points)
    if len(place) == 0:
        return Triangulated(position, information)
    origin = world_T_cam[nearest, :3, 3]
    observed = _sorted(measurement, world_T_cam, row, pixel, n_points, place, origin)
    least = LEAST_PIVOT / measurement.camera.unit_length**2
    # Points at a camera plane divide by zero; their cost is infinite and the step is rejected.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        damping = np.full(len(place), 1e-6)
        sums = _linearized(measurement, observed, p)
        arrived = near = np.zeros(len(place), dtype=np.bool_)
        for _ in range(MAX_ITERATIONS):
            step = _damped_step(sums, damping, near, least)
            trial = _linearized(measurement, observed, p + step)
            better = trial[0] <= sums[0]
            p, sums = np.where(better, p + step, p), np.where(better, trial, sums)
            length = np.sqrt((step * step).sum(axis=0) / (p * p).sum(axis=0))
            small, near = length <= tolerance, better & (length <= NEWTON)
            arrived = arrived | (small & (damping < DAMPED))
            damping *= np.where(better, 0.1, 10.0)
            if (arrived | small).all():
                break
            if arrived.sum() > (1.0 - FEWER) * len(arrived):
                _put(position, information, place[arrived], p[:, arrived] + origin[arrived].T, sums[:, arrived])
                left = ~arrived
                observed, place, p, sums = observed.of(left), place[left], p[:, left], sums[:, left]
                damping, near, arrived, origin = damping[left], near[left], arrived[left], origin[left]
    _put(position, information, place, p + origin.T, sums)
    return Triangulated(position, information)


def _start(
    camera: Camera, world_T_cam: FloatArray, row: NDArray[np.int64], pixel: FloatArray, n_points: int
) -> PointStart:
    if isinstance(camera, MonocularCamera):
        return ray_intersections(camera, world_T_cam, row, pixel, n_points)
    nearest = _nearest_observations(row, pixel, n_points)
    place = np.flatnonzero(nearest >= 0)
    from_camera = camera.triangulate(pixel[nearest[place]])
    finite = np.isfinite(from_camera).all(axis=1)
    place = place[finite]
    axes = world_T_cam[nearest[place], :3, :3]
    p = np.ascontiguousarray((axes @ from_camera[finite, :, None])[:, :, 0].T)
    return PointStart(place, nearest[place], p)


def _nearest_observations(row: NDArray[np.int64], pixel: FloatArray, n_points: int) -> NDArray[np.int64]:
    """Observation (m,) of each point with the largest positive disparity, the last of equals; -1 where there is
    none."""
    apart = disparity(pixel)
    order = np.argsort(apart, kind="stable")
    order = order[apart[order] > 0.0]
    nearest = np.full(n_points, -1, dtype=np.int64)
    nearest[row[order]] = order  # the last write wins
    return nearest


def _sorted(
    measurement: StereoMeasurement,
    world_T_cam: FloatArray,
    row: NDArray[np.int64],
    pixel: FloatArray,
    n_points: int,
    place: NDArray[np.int64],
    origin: FloatArray,
) -> _Observed:
    """Observations of the points `place` (m,) with origins (m, 3), sorted by point."""
    number = np.full(n_points, -1, dtype=np.int64)
    number[place] = np.arange(len(place))
    order = np.argsort(number[row], kind="stable")
    row = number[row[order]]
    first = int(np.searchsorted(row, 0))
    order, row = order[first:], row[first:]
    axes = np.ascontiguousarray(np.moveaxis(world_T_cam[order, :3, :3], 0, 2))
    center = np.ascontiguousarray((world_T_cam[order, :3, 3] - origin[row]).T)
    return _Observed(row, _starts(row), axes, center, np.ascontiguousarray(measurement.measured(pixel[order]).T))


def _starts(row: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.flatnonzero(np.concatenate([[True], row[1:] != row[:-1]]))


def _linearized(measurement: StereoMeasurement, observed: _Observed, p: FloatArray) -> FloatArray:
    """Cost and normal equations (16, m) of points p (3, m).

    Rows: cost; upper triangle of J^T W J row by row, each row followed by its entry of J^T W r; upper triangle of the
    second-order correction that is subtracted from J^T W J.
    """
    camera, axes = measurement.camera, observed.axes
    q = (axes * (p[:, observed.row] - observed.center)[:, None]).sum(axis=0)
    seen, white = camera.rows(q), measurement.whitening_scale[:, None]
    A = np.empty((len(seen.pixel), 4, q.shape[1]))
    A[:, :3] = camera.row_derivatives(seen, axes.transpose(1, 0, 2)) * white[:, None]
    A[:, 3] = (observed.measured - seen.pixel) * white
    squared = (A[:, 3] * A[:, 3]).sum(axis=0)
    squared[~(q[2] > 0.0)] = np.inf
    cost, weight = measurement.loss(squared), measurement.weight(squared)
    A *= np.sqrt(weight)
    A[:, :, ~np.isfinite(squared)] = 0.0
    terms = np.empty((16, len(squared)))
    terms[0] = cost
    terms[1:5] = (A[:, :1] * A).sum(axis=0)
    terms[5:8] = (A[:, 1:2] * A[:, 1:]).sum(axis=0)
    terms[8:10] = (A[:, 2:3] * A[:, 2:]).sum(axis=0)
    pull = terms[[4, 7, 9]]
    along = measurement.curvature_correction(squared) * pull
    terms[10:13], terms[13:15], terms[15] = along[0] * pull, along[1] * pull[1:], along[2] * pull[2]
    return np.add.reduceat(terms, observed.start, axis=1)


def _damped_step(sums: FloatArray, damping: FloatArray, near: NDArray[np.bool_], least: float) -> FloatArray:
    """Damped steps (3, m), m, by Cholesky factorization with pivots of at least `least` (1/m^2).

    Points that are `near` the minimum use the second-order term of the kernel.
    """
    a, b, c, d, e, f = sums[[1, 2, 3, 5, 6, 8]] - sums[10:] * near
    x, y, z = sums[[4, 7, 9]]
    more = 1.0 + damping
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
