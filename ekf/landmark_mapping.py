"""Landmark mapping along the dead-reckoned path (part b of the source paper, equations 11 and 12)."""

import time

import numpy as np

from fgbaseline.data.estimators.estimate import Estimate, Landmarks, Progress
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from .landmark_update import IndependentLandmarks
from .motion_model import predicted_history


def landmark_mapping(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Landmarks after one pass over all frames, along the dead-reckoned path taken as known."""
    start = time.perf_counter()
    history = predicted_history(problem)
    blocks, seconds = map_landmarks(problem, history.pose, progress)
    known = blocks.known
    return Estimate(
        name="landmark-mapping",
        landmarks=Landmarks(problem.features[known], blocks.mean[known], blocks.covariance()[known]),
        used=problem.mask,
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        **history.fields(),
    )


def map_landmarks(
    problem: Problem, world_T_imu: FloatArray, progress: Progress | None = None
) -> tuple[IndependentLandmarks, FloatArray]:
    """Landmarks mapped along given poses (T, 4, 4), and the seconds (T,) of each frame."""
    o = problem.observations()
    rows = problem.feature_row(o.landmark)
    blocks = IndependentLandmarks(problem, problem.mapping_measurement)
    seconds = np.empty(problem.n_frames)
    for k, seen in enumerate(o.by_frame(problem.n_frames)):
        frame_start = time.perf_counter()
        blocks.update(world_T_imu[k], rows[seen], o.pixel[seen])
        seconds[k] = time.perf_counter() - frame_start
        if progress is not None:
            progress(k + 1, problem.n_frames)
    return blocks, seconds
