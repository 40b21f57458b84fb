"""Windowed initialization: a dead-reckoned path optimized window by window, as initial value of a batch solution.

Points triangulated along a long dead-reckoned path are far from the minimum, and some lie behind cameras. Over a second
the drift is small. The path is therefore optimized in short windows, joined, and optimized again in longer ones.
"""

import gtsam
import numpy as np

from fgbaseline.data.observations import Observations
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3

from ..graph.factors import FactorBuilder
from ..graph.frame_states import FrameStates
from ..graph.gtsam_conversions import poses_from_values
from ..graph.keys import landmark_key
from .initial_values import triangulate_along

WINDOW_LENGTHS = (10, 40, 160)
"""Frames per window, in successive passes."""
MIN_OBSERVATIONS = 2
MAX_STEPS, RELATIVE_DECREASE = 15, 1e-3


def optimize_in_windows(problem: Problem, world_T_imu: FloatArray) -> FloatArray:
    """Path (T, 4, 4) after the windowed passes; its first pose is unchanged."""
    factors, observations, T = FactorBuilder(problem), problem.observations(), problem.n_frames
    states = FrameStates.unknown(problem)
    for length in WINDOW_LENGTHS:
        states.world_T_imu, pieces = world_T_imu, []
        for a in range(0, T - 1, length):
            b = min(a + length, T - 1)
            values = optimize_window(factors, observations, states, a, b)
            pieces.append(world_T_imu[a : b + 1] if values is None else poses_from_values(values, range(a, b + 1)))
        steps = np.concatenate([se3.relative(piece) for piece in pieces])
        world_T_imu = se3.compose(steps, world_T_imu[0])
    return world_T_imu


def optimize_window(
    factors: FactorBuilder, observations: Observations, states: FrameStates, first: int, last: int
) -> gtsam.Values | None:
    """Values of the frames first to last, optimized with the first pose fixed; None if GTSAM fails."""
    o = observations.of_frames(first, last)
    often = np.bincount(o.landmark) >= MIN_OBSERVATIONS
    landmarks = triangulate_along(factors.problem, o.select(often[o.landmark]), states.world_T_imu)
    o = o.select(np.isin(o.landmark, landmarks.index))
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    graph.add(factors.fixed_state(first, states))
    for k in range(first, last):
        graph.add(factors.motion(k, states))
    for k in range(first, last + 1):
        states.insert(values, k)
    measured = factors.problem.measurement.rows_of(o.pixel).tolist()
    for k, j, rows in zip(o.frame.tolist(), o.landmark.tolist(), measured, strict=True):
        graph.add(factors.observation(k, landmark_key(j), rows))
    for j, position in zip(landmarks.index.tolist(), landmarks.position, strict=True):
        values.insert(landmark_key(j), position)
    params = gtsam.LevenbergMarquardtParams()
    params.setMaxIterations(MAX_STEPS)
    params.setRelativeErrorTol(RELATIVE_DECREASE)
    try:
        return gtsam.LevenbergMarquardtOptimizer(graph, values, params).optimize()
    except RuntimeError:
        return None
