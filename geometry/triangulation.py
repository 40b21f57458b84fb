"""Points from many views, with the poses given: damped Gauss-Newton over all tracks at once."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import se3
from .so3 import FloatArray
from .stereo import StereoCamera, disparity

MAX_ITERATIONS = 30
STEP_TOLERANCE = 1e-8
"""relative to the point's distance"""


class Triangulated(NamedTuple):
    """m points, in the frame that the poses lead to."""

    position: FloatArray
    """(m, 3) m; NaN where no observation has a positive disparity"""
    information: FloatArray
    """(m, 3, 3) J^T W J at the position, 1/m^2"""


def triangulate_tracks(
    camera: StereoCamera,
    world_T_cam: FloatArray,
    row: NDArray[np.int64],
    pixel: FloatArray,
    n_points: int,
    pixel_variance: float,
    huber: float | None = None,
) -> Triangulated:
    """The points that minimise the (Huber) reprojection error of n stereo observations, poses held.

    `world_T_cam` (n, 4, 4) is the left camera's pose of each observation, `row` (n,) the point (0..m-1) it sees,
    `pixel` (n, 4) what it measured; `huber` is the kernel's threshold in sigmas of an observation's norm. Starts at
    the back-projection with the largest disparity; a step that raises a point's cost is refused and damped.
    """
    cam_T_world = se3.inverse(world_T_cam)
    R = cam_T_world[:, :3, :3]
    position = np.full((n_points, 3), np.nan)
    order = np.argsort(disparity(pixel), kind="stable")  # the last write wins: the largest disparity
    order = order[disparity(pixel[order]) > 0]
    position[row[order]] = se3.transform(world_T_cam[order], camera.triangulate(pixel[order]))
    seen = np.isfinite(position).all(axis=1)
    keep = seen[row]
    row_k, pixel_k, cam_T_world, R = row[keep], pixel[keep], cam_T_world[keep], R[keep]

    def linearised(p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        p_cam = se3.transform(cam_T_world, p[row_k])
        with np.errstate(divide="ignore", invalid="ignore"):
            residual = pixel_k - camera.project(p_cam)
            squared = np.einsum("ni,ni->n", residual, residual) / pixel_variance
        squared[~(p_cam[:, 2] > 0.0)] = np.inf
        if huber is None:
            cost, weight = squared, np.ones(len(squared))
        else:
            norm = np.sqrt(np.maximum(squared, huber**2))
            cost, weight = np.where(squared > huber**2, 2.0 * huber * norm - huber**2, squared), huber / norm
        H = camera.jacobian(p_cam) @ R
        weighted_Ht = np.swapaxes(H, 1, 2) * (weight / pixel_variance)[:, None, None]
        usable = np.isfinite(squared)[:, None, None]
        information = _sum_by_row(np.where(usable, weighted_Ht @ H, 0.0), row_k, n_points)
        gradient = _sum_by_row(np.where(usable, weighted_Ht @ residual[:, :, None], 0.0)[:, :, 0], row_k, n_points)
        return _sum_by_row(cost, row_k, n_points), information, gradient

    damping = np.full(n_points, 1e-6)
    cost, information, gradient = linearised(position)
    for _ in range(MAX_ITERATIONS):
        diagonal = np.einsum("mii->mi", information)
        damped = information + np.eye(3) * (damping[:, None] * diagonal + 1e-12)[:, :, None]
        step = np.where(seen[:, None], np.linalg.solve(damped, gradient[:, :, None])[:, :, 0], 0.0)
        trial = position + step
        new_cost, new_information, new_gradient = linearised(trial)
        better = seen & (new_cost <= cost)
        position[better], cost[better] = trial[better], new_cost[better]
        information[better], gradient[better] = new_information[better], new_gradient[better]
        damping = np.where(better, damping * 0.1, damping * 10.0)
        length, distance = np.linalg.norm(step[seen], axis=1), np.linalg.norm(position[seen], axis=1)
        if np.all(length <= STEP_TOLERANCE * (1.0 + distance)):
            break
    return Triangulated(position, information)


def _sum_by_row(values: FloatArray, row: NDArray[np.int64], n_rows: int) -> FloatArray:
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    sums = np.empty((n_rows, flat.shape[1]))
    for i, column in enumerate(flat.T):
        sums[:, i] = np.bincount(row, weights=column, minlength=n_rows)
    return sums.reshape(n_rows, *values.shape[1:])
