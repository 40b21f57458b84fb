"""Full graph of a problem: all poses, and the landmarks of all unmasked observations."""

import gtsam
import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry.measurement import measured_rows

from ..graph.factors import FactorBuilder
from ..graph.keys import landmark_key


def full_graph(problem: Problem) -> gtsam.NonlinearFactorGraph:
    """Graph with the first pose, increments, unmasked observations and landmark priors."""
    factors, graph = FactorBuilder(problem), gtsam.NonlinearFactorGraph()
    graph.push_back(factors.pose_prior())
    for k in range(problem.n_frames - 1):
        graph.push_back(factors.between(k))
    o = problem.observations()
    for k, j, rows in zip(o.frame.tolist(), o.landmark.tolist(), measured_rows(o.pixel), strict=True):
        graph.push_back(factors.stereo(k, landmark_key(j), rows))
    if problem.landmark_prior is not None:
        for j in np.unique(o.landmark).tolist():
            graph.push_back(factors.landmark_prior(j, landmark_key(j)))
    return graph
