"""The final relinearisation: Gauss-Newton over the whole graph from where the increments led."""

import gtsam
import numpy as np

MAX_STEPS = 10
RELATIVE_DECREASE = 1e-7
"""of the cost, at which it stops"""


def compact(graph: gtsam.NonlinearFactorGraph) -> gtsam.NonlinearFactorGraph:
    """The factors of a graph without the empty slots that removals leave."""
    result = gtsam.NonlinearFactorGraph()
    for i in range(graph.size()):
        factor = graph.at(i)
        if factor is not None:
            result.push_back(factor)
    return result


def relinearised(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> gtsam.Values:
    """The values after Gauss-Newton steps, as long as each lowers the cost.

    Every linearisation point of an incremental run is off by up to its threshold; this takes that away. Raises
    RuntimeError where the system is indeterminate.
    """
    optimizer = gtsam.GaussNewtonOptimizer(graph, values)
    best, cost = values, graph.error(values)
    for _ in range(MAX_STEPS):
        optimizer.iterate()
        new_cost = optimizer.error()
        if not (np.isfinite(new_cost) and new_cost < cost):
            break
        decrease = (cost - new_cost) / cost
        best, cost = optimizer.values(), new_cost
        if decrease < RELATIVE_DECREASE:
            break
    return best
