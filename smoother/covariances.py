"""The covariances of all variables of a graph in one sweep.

Elimination writes the system as p(x_i | x_S) with R_i x_i + S_i x_S = d_i for one variable after another, S standing
for neighbours that are eliminated later. From the last one back, with G = R_i^-1 S_i,

    cov(x_i, x_S) = -G cov(x_S),    cov(x_i) = R_i^-1 R_i^-T + G cov(x_S) G^T,

and cov(x_S) is part of the joint covariance of the first of S and its own neighbours: the sparse inverse subset of
Takahashi (1973). It is exact, and has the landmarks as well, where `gtsam.Marginals` starts anew for each variable.
"""

from collections import defaultdict
from typing import NamedTuple

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray


class _Joint(NamedTuple):
    """Some variables and their joint covariance."""

    columns: dict[int, slice]
    """of each variable, by its key"""
    covariance: FloatArray


def covariances(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> dict[int, FloatArray]:
    """The covariance (d, d) of every variable, by its key, in GTSAM's tangent order, linearised at `values`.

    Raises RuntimeError where the system is indeterminate.
    """
    net = graph.linearize(values).eliminateSequential(gtsam.Ordering.OrderingType.COLAMD)
    conditionals = [net.at(i) for i in range(net.size())]
    keys = [list(conditional.keys()) for conditional in conditionals]
    position = {key: i for i, (key, *_) in enumerate(keys)}
    children: dict[int, list[int]] = defaultdict(list)
    waiting: list[tuple[int, _Joint]] = []
    for i, (_, *neighbours) in enumerate(keys):
        if neighbours:
            children[min(position[key] for key in neighbours)].append(i)
        else:
            waiting.append((i, _Joint({}, np.empty((0, 0)))))
    found: dict[int, FloatArray] = {}
    while waiting:
        # Depth first: only the joint covariances on the way to the root are held.
        i, parent = waiting.pop()
        joint = _joint(keys[i], conditionals[i].R(), conditionals[i].S(), parent)
        own = joint.columns[keys[i][0]]
        found[keys[i][0]] = joint.covariance[own, own].copy()
        waiting.extend((child, joint) for child in children[i])
    return found


def _joint(keys: list[int], R: FloatArray, S: FloatArray, parent: _Joint) -> _Joint:
    """The joint covariance of a variable and its later neighbours, which are among the variables of `parent`."""
    d = len(R)
    columns, end = {keys[0]: slice(0, d)}, d
    for key in keys[1:]:
        width = parent.columns[key].stop - parent.columns[key].start
        columns[key] = slice(end, end + width)
        end += width
    R_inverse = np.linalg.inv(R)
    covariance = np.empty((end, end))
    covariance[:d, :d] = R_inverse @ R_inverse.T
    if end > d:
        among = np.concatenate([np.arange(c.start, c.stop) for c in (parent.columns[key] for key in keys[1:])])
        later = parent.covariance[np.ix_(among, among)]
        gain = R_inverse @ S
        cross = gain @ later
        covariance[:d, :d] += cross @ gain.T
        covariance[:d, d:] = -cross
        covariance[d:, :d] = -cross.T
        covariance[d:, d:] = later
    return _Joint(columns, covariance)
