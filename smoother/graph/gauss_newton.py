"""Gauss-Newton with step extension on a whole graph."""

from typing import NamedTuple

import gtsam

MAX_STEPS = 100
"""three suffice after a sound run of iSAM2, and twenty where its increments ended at five times the minimum's cost"""
RELATIVE_DECREASE = 1e-7
"""of the cost, at which it stops"""
MAX_STEP_SCALE, MIN_STEP_SCALE = 64.0, 1.0 / 64.0
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
    the steps are too short along weak directions, so each is doubled as long as that lowers the cost further; one that
    is too long, as through a camera's plane, is halved. Where the system is indeterminate the values at which it is
    are given, with GTSAM's words, and where the steps do not suffice the last values, which is a failure too.
    """
    cost = graph.error(values)
    ordering = gtsam.Ordering.ColamdNonlinearFactorGraph(graph)
    for _ in range(max_steps):
        try:
            step = graph.linearize(values).optimize(ordering)
        except RuntimeError as error:
            return GaussNewtonResult(values, str(error).strip().partition("\n")[0])
        before = cost
        values, cost = _line_search(graph, values, step, cost)
        if before - cost < relative_decrease * before or cost == before:
            return GaussNewtonResult(values)
    return GaussNewtonResult(values, f"the cost still falls after {max_steps} Gauss-Newton steps")


def _line_search(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, step: gtsam.VectorValues, cost: float
) -> tuple[gtsam.Values, float]:
    """The values and their cost after the step, doubled as long as that pays, else halved until it lowers the cost."""
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
