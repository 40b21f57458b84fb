"""The minimum of a whole graph by Levenberg-Marquardt, to convergence."""

from typing import NamedTuple

import gtsam

from fgbaseline.data.estimate import Landmarks
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from ..graph.gauss_newton import relinearised
from ..graph.gtsam_conversions import values_at
from ..initialization.initial_values import landmarks_from
from ..initialization.windowed_initialization import piecewise

LM_STEPS, LM_DECREASE = 100, 1e-6
"""Levenberg-Marquardt goes on until a step lowers the cost by no more than this share: it is near then"""
LAST_STEPS, LAST_DECREASE = 50, 1e-10
"""and undamped steps end it"""
NEAR, FAR = 1e-9, 1e-5
"""first damping: from an answer a Gauss-Newton step is the right one, from dead reckoning not"""


class Minimum(NamedTuple):
    """Where the descent from one start ended."""

    start: str
    values: gtsam.Values
    cost: float
    """half the sum of squared whitened residuals, under the kernel"""


def from_answer(
    graph: gtsam.NonlinearFactorGraph, start: str, world_T_imu: FloatArray, landmarks: Landmarks
) -> Minimum:
    """From another smoother's answer."""
    return _descended(graph, start, values_at(world_T_imu, landmarks), NEAR)


def from_path(graph: gtsam.NonlinearFactorGraph, problem: Problem, start: str, world_T_imu: FloatArray) -> Minimum:
    """From a path alone, solved in pieces first; the graph is that of `problem`."""
    path = piecewise(problem, world_T_imu)
    return _descended(graph, start, values_at(path, landmarks_from(problem, path)), FAR)


def _descended(graph: gtsam.NonlinearFactorGraph, start: str, values: gtsam.Values, damping: float) -> Minimum:
    params = gtsam.LevenbergMarquardtParams()
    params.setMaxIterations(LM_STEPS)
    params.setRelativeErrorTol(LM_DECREASE)
    params.setAbsoluteErrorTol(0.0)
    params.setlambdaInitial(damping)
    values = gtsam.LevenbergMarquardtOptimizer(graph, values, params).optimize()
    values = relinearised(graph, values, LAST_STEPS, LAST_DECREASE).values
    return Minimum(start, values, float(graph.error(values)))
