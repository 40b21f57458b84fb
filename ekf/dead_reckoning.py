"""Dead reckoning (equation 9): mean and covariance from the velocities alone."""

import time

import numpy as np

from fgbaseline.data.estimate import Estimate, Landmarks, Progress
from fgbaseline.data.motion import dead_reckoned_path
from fgbaseline.data.problem import Problem
from fgbaseline.data.triangulated import landmarks_along
from fgbaseline.geometry import FloatArray, se3

from .pose_update import predicted_covariance


def dead_reckoning(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Dead-reckoned path with its covariance (equation 9), without corrections by observations.

    Landmarks are at their prior where the problem has one (the average of their back-projections), else triangulated
    along the path.
    """
    start = time.perf_counter()
    world_T_imu = dead_reckoned_path(problem.increment, problem.initial_pose)
    covariance = propagated_covariance(problem)
    seconds = np.full(problem.n_frames, (time.perf_counter() - start) / problem.n_frames)
    if problem.landmark_prior is not None:
        landmarks = Landmarks(problem.features, problem.landmark_prior.mean)
    else:
        landmarks = landmarks_along(problem, world_T_imu)
    if progress is not None:
        progress(problem.n_frames, problem.n_frames)
    return Estimate(
        name="dead-reckoning",
        world_T_imu=world_T_imu,
        covariance=covariance,
        landmarks=landmarks,
        used=np.zeros(len(problem.excluded), dtype=np.bool_),
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
    )


def propagated_covariance(problem: Problem) -> FloatArray:
    """Covariances (T, 6, 6) of the dead-reckoned poses (equation 9)."""
    steps = se3.exp(problem.increment)
    covariance = np.empty((problem.n_frames, 6, 6))
    covariance[0] = problem.initial_covariance
    for k, step in enumerate(steps):
        covariance[k + 1] = predicted_covariance(covariance[k], step, problem.increment_covariance[k])
    return covariance
