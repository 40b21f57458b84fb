"""Multi-view triangulation with known poses: damped Gauss-Newton over all tracks at once.

A point is [x/z, y/z, 1/z] in the nearest camera that observed it (inverse depth; Civera et al. 2008). Pixels of that
camera are linear in these coordinates, and those of the others nearly so: Gauss-Newton takes half the steps that it
takes with XYZ. Each point has its own damping and its own convergence test. Each coordinate is a separate array over
the observations, sorted by point, because stacks of small matrices are several times slower.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .measurement_model import MeasurementModel
from .monocular_camera import Camera, MonocularCamera
from .ray_intersection import PointStart, ray_intersections
from .so3 import FloatArray
from .stereo_camera import disparity

MAX_ITERATIONS = 30
STEP_TOLERANCE = 1e-8
"""step at convergence, relative to the distance from the nearest camera that observed the point"""
NEWTON = 1e-2
"""Relative step below which the second-order term of the kernel is used. Without this term a point with outliers
converges only linearly; far from the minimum, a step with this term may increase the cost."""
DAMPED = 1.0
"""damping above which a small step does not count as convergence, as it may be due to the damping"""
FEWER = 0.5
"""share of unconverged points below which the converged ones are removed from the iteration"""
LEAST_PIVOT = 1e-12
"""lower bound of a pivot of the information of [x/z, y/z, unit length/z], against rounding"""
ROUNDING = 1e-14
"""predicted decrease of a point's cost, relative to the cost, up to which it counts as rounding"""
FARTHER = 0.01
"""smallest factor by which a step may change an inverse depth, so that no step passes infinity"""
INFINITE = 1e-3
"""px; smallest disparity, for a baseline of `unit_length`: a point that reaches it is at infinity, and is left there"""


class Triangulated(NamedTuple):
    """m points, in the reference frame of the poses."""

    position: FloatArray
    """(m, 3) m; NaN where no observation has a positive disparity, or where the rays of one camera do not intersect"""
    information: FloatArray
    """(m, 3, 3) J^T W J at the position, 1/m^2"""


class _Observed(NamedTuple):
    """n observations of m points, sorted by point; each point has at least one.

    A point q = [x/z, y/z, 1/z] in the nearest camera is the homogeneous point `constant` + `along` q in the camera of
    an observation. Both are from relative poses, so that the world origin does not matter.
    """

    row: NDArray[np.int64]
    """(n,) 0..m-1"""
    start: NDArray[np.int64]
    """(m,) index of the first observation of each point"""
    constant: FloatArray
    """(4, n)"""
    along: FloatArray
    """(4, 3, n)"""
    measured: FloatArray
    """(r, n) rows of the measurement model, px"""

    def of(self, chosen: NDArray[np.bool_]) -> "_Observed":
        """Observations of the chosen points (m,), renumbered."""
        keep = np.flatnonzero(chosen[self.row])
        row = (np.cumsum(chosen) - 1)[self.row[keep]]
        return _Observed(row, _starts(row), *(a[..., keep] for a in (self.constant, self.along, self.measured)))


