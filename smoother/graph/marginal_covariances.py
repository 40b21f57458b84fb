"""Marginal covariances of all variables of a graph in one sweep.

Elimination writes the system as p(x_i | x_S) with R_i x_i + S_i x_S = d_i for one variable after another, where S are
the neighbors eliminated later. Backward, with G = R_i^-1 S_i, cov(x_i, x_S) = -G cov(x_S) and
cov(x_i) = R_i^-1 R_i^-T + G cov(x_S) G^T. cov(x_S) is part of the joint covariance of the first of S and its own
neighbors: the sparse inverse subset of Takahashi (1973).

It is exact and includes the landmarks. `gtsam.Marginals` starts anew for each variable.
"""

from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray


class _Joint(NamedTuple):
    """Joint covariance of some variables."""

    columns: dict[int, range]
    """columns of each variable, by its key"""
    covariance: FloatArray

    def of(self, keys: list[int]) -> list[int]:
        """Columns of some of the variables, in the order of their keys."""
        return [i for columns in map(self.columns.__getitem__, keys) for i in columns]

    def part(self, keys: list[int]) -> FloatArray:
        """The joint covariance of some of the variables, in the order of their keys."""
        if keys == list(self.columns):
            return self.covariance
        columns = np.array(self.of(keys), dtype=np.int64)
        return self.covariance.take(columns, axis=0).take(columns, axis=1)


class _Conditional(NamedTuple):
    """Conditional p(x_i | x_S) of an eliminated variable."""

    key: int
    later: list[int]
    """keys of S"""
    inverse: FloatArray
    """(d, d) R_i^-1"""
    density: gtsam.GaussianConditional

    @property
    def own(self) -> FloatArray:
        """Conditional covariance (d, d), R_i^-1 R_i^-T."""
        return self.inverse @ self.inverse.T

    @property
    def gain(self) -> FloatArray:
        """Gain G (d, n), computed on demand because it is large."""
        return self.inverse @ self.density.S()


def marginal_covariances(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, joint: Iterable[list[int]] = ()
) -> dict[int, FloatArray]:
    """The covariance (d, d) of every variable, by its key, in GTSAM's tangent order, linearized at `values`.

    For the variables of each list of `joint`, which a factor connects, there is one joint covariance, in their order,
    by the first key. Raises RuntimeError where the system is indeterminate.
    """
    frames = list(joint)
    chronological = any(len(keys) > 1 for keys in frames)
    order = _chronological(values, frames) if chronological else gtsam.Ordering.OrderingType.COLAMD
    conditionals = _conditionals(graph.linearize(values).eliminateSequential(order))
    position = {conditional.key: i for i, conditional in enumerate(conditionals)}
    together = {min(keys, key=position.__getitem__): keys for keys in frames if len(keys) > 1}
    children: dict[int, list[int]] = defaultdict(list)
    pending: list[tuple[int, _Joint]] = []
    for i, conditional in enumerate(conditionals):
        if conditional.later:
            children[min(map(position.__getitem__, conditional.later))].append(i)
        else:
            pending.append((i, _Joint({}, np.empty((0, 0)))))
    found: dict[int, FloatArray] = {}
    found_together: dict[int, FloatArray] = {}
    while pending:
        # Depth first: only the joint covariances on the way to the root are kept.
        i, parent = pending.pop()
        clique = _joint(conditionals[i], parent)
        d, key = len(conditionals[i].inverse), conditionals[i].key
        found[key] = clique.covariance[:d, :d].copy()  # a view would hold the whole
        if key in together:
            found_together[together[key][0]] = clique.part(together[key])
        inner = [child for child in children[i] if child in children or conditionals[child].key in together]
        pending.extend((child, clique) for child in inner)
        found |= _leaves([conditionals[child] for child in children[i] if child not in inner], clique)
    return found | found_together


def _chronological(values: gtsam.Values, frames: list[list[int]]) -> gtsam.Ordering:
    """Elimination order: landmarks first, then the states of the frames in temporal order.

    The backward sweep then is a Rauch-Tung-Striebel smoother, which is stable. With raw inertial data COLAMD eliminates
    some states between later and earlier ones; its gains, as large as 1 / dt^2, multiply rounding errors from frame to
    frame until variances are negative.
    """
    states = [key for keys in frames for key in keys]
    order, named = gtsam.Ordering(), set(states)
    for key in values.keys():  # noqa: SIM118 - gtsam.Values does not iterate over its keys
        if key not in named:
            order.push_back(key)
    for key in states:
        order.push_back(key)
    return order


def _conditionals(net: gtsam.GaussianBayesNet) -> list[_Conditional]:
    each = [net.at(i) for i in range(net.size())]
    R = [np.array(conditional.R()) for conditional in each]
    inverse: list[FloatArray] = [np.empty(0)] * len(each)
    for d in {len(r) for r in R}:  # one call inverts a stack: most of its time is overhead
        chosen = [i for i, r in enumerate(R) if len(r) == d]
        for i, r in zip(chosen, np.linalg.inv(np.array([R[i] for i in chosen])), strict=True):
            inverse[i] = r
    result = []
    for conditional, r in zip(each, inverse, strict=True):
        key, *later = conditional.keys()
        result.append(_Conditional(key, later, r, conditional))
    return result


def _joint(conditional: _Conditional, parent: _Joint) -> _Joint:
    """Joint covariance of a variable and its later neighbors, which are among the variables of `parent`."""
    d = len(conditional.inverse)
    columns, end = {conditional.key: range(d)}, d
    for key in conditional.later:
        columns[key] = range(end, end + len(parent.columns[key]))
        end = columns[key].stop
    covariance = np.empty((end, end))
    later = covariance[d:, d:] = parent.part(conditional.later)
    gain = conditional.gain
    cross = gain @ later
    covariance[:d, d:], covariance[d:, :d] = -cross, -cross.T
    covariance[:d, :d] = conditional.own + cross @ gain.T
    return _Joint(columns, covariance)


def _leaves(leaves: list[_Conditional], parent: _Joint) -> dict[int, FloatArray]:
    """Covariances by key of variables whose later neighbors are all among those of `parent`."""
    result: dict[int, FloatArray] = {}
    gathered: dict[tuple[int, ...], FloatArray] = {}
    for leaf in leaves:
        neighbors = tuple(leaf.later)
        if neighbors not in gathered:  # landmarks that the same frames see
            gathered[neighbors] = parent.part(leaf.later)
        gain = leaf.gain
        result[leaf.key] = leaf.own + gain @ gathered[neighbors] @ gain.T
    return result


def joint_covariance(tree: gtsam.ISAM2, keys: list[int]) -> FloatArray:
    """Joint covariance of variables of a tree, in their order, from its linearization point."""
    if len(keys) == 1:
        return np.asarray(tree.marginalCovariance(keys[0]), dtype=np.float64)
    return np.asarray(tree.jointMarginalCovariance(keys).fullMatrix(), dtype=np.float64)
