"""Initial values of a batch solution: selected observations, and landmarks triangulated along a path."""

from dataclasses import replace

import numpy as np

from fgbaseline.data.estimators.estimate import Landmarks
from fgbaseline.data.observations import BoolArray, IntArray, Observations
from fgbaseline.data.problem import Excluded, Problem
from fgbaseline.data.triangulate_landmarks import landmarks_along
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.triangulation import triangulate_tracks

from ..graph.cheirality import satisfies_cheirality
from .landmark_initialization import InitializationCriterion


def restricted_problem(problem: Problem, used: BoolArray) -> Problem:
    """Problem restricted to the observations `used` (n,) of its sequence."""
    excluded = np.where(used, Excluded.NO, np.maximum(problem.excluded, Excluded.GEOMETRY)).astype(np.uint8)
    return replace(problem, excluded=excluded)


def initial_landmarks(problem: Problem, world_T_imu: FloatArray) -> Landmarks:
    """Initial landmarks along a path (T, 4, 4): triangulated, or at their prior."""
    o = problem.observations()
    if problem.landmark_prior is not None:
        index = np.unique(o.landmark)
        return Landmarks(index, problem.landmark_prior.mean[problem.feature_row(index)])
    return triangulate_along(problem, o, world_T_imu)


def triangulate_along(problem: Problem, o: Observations, world_T_imu: FloatArray) -> Landmarks:
    """Landmarks triangulated along a path (T, 4, 4), well determined or not.

    Those without a single positive disparity are left out.
    """
    index, row = np.unique(o.landmark, return_inverse=True)
    world_T_cam = world_T_imu[o.frame] @ problem.sequence.imu_T_cam
    position = triangulate_tracks(problem.measurement, world_T_cam, row, o.pixel, len(index)).position
    placed = np.isfinite(position).all(axis=1)
    return Landmarks(index[placed], position[placed])


def select_landmarks(landmarks: Landmarks, index: IntArray) -> Landmarks:
    """Landmarks whose index is in `index`."""
    among = np.isin(landmarks.index, index)
    return Landmarks(landmarks.index[among], landmarks.position[among])


def determined_observations(problem: Problem, world_T_imu: FloatArray, criterion: InitializationCriterion) -> BoolArray:
    """Mask (n,) of the sequence's observations whose landmark is determined along a path by `criterion`, in front of
    all cameras.

    Replaces the selection of an incremental run where there is none.
    """
    if problem.landmark_prior is not None:
        return problem.mask
    found, o = landmarks_along(problem, world_T_imu), problem.observations()
    assert found.covariance is not None
    taken = np.isin(o.landmark, found.index)
    count = np.bincount(o.landmark, minlength=problem.sequence.n_landmarks)[found.index]
    distance = np.full(problem.sequence.n_landmarks, np.inf)
    at = found.position[np.searchsorted(found.index, o.landmark[taken])]
    np.minimum.at(distance, o.landmark[taken], np.linalg.norm(at - world_T_imu[o.frame[taken], :3, 3], axis=1))
    weakest = np.sqrt(np.linalg.eigvalsh(found.covariance)[:, -1])
    good = (count >= criterion.min_observations) & (weakest < criterion.max_relative_deviation * distance[found.index])
    lost = o.select(taken).landmark[~satisfies_cheirality(problem, o.select(taken), world_T_imu, found)]
    return problem.scatter_mask(np.isin(o.landmark, np.setdiff1d(found.index[good], lost)))