def triangulate_tracks(
    measurement: MeasurementModel,
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
    when its relative step is at most `tolerance`, or its cost cannot fall any more.
    """
    camera = measurement.camera
    position, information = np.full((n_points, 3), np.nan), np.zeros((n_points, 3, 3))
    place, nearest, p = _start(camera, world_T_cam, row, pixel, n_points)
    if len(place) == 0:
        return Triangulated(position, information)
    anchor = world_T_cam[nearest]
    x, y, z = np.einsum("nij,in->jn", anchor[:, :3, :3], p)
    infinite = INFINITE / (camera.fu * camera.unit_length)
    q = np.stack([x / z, y / z, np.maximum(1.0 / z, infinite)])
    observed = _sorted(measurement, world_T_cam, row, pixel, n_points, place, anchor)
    unit = np.array([[1.0], [1.0], [camera.unit_length]])
    # Points at a camera plane divide by zero; their cost is infinite and the step is rejected.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        damping = np.full(len(place), 1e-6)
        sums = _linearized(measurement, observed, q)
        arrived = near = np.zeros(len(place), dtype=np.bool_)
        for _ in range(MAX_ITERATIONS):
            step = _damped_step(sums, damping, near, unit)
            gain = np.einsum("im,im->m", step, sums[[4, 7, 9]])
            farthest = np.maximum(FARTHER * q[2], infinite) - q[2]
            trial = q + step * np.where(step[2] < farthest, farthest / step[2], 1.0)
            found = _linearized(measurement, observed, trial)
            better = found[0] <= sums[0]
            length = _relative_step(q, trial)
            q, sums = np.where(better, trial, q), np.where(better, found, sums)
            small, near = length <= tolerance, better & (length <= NEWTON)
            settled = small | ((gain <= ROUNDING * sums[0]) & np.isfinite(sums[0]))
            arrived = arrived | (settled & (damping < DAMPED)) | (q[2] < 1.001 * infinite)
            damping *= np.where(better, 0.1, 10.0)
            if (arrived | small).all():
                break
            if arrived.sum() > (1.0 - FEWER) * len(arrived):
                _put(position, information, place[arrived], q[:, arrived], sums[:, arrived], anchor[arrived])
                left = ~arrived
                observed, place, q, sums = observed.of(left), place[left], q[:, left], sums[:, left]
                damping, near, arrived, anchor = damping[left], near[left], arrived[left], anchor[left]
    _put(position, information, place, q, sums, anchor)
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
    measurement: MeasurementModel,
    world_T_cam: FloatArray,
    row: NDArray[np.int64],
    pixel: FloatArray,
    n_points: int,
    place: NDArray[np.int64],
    anchor: FloatArray,
) -> _Observed:
    """Observations of the points `place` (m,), whose nearest cameras have these poses (m, 4, 4), sorted by point."""
    number = np.full(n_points, -1, dtype=np.int64)
    number[place] = np.arange(len(place))
    order = np.argsort(number[row], kind="stable")
    row = number[row[order]]
    first = int(np.searchsorted(row, 0))
    order, row = order[first:], row[first:]
    pose, reference = world_T_cam[order], anchor[row]
    back = pose[:, :3, :3].swapaxes(1, 2)
    constant, along = np.zeros((4, len(row))), np.zeros((4, 3, len(row)))
    turned = (back @ reference[:, :3, :3]).transpose(1, 2, 0)
    along[:3, :2], constant[:3] = turned[:, :2], turned[:, 2]
    along[:3, 2] = (back @ (reference[:, :3, 3:] - pose[:, :3, 3:]))[:, :, 0].T
    along[3, 2] = 1.0
    return _Observed(row, _starts(row), constant, along, np.ascontiguousarray(measurement.rows_of(pixel[order]).T))


def _starts(row: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.flatnonzero(np.concatenate([[True], row[1:] != row[:-1]]))


def _linearized(measurement: MeasurementModel, observed: _Observed, q: FloatArray) -> FloatArray:
    """Cost and normal equations (16, m) of points q (3, m).

    Rows: cost; upper triangle of J^T W J row by row, each row followed by its entry of J^T W r; upper triangle of the
    second-order correction that is subtracted from J^T W J.
    """
    camera, along = measurement.camera, observed.along
    point = q[:, observed.row]
    seen = camera.rows(observed.constant + along[:, 0] * point[0] + along[:, 1] * point[1] + along[:, 2] * point[2])
    white = measurement.whitening_scale[:, None]
    A = np.empty((len(seen.pixel), 4, len(observed.row)))
    np.multiply(camera.row_derivatives(seen, along), white[:, None], out=A[:, :3])
    np.multiply(observed.measured - seen.pixel, white, out=A[:, 3])
    squared = np.einsum("in,in->n", A[:, 3], A[:, 3])
    squared[~(seen.inverse_z > 0.0)] = np.inf
    terms = np.empty((16, len(squared)))
    terms[0], weight, curvature = measurement.robust_terms(squared)
    A *= np.sqrt(weight)
    unusable = ~np.isfinite(squared)
    if unusable.any():
        A[:, :, unusable] = 0.0
    np.einsum("in,ijn->jn", A[:, 0], A, out=terms[1:5])
    np.einsum("in,ijn->jn", A[:, 1], A[:, 1:], out=terms[5:8])
    np.einsum("in,ijn->jn", A[:, 2], A[:, 2:], out=terms[8:10])
    pull = terms[[4, 7, 9]]
    along_pull = curvature * pull
    np.multiply(along_pull[0], pull, out=terms[10:13])
    np.multiply(along_pull[1], pull[1:], out=terms[13:15])
    np.multiply(along_pull[2], pull[2], out=terms[15])
    return np.add.reduceat(terms, observed.start, axis=1)


def _damped_step(sums: FloatArray, damping: FloatArray, near: NDArray[np.bool_], unit: FloatArray) -> FloatArray:
    """Damped steps (3, m) by Cholesky factorization, with coordinates times `unit` (3, 1) for the least pivot.

    Points that are `near` the minimum use the second-order term of the kernel.
    """
    a, b, c, d, e, f = sums[[1, 2, 3, 5, 6, 8]] - sums[10:] * near
    x, y, z = sums[[4, 7, 9]]
    more, least = 1.0 + damping, LEAST_PIVOT * unit * unit
    l00 = np.sqrt(a * more + least[0])
    l10, l20, x = b / l00, c / l00, x / l00
    l11 = np.sqrt(np.maximum(d * more + least[1] - l10 * l10, least[1]))
    l21, y = (e - l20 * l10) / l11, (y - l10 * x) / l11
    squared = np.maximum(f * more + least[2] - l20 * l20 - l21 * l21, least[2])
    z = (z - l20 * x - l21 * y) / squared
    y = (y - l21 * z) / l11
    return np.stack([(x - l10 * y - l20 * z) / l00, y, z])


def _relative_step(q: FloatArray, trial: FloatArray) -> FloatArray:
    """Distances (m,) from points q (3, m) to others, as shares of their distance from the nearest camera."""
    moved = trial[:2] * (q[2] / trial[2]) - q[:2]
    along = q[2] / trial[2] - 1.0
    squared = (moved * moved).sum(axis=0) + along * along
    return np.asarray(np.sqrt(squared / ((q[:2] * q[:2]).sum(axis=0) + 1.0)))


def _put(
    position: FloatArray,
    information: FloatArray,
    place: NDArray[np.int64],
    q: FloatArray,
    sums: FloatArray,
    anchor: FloatArray,
) -> None:
    """Write the positions of points q (3, m) and their information to the rows `place`, in the reference frame."""
    x, y, near = q
    R = anchor[:, :3, :3]
    ray = np.stack([x, y, np.ones_like(x)], axis=1)[:, :, None]
    position[place] = (R @ (ray / near[:, None, None]))[:, :, 0] + anchor[:, :3, 3]
    by_point = np.zeros((len(x), 3, 3))  # derivative of q w.r.t. the position in the nearest camera
    by_point[:, 0, 0] = by_point[:, 1, 1] = near
    by_point[:, :, 2] = -near[:, None] * q.T
    by_point = by_point @ R.swapaxes(1, 2)
    matrix = sums[[1, 2, 3, 2, 5, 6, 3, 6, 8]].T.reshape(-1, 3, 3)
    information[place] = by_point.swapaxes(1, 2) @ matrix @ by_point
