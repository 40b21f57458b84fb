"""Intersection of the rays of one camera: initial positions of points that it observed from known poses.

A position p has the least sum of squared distances from the rays of its point: sum (I - d d^T) (p - c) = 0 for unit
directions d and camera centers c. The problem is linear and needs no initial value, but it minimizes distances from
rays and not errors in the image.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .monocular_camera import MonocularCamera
from .so3 import FloatArray

PARALLEL = 1e-9
"""rad^2: smallest mean squared angle of the rays of a point about their mean direction"""


class PointStart(NamedTuple):
    """Initial positions of the m points for which rays determine one."""

    place: NDArray[np.int64]
    """(m,) index of the point, 0 to n_points - 1"""
    nearest: NDArray[np.int64]
    """(m,) index of the observation whose camera center is the origin of the position"""
    position: FloatArray
    """(3, m) m, relative to this camera center, in the axes of the reference frame of the poses"""


def ray_intersections(
    camera: MonocularCamera, world_T_cam: FloatArray, row: NDArray[np.int64], pixel: FloatArray, n_points: int
) -> PointStart:
    """Intersection of the rays of each point; none if they are parallel or it is behind the camera of the last one.

    Shapes are those of `triangulation.triangulate_tracks`.
    """
    last = np.full(n_points, -1, dtype=np.int64)
    last[row] = np.arange(len(row))  # the last write wins
    ray = np.ones((len(row), 3))
    ray[:, :2] = (pixel[:, :2] - [camera.cu, camera.cv]) / [camera.fu, camera.fv]
    ray = (world_T_cam[:, :3, :3] @ ray[:, :, None])[:, :, 0]
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    across = np.eye(3) - ray[:, :, None] * ray[:, None, :]
    center = world_T_cam[:, :3, 3] - world_T_cam[last[row], :3, 3]
    A, b = np.zeros((n_points, 3, 3)), np.zeros((n_points, 3))
    np.add.at(A, row, across)
    np.add.at(b, row, (across @ center[:, :, None])[:, :, 0])
    place = np.flatnonzero(last >= 0)
    place = place[np.linalg.eigvalsh(A[place])[:, 0] > PARALLEL * np.bincount(row, minlength=n_points)[place]]
    position = np.linalg.solve(A[place], b[place, :, None])[:, :, 0]
    front = np.einsum("mi,mi->m", world_T_cam[last[place], :3, 2], position) > 0.0
    return PointStart(place[front], last[place[front]], np.ascontiguousarray(position[front].T))
