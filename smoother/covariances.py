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

    columns: dict[int, range]
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
        own = _Own.of(keys[i][1:], conditionals[i].R(), conditionals[i].S(), parent)
        found[keys[i][0]] = own.covariance
        if children[i]:
            joint = _joint(keys[i], own, parent)
            waiting.extend((child, joint) for child in children[i])
    return found


class _Own(NamedTuple):
    """A variable's covariance, and what it took."""

    covariance: FloatArray
    cross: FloatArray
    """-cov(x_i, x_S)"""
    later: FloatArray
    """cov(x_S)"""

    @staticmethod
    def of(later_keys: list[int], R: FloatArray, S: FloatArray, parent: _Joint) -> "_Own":
        """Of the variable with this conditional, whose later neighbours are among the variables of `parent`."""
        R_inverse = np.linalg.inv(R)
        covariance = R_inverse @ R_inverse.T
        if not later_keys:
            return _Own(covariance, np.empty((len(R), 0)), np.empty((0, 0)))
        among = [i for columns in map(parent.columns.__getitem__, later_keys) for i in columns]
        later = parent.covariance[among][:, among]
        gain = R_inverse @ S
        cross = gain @ later
        return _Own(covariance + cross @ gain.T, cross, later)


def _joint(keys: list[int], own: _Own, parent: _Joint) -> _Joint:
    """The joint covariance of a variable and its later neighbours."""
    d = len(own.covariance)
    columns, end = {keys[0]: range(d)}, d
    for key in keys[1:]:
        columns[key] = range(end, end + len(parent.columns[key]))
        end = columns[key].stop
    return _Joint(columns, np.block([[own.covariance, -own.cross], [-own.cross.T, own.later]]))
