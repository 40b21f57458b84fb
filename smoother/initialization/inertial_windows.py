"""Windowed initialization with raw inertial data: the samples are integrated over a second, not over the recording.

Integrated alone they end tens of meters off. Each window starts at the state where the one before ended, so that
velocity and biases are known there.
"""

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import se3

from ..graph.factors import FactorBuilder
from ..graph.frame_states import FrameStates
from .prediction import predict_state
from .windowed_initialization import WINDOW_LENGTHS, optimize_window

START_SIGMA = np.repeat([0.3, 0.005, 0.1], 3)
"""m/s, rad/s and m/s^2: of velocity, gyroscope and accelerometer bias at the start of a window, beside those of the
problem's start"""


def inertial_states(problem: Problem) -> FrameStates:
    """States of all frames after the windowed passes, from the problem's start on; without covariances."""
    factors, observations, T = FactorBuilder(problem), problem.observations(), problem.n_frames
    states = FrameStates.unknown(problem)
    states.start(problem)
    at_start = np.diag(np.concatenate([np.zeros(6), START_SIGMA**2]))
    at_start[6:, 6:] += states.given_pose(0)
    states.covariance[:] = at_start
    for length in WINDOW_LENGTHS:
        before, integrated = states.copy(), length == WINDOW_LENGTHS[0]
        for a in range(0, T - 1, length):
            b = min(a + length, T - 1)
            if integrated:
                for k in range(a + 1, b + 1):
                    states.world_T_imu[k] = predict_state(factors, states, k).pose
            else:
                moved = states.world_T_imu[a] @ se3.inverse(before.world_T_imu[a])
                states.world_T_imu[a + 1 : b + 1] = moved @ before.world_T_imu[a + 1 : b + 1]
                states.velocity[a + 1 : b + 1] = before.velocity[a + 1 : b + 1] @ moved[:3, :3].T
            values = optimize_window(factors, observations, states, a, b)
            if values is not None:
                states.take_all(values, a, b)
    return states
