"""Gauss-Newton with step extension on a whole graph."""

from typing import NamedTuple

import gtsam

MAX_STEPS = 10
RELATIVE_DECREASE = 1e-7
"""of the cost, at which it stops"""
MAX_STEP_SCALE = 64.0
"""times the step"""


def compact_graph(graph: gtsam.NonlinearFactorGraph) -> gtsam.NonlinearFactorGraph:
    """Graph without the empty slots of removed factors."""
    if graph.nrFactors() == graph.size():
        return gtsam.NonlinearFactorGraph(graph)
    result = gtsam.NonlinearFactorGraph()
    for i in range(graph.size()):
        factor = graph.at(i)
        if factor is not None:
            result.push_back(factor)
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

    Every linearization point of an incremental run is off by up to its threshold; this takes that away. Under a kernel
    the steps are too short along weak directions, so each is doubled as long as that lowers the cost further. Where
    the system is indeterminate the values at which it is are given, with GTSAM's words.
    """
    cost = graph.error(values)
    ordering = gtsam.Ordering.ColamdNonlinearFactorGraph(graph)
    for _ in range(max_steps):
        try:
            step = graph.linearize(values).optimize(ordering)
        except RuntimeError as error:
            return GaussNewtonResult(values, str(error).strip().partition("\n")[0])
        longer, longer_cost = _line_search(graph, values, step, cost)
        if not longer_cost < cost:
            break
        decrease = (cost - longer_cost) / cost
        values, cost = longer, longer_cost
        if decrease < relative_decrease:
            break
    return GaussNewtonResult(values)


def _line_search(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, step: gtsam.VectorValues, cost: float
) -> tuple[gtsam.Values, float]:
    """Values and cost after the step, doubled as long as that lowers the cost."""
    times, best = 1.0, values
    while times <= MAX_STEP_SCALE:
        trial = values.retract(step.scale(times))
        trial_cost = graph.error(trial)
        if not trial_cost < cost:
            break
        best, cost, times = trial, trial_cost, 2.0 * times
    return best, cost
