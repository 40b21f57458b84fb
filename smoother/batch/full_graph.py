"""Full graph of a problem: all poses, and the landmarks of all unmasked observations."""

import gtsam
import numpy as np

from fgbaseline.data.problem import Problem

from ..graph.factors import FactorBuilder
from ..graph.frame_states import FrameStates
from ..graph.keys import landmark_key


def full_graph(problem: Problem, states: FrameStates | None = None) -> gtsam.NonlinearFactorGraph:
    """Graph with the start, the motions, unmasked observations and landmark priors.

    Raw inertial samples are integrated with the biases of `states`, by default with those of the start; how near these
    are to the solution matters to second order only.
    """
    factors, graph = FactorBuilder(problem), gtsam.NonlinearFactorGraph()
    if states is None:
        states = FrameStates.unknown(problem)
        if problem.start is not None:
            states.bias[:] = problem.start.bias
    graph.add(factors.start_prior())
    for k in range(problem.n_frames - 1):
        graph.add(factors.motion(k, states))
    o = problem.observations()
    measured = problem.measurement.rows_of(o.pixel).tolist()
    for k, j, rows in zip(o.frame.tolist(), o.landmark.tolist(), measured, strict=True):
        graph.add(factors.observation(k, landmark_key(j), rows))
    if problem.landmark_prior is not None:
        for j in np.unique(o.landmark).tolist():
            graph.add(factors.landmark_prior(j, landmark_key(j)))
    return graph
