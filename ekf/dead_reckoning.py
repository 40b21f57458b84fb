"""Dead reckoning: mean and covariance from the velocities (equation 9) or the inertial samples alone."""

import time

import numpy as np

from fgbaseline.data.estimators.estimate import Estimate, Landmarks, Progress
from fgbaseline.data.problem import Problem
from fgbaseline.data.triangulate_landmarks import landmarks_along

from .motion_model import predicted_history


def dead_reckoning(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Dead-reckoned path with its covariance (equation 9), or strapdown integration of all inertial samples.

    Landmarks are at their prior where the problem has one (the average of their back-projections), else triangulated
    along the path.
    """
    start = time.perf_counter()
    history = predicted_history(problem)
    seconds = np.full(problem.n_frames, (time.perf_counter() - start) / problem.n_frames)
    if problem.landmark_prior is not None:
        landmarks = Landmarks(problem.features, problem.landmark_prior.mean)
    else:
        landmarks = landmarks_along(problem, history.pose)
    if progress is not None:
        progress(problem.n_frames, problem.n_frames)
    return Estimate(
        name="dead-reckoning",
        landmarks=landmarks,
        used=np.zeros(len(problem.excluded), dtype=np.bool_),
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        **history.fields(),
    )
