"""Gauss-Newton with step extension on a whole graph."""

from typing import NamedTuple

import gtsam

MAX_STEPS = 100
"""largest number of steps: three suffice after a sound run of iSAM2, twenty from five times the minimum cost"""
RELATIVE_DECREASE = 1e-7
"""relative decrease of the cost at convergence"""
MAX_STEP_SCALE, MIN_STEP_SCALE = 64.0, 1.0 / 64.0
"""largest and smallest scale of a step"""
LEAST_DAMPING = 1e-9
"""initial damping where the undamped system is indeterminate"""


def compact_graph(graph: gtsam.NonlinearFactorGraph) -> gtsam.NonlinearFactorGraph:
    """Graph without the empty slots of removed factors."""
    if graph.nrFactors() == graph.size():
        return gtsam.NonlinearFactorGraph(graph)
    result = gtsam.NonlinearFactorGraph()
    for i in range(graph.size()):
        factor = graph.at(i)
        if factor is not None:
            result.add(factor)
    return result


class GaussNewtonResult(NamedTuple):
    """Values after the steps, and the reason of an early failure."""

    values: gtsam.Values
    failure: str = ""


def gauss_newton(
    graph: gtsam.NonlinearFactorGraph,
    values: gtsam.Values,
    max_steps: int = MAX_STEPS,
    relative_decrease: float = RELATIVE_DECREASE,
) -> GaussNewtonResult:
    """Apply Gauss-Newton steps as long as each lowers the cost.

    They remove the error of linearization points that an incremental run keeps within its thresholds. Under a kernel
    the steps are too short along weakly determined directions, so each is doubled as long as the cost falls. A step
    that is too long, such as one through a camera plane, is halved.

    Where the system is indeterminate or nearly so, damped steps (Levenberg-Marquardt) take it to its minimum. Too few
    steps for convergence are a failure, as are damped steps that fail; the result then has the last values.
    """
    cost = graph.error(values)
    ordering = gtsam.Ordering.ColamdNonlinearFactorGraph(graph)
    for _ in range(max_steps):
        before = cost
        try:
            step = graph.linearize(values).optimize(ordering)
        except RuntimeError:
            return _damped(graph, values, max_steps, relative_decrease)
        values, cost = _line_search(graph, values, step, cost)
        if before - cost < relative_decrease * before or cost == before:
            return GaussNewtonResult(values)
    return GaussNewtonResult(values, f"the cost still falls after {max_steps} Gauss-Newton steps")


def _damped(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, max_steps: int, relative_decrease: float
) -> GaussNewtonResult:
    """Levenberg-Marquardt, nearly undamped at first."""
    params = gtsam.LevenbergMarquardtParams()
    params.setMaxIterations(max_steps)
    params.setRelativeErrorTol(relative_decrease)
    params.setAbsoluteErrorTol(0.0)
    params.setlambdaInitial(LEAST_DAMPING)
    try:
        return GaussNewtonResult(gtsam.LevenbergMarquardtOptimizer(graph, values, params).optimize())
    except RuntimeError as error:
        return GaussNewtonResult(values, str(error).strip().partition("\n")[0])


def _line_search(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, step: gtsam.VectorValues, cost: float
) -> tuple[gtsam.Values, float]:
    """Values and their cost after the step, doubled as long as the cost falls, else halved until it falls."""
    best, times, factor = values, 1.0, 2.0
    while MIN_STEP_SCALE <= times <= MAX_STEP_SCALE:
        trial = values.retract(step.scale(times))
        trial_cost = graph.error(trial)
        if trial_cost < cost:
            best, cost = trial, trial_cost
            if factor < 1.0:
                break
        elif best is values:
            factor = 0.5
        else:
            break
        times *= factor
    return best, cost
