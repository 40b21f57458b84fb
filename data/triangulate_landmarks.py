"""Landmarks of a problem, triangulated along a given path."""

import numpy as np

from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.triangulation import triangulate_tracks

from .estimators.estimate import Landmarks
from .problem import Problem

SINGULAR_CONDITION = 1e14
"""condition number of a landmark's 3x3 information beyond which its position is undetermined"""


def landmarks_along(problem: Problem, world_T_imu: FloatArray) -> Landmarks:
    """Landmarks of a problem, triangulated with the poses (T, 4, 4) held fixed.

    Covariances assume exact poses. Undetermined landmarks are left out.
    """
    o = problem.observations()
    world_T_cam = (world_T_imu @ problem.sequence.imu_T_cam)[o.frame]
    points = triangulate_tracks(
        problem.measurement,
        world_T_cam,
        problem.feature_row(o.landmark),
        o.pixel,
        len(problem.features),
    )
    determined = np.flatnonzero(np.isfinite(points.position).all(axis=1))
    determined = determined[np.linalg.cond(points.information[determined]) < SINGULAR_CONDITION]
    covariance = np.asarray(np.linalg.inv(points.information[determined]), dtype=np.float64)
    return Landmarks(problem.features[determined], points.position[determined], covariance)
