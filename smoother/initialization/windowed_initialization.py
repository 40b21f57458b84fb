"""Windowed initialization: a dead-reckoned path optimized window by window, as initial value of a batch solution.

Points triangulated along a long dead-reckoned path are far from the minimum, and some lie behind cameras. Over a second
the drift is small. The path is therefore optimized in short windows, joined, and optimized again in longer ones.
"""

import gtsam
import numpy as np

from fgbaseline.data.observations import Observations
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.measurement import measured_rows

from ..graph.factors import FactorBuilder
from ..graph.gtsam_conversions import poses_from_values
from ..graph.keys import landmark_key, pose_key
from .initial_values import triangulate_along

WINDOW_LENGTHS = (10, 40, 160)
"""Frames per window, in successive passes."""
MIN_OBSERVATIONS = 2
MAX_STEPS, RELATIVE_DECREASE = 15, 1e-3


def optimize_in_windows(problem: Problem, world_T_imu: FloatArray) -> FloatArray:
    """Path (T, 4, 4) after the windowed passes; its first pose is unchanged."""
    factors, observations, T = FactorBuilder(problem), problem.observations(), problem.n_frames
    for length in WINDOW_LENGTHS:
        starts = range(0, T - 1, length)
        pieces = [optimize_window(factors, observations, world_T_imu, a, min(a + length, T - 1)) for a in starts]
        steps = np.concatenate([se3.relative(piece) for piece in pieces])
        world_T_imu = se3.compose(steps, world_T_imu[0])
    return world_T_imu


def optimize_window(
    factors: FactorBuilder, observations: Observations, world_T_imu: FloatArray, first: int, last: int
) -> FloatArray:
    """Poses of the frames first to last, optimized with the first one fixed; unchanged if GTSAM fails."""
    o = observations.of_frames(first, last)
    often = np.bincount(o.landmark) >= MIN_OBSERVATIONS
    landmarks = triangulate_along(factors.problem, o.select(often[o.landmark]), world_T_imu)
    o = o.select(np.isin(o.landmark, landmarks.index))
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    held = gtsam.noiseModel.Diagonal.Sigmas(factors.fixed_pose_sigmas)
    graph.push_back(gtsam.PriorFactorPose3(pose_key(first), gtsam.Pose3(world_T_imu[first]), held))
    for k in range(first, last):
        graph.push_back(factors.between(k))
    for k in range(first, last + 1):
        values.insert(pose_key(k), gtsam.Pose3(world_T_imu[k]))
    for k, j, rows in zip(o.frame.tolist(), o.landmark.tolist(), measured_rows(o.pixel), strict=True):
        graph.push_back(factors.stereo(k, landmark_key(j), rows))
    for j, position in zip(landmarks.index.tolist(), landmarks.position, strict=True):
        values.insert(landmark_key(j), position)
    params = gtsam.LevenbergMarquardtParams()
    params.setMaxIterations(MAX_STEPS)
    params.setRelativeErrorTol(RELATIVE_DECREASE)
    try:
        return poses_from_values(
            gtsam.LevenbergMarquardtOptimizer(graph, values, params).optimize(), range(first, last + 1)
        )
    except RuntimeError:
        return world_T_imu[first : last + 1]
