"""Landmark representation of the joint filter: world point or inverse depth, as three coordinates in a constant chart.

A landmark's homogeneous world point is X = M [xi; 1] with a constant 4x4 matrix M, its chart:

- M = I: xi is the point itself, in m;
- M = C Pi, with C = world_T_cam as estimated at the first observation and Pi [a, b, r, 1] = [a, b, 1, r]: xi is
  (x/z, y/z, 1/z) in that camera.

The rows (uL, uR, v) are linear in inverse-depth coordinates. Their error is therefore as Gaussian as the pixel noise at
any distance, infinity included (Civera, Davison and Montiel, IEEE T-RO 2008). In that paper the anchor camera is part
of the state; here C is constant, so that a landmark remains a world point with three coordinates.
"""

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, se3

_INVERSE_DEPTH = np.eye(4)[:, [0, 1, 3, 2]]
_SMALL_MOTIONS = se3.hat(np.eye(6))


class LandmarkRepresentation(StrEnum):
    """Coordinates in which a landmark without a prior is estimated."""

    INVERSE_DEPTH = "inverse-depth"
    """(x/z, y/z, 1/z) in the camera as estimated at its first observation"""
    WORLD = "world"
    """x, y, z in m in the world"""


def chart(coordinates: LandmarkRepresentation, world_T_cam: FloatArray) -> FloatArray:
    """Chart M (4, 4) for landmarks first observed from a camera at `world_T_cam` (4, 4)."""
    return np.eye(4) if coordinates is LandmarkRepresentation.WORLD else world_T_cam @ _INVERSE_DEPTH


def homogeneous(charts: FloatArray, xi: FloatArray) -> FloatArray:
    """World points X = M [xi; 1] (n, 4) of coordinates xi (n, 3) in charts M (n, 4, 4)."""
    return np.asarray((charts[:, :, :3] @ xi[:, :, None])[:, :, 0] + charts[:, :, 3], dtype=np.float64)


def coordinates_of(charts: FloatArray, points: FloatArray) -> FloatArray:
    """Coordinates xi (n, 3) in charts M, (n, 4, 4) or (4, 4), of homogeneous world points (n, 4)."""
    inverse = np.linalg.inv(charts)
    xi = points @ inverse.T if inverse.ndim == 2 else (inverse @ points[:, :, None])[:, :, 0]
    return np.asarray(xi[:, :3] / xi[:, 3:], dtype=np.float64)


def generators(charts: FloatArray) -> FloatArray:
    """Generators Z (..., 6, 4, 4) = M^-1 hat(e_i) M of the rigid motions of the world, in charts M (..., 4, 4)."""
    return np.asarray(np.linalg.inv(charts)[..., None, :, :] @ _SMALL_MOTIONS @ charts[..., None, :, :])


def motion_jacobian(generators: FloatArray, xi: FloatArray) -> FloatArray:
    """Jacobian (n, 3, 6) of coordinates (n, 3) w.r.t. a small rigid motion exp(g) of the world, g = [v, w].

    d xi = Y_123 - xi Y_4 with Y = sum of g_i Z_i [xi; 1], Z (n, 6, 4, 4) the `generators` of the charts.
    """
    n = len(xi)
    stacked = generators.reshape(n, 24, 4)
    Y = ((stacked[:, :, :3] @ xi[:, :, None])[:, :, 0] + stacked[:, :, 3]).reshape(n, 6, 4)
    return np.asarray(np.swapaxes(Y[:, :, :3] - Y[:, :, 3:] * xi[:, None, :], 1, 2), dtype=np.float64)


class WorldPoints(NamedTuple):
    """World positions of landmarks with their covariances."""

    position: FloatArray
    """(n, 3) m"""
    covariance: FloatArray
    """(n, 3, 3) m^2"""
    in_front: BoolArray
    """(n,) mask of points at a finite positive depth"""


def world_points(charts: FloatArray, xi: FloatArray, covariance: FloatArray) -> WorldPoints:
    """World positions and first-order covariances of coordinates (n, 3) with covariances (n, 3, 3).

    Not finite at infinity, of which numpy warns.
    """
    X = homogeneous(charts, xi)
    position = X[:, :3] / X[:, 3:]
    J = (charts[:, :3, :3] - position[:, :, None] * charts[:, 3:, :3]) / X[:, 3, None, None]
    spread = J @ covariance @ np.swapaxes(J, 1, 2)
    return WorldPoints(position, 0.5 * (spread + np.swapaxes(spread, 1, 2)), X[:, 3] > 0.0)
