"""Levenberg-Marquardt to convergence on the full graph, with final Gauss-Newton steps."""

from typing import NamedTuple

import gtsam

from fgbaseline.data.estimators.estimate import Landmarks
from fgbaseline.data.problem import Problem

from ..graph.frame_states import FrameStates
from ..graph.gauss_newton import gauss_newton
from ..initialization.initial_values import initial_landmarks

LM_STEPS, LM_DECREASE = 100, 1e-6
"""largest number of Levenberg-Marquardt steps, and the relative decrease of the cost at which they end"""
LAST_STEPS, LAST_DECREASE = 50, 1e-10
"""largest number of Gauss-Newton steps that follow, and the relative decrease of the cost at which they end"""
NEAR, FAR = 1e-9, 1e-5
"""initial damping: nearly undamped from an estimate, damped from dead reckoning"""


class LocalMinimum(NamedTuple):
    """Result of the optimization from one initial value."""

    start: str
    values: gtsam.Values
    cost: float
    """half the sum of squared whitened residuals, under the kernel"""


def optimize_from_estimate(
    graph: gtsam.NonlinearFactorGraph, start: str, states: FrameStates, landmarks: Landmarks
) -> LocalMinimum:
    """Optimize from the estimate of another smoother."""
    return _levenberg_marquardt(graph, start, states.values(landmarks), NEAR)


def optimize_from_path(
    graph: gtsam.NonlinearFactorGraph, problem: Problem, start: str, states: FrameStates
) -> LocalMinimum:
    """Optimize from the states of a path alone; `graph` is that of `problem`."""
    return _levenberg_marquardt(graph, start, states.values(initial_landmarks(problem, states.world_T_imu)), FAR)


def _levenberg_marquardt(
    graph: gtsam.NonlinearFactorGraph, start: str, values: gtsam.Values, damping: float
) -> LocalMinimum:
    params = gtsam.LevenbergMarquardtParams()
    params.setMaxIterations(LM_STEPS)
    params.setRelativeErrorTol(LM_DECREASE)
    params.setAbsoluteErrorTol(0.0)
    params.setlambdaInitial(damping)
    values = gtsam.LevenbergMarquardtOptimizer(graph, values, params).optimize()
    values = gauss_newton(graph, values, LAST_STEPS, LAST_DECREASE).values
    return LocalMinimum(start, values, float(graph.error(values)))
