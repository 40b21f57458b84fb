"""Cheirality: tests whether landmarks lie in front of every camera that observed them, at a finite distance."""

import numpy as np

from fgbaseline.data.estimators.estimate import Landmarks
from fgbaseline.data.observations import BoolArray, Observations
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import Camera, FloatArray

MIN_DISPARITY = 0.05
"""px; a landmark with a smaller disparity makes a system indeterminate, as does one at the plane of a camera that
observed it (unbounded Jacobian) or behind it (zero Jacobian)."""
CHEIRALITY_VIOLATION = "it violates cheirality: at infinity, or not in front of every camera that observes it"


def cheirality_violations(
    problem: Problem, o: Observations, world_T_imu: FloatArray, landmarks: Landmarks
) -> list[int]:
    """Landmarks that violate cheirality in an observation; every observation is of one of `landmarks`."""
    seen = satisfies_cheirality(problem, o, world_T_imu, landmarks)
    return [int(j) for j in np.unique(o.landmark[~seen])]


def satisfies_cheirality(problem: Problem, o: Observations, world_T_imu: FloatArray, landmarks: Landmarks) -> BoolArray:
    """Mask (n,): whether each observation's landmark is in front of its camera, and not at infinity."""
    world_T_cam = (world_T_imu @ problem.sequence.imu_T_cam)[o.frame]
    points = landmarks.position[np.searchsorted(landmarks.index, o.landmark)]
    return in_front(problem.sequence.camera, world_T_cam, points)


def in_front(camera: Camera, world_T_cam: FloatArray, points: FloatArray) -> BoolArray:
    """Mask (n,): world points (n, 3) in front of cameras at poses (n, 4, 4), and not at infinity; NaN is not."""
    depth = np.einsum("ni,ni->n", world_T_cam[:, :3, 2], points - world_T_cam[:, :3, 3])
    front: BoolArray = (depth > camera.min_depth) & (depth < camera.fu * camera.unit_length / MIN_DISPARITY)
    return front
