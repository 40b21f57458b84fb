"""iSAM2 over the recent part of a growing graph, with old frames marginalized into a linear prior.

An update of GTSAM traverses its whole tree, so its cost grows with the length of the drive. From time to time the tree
is replaced by one over the last frames, and the rest becomes a linear prior at the same linearization points. The
solution is unchanged, but marginalized frames are not relinearized. The graph keeps every factor: for the final
Gauss-Newton steps, and to rebuild the whole tree when a marginalized landmark is observed again.
"""

from collections.abc import Collection, Iterable, Mapping
from collections.abc import Sequence as Listing

import gtsam
import numpy as np

from fgbaseline.data.observations import IntArray, Observations

from ..errors import IndeterminateSystemError
from ..graph.keys import AUXILIARY_POSE, width
from .checkpointed_isam2 import CheckpointedISAM2

AUXILIARY_NOISE = gtsam.noiseModel.Unit.Create(6)
"""noise between the newest pose and `keys.AUXILIARY_POSE`; any value gives the same solution"""
IN_PRIOR = -1
"""tree slot of a factor that is in the linear prior or was removed"""
NO_POSE = -1
"""frame of a factor without a pose"""
UNSEEN_FRAMES = 2
"""Frames without an observation after which a track may continue: the mask interrupts tracks for that long."""


class MarginalizedISAM2:
    """Whole graph with constant factor slots, and an iSAM2 tree over its recent part; updates are atomic."""

    def __init__(self, params: gtsam.ISAM2Params) -> None:
        self._params = params
        self._isam = CheckpointedISAM2(params)
        self._graph = gtsam.NonlinearFactorGraph()
        self._marginalized = gtsam.Values()
        """values of the variables that are no longer in the tree"""
        self._tree_slot: list[int] = []
        """tree slot of the factor in each slot of the graph"""
        self._frame: list[int] = []
        """first frame among the poses of each of these factors"""
        self._prior: list[int] = []
        """tree slots of the linear prior"""
        self._auxiliary_slot: int | None = None
        """tree slot of the factor to the auxiliary pose"""

    @property
    def tree(self) -> gtsam.ISAM2:
        """Tree after the last update; replaced by `marginalize_before` and `restore_all`."""
        return self._isam.tree

    def update(
        self,
        factors: gtsam.NonlinearFactorGraph,
        frames: Listing[int],
        values: gtsam.Values,
        newest: Listing[int],
        removed: Collection[int] = (),
        groups: Mapping[int, int] | None = None,
        relinearize: bool = False,
        no_relin_keys: gtsam.KeyList | None = None,
        replaced: Mapping[int, gtsam.NonlinearFactor] | None = None,
    ) -> Listing[int]:
        """Update the tree, see `CheckpointedISAM2`; returns the slots of the new factors, in their order.

        `frames` has the first frame among the poses of each factor, or NO_POSE. `newest` are the keys of the newest
        state, to which the auxiliary pose is tied from now on. `removed` are slots; factors that are already in the
        prior stay in it. `replaced` has new factors for slots in the tree (`in_tree`). Raises IndeterminateSystemError.
        """
        replaced = replaced or {}
        places = [self._tree_slot[slot] for slot in (*removed, *replaced) if self._tree_slot[slot] != IN_PRIOR]
        tied = gtsam.NonlinearFactorGraph(factors)
        for factor in replaced.values():
            tied.add(factor)
        tied.add(_auxiliary_factor(newest))
        if self._auxiliary_slot is None:
            values.insert(AUXILIARY_POSE, values.atPose3(newest[0]))
        else:
            places.append(self._auxiliary_slot)
        result = self._isam.update(tied, values, places, groups, relinearize, no_relin_keys)
        *new, self._auxiliary_slot = result.getNewFactorsIndices()
        for slot in removed:
            self._graph.remove(slot)
            self._tree_slot[slot] = IN_PRIOR
        for (slot, factor), place in zip(replaced.items(), new[factors.size() :], strict=True):
            self._graph.replace(slot, factor)
            self._tree_slot[slot] = place
        del new[factors.size() :]
        slots = range(len(self._tree_slot), len(self._tree_slot) + len(new))
        self._graph.push_back(factors)
        self._tree_slot += new
        self._frame += frames
        return slots

    def in_tree(self, slot: int) -> bool:
        """False for a factor that is in the linear prior or was removed."""
        return self._tree_slot[slot] != IN_PRIOR

    def relinearize(self) -> int:
        """Relinearize variables beyond their thresholds; return their number. Raises IndeterminateSystemError."""
        result = self._isam.update(gtsam.NonlinearFactorGraph(), gtsam.Values(), relinearize=True)
        return int(result.getVariablesRelinearized())

    def marginalize_before(self, first: int, groups: Mapping[int, int]) -> bool:
        """Marginalize the frames before `first` into a linear prior; False, with the tree unchanged, if GTSAM fails.

        Later factors must not refer to the marginalized variables: poses before `first`, and landmarks without
        observations since. `groups` are elimination groups, as in `update`.
        """
        assert self._auxiliary_slot is not None
        point, factors = self.tree.getLinearizationPoint(), self.tree.getFactorsUnsafe()
        behind, ahead, place = self._split(factors, first)
        staying = set(ahead.keyVector())
        try:
            prior = behind.linearize(point).marginal([key for key in behind.keyVector() if key in staying])
            n = ahead.size()
            for i in range(prior.size()):
                ahead.add(gtsam.LinearContainerFactor(prior.at(i), point))
            isam = CheckpointedISAM2(self._params, first=first)
            isam.update(ahead, point.extract(list(staying)), groups=groups)
        except (RuntimeError, IndeterminateSystemError):
            return False
        estimate = self.tree.calculateEstimate()
        leaving = [key for key in estimate.keys() if key not in staying]  # noqa: SIM118
        self._marginalized.insert(estimate.extract(leaving))
        self._isam = isam
        self._tree_slot = place[self._tree_slot].tolist()
        self._prior = list(range(n, ahead.size()))
        self._auxiliary_slot = int(place[self._auxiliary_slot])
        return True

    def is_marginalized(self, key: int) -> bool:
        """True where a variable is in the linear prior only."""
        return bool(self._marginalized.exists(key))

    def restore_all(self, groups: Mapping[int, int]) -> bool:
        """Rebuild the tree over all frames; False, with the tree unchanged, if GTSAM fails.

        `groups` are elimination groups, as in `update`.
        """
        assert self._auxiliary_slot is not None
        factors, place = gtsam.NonlinearFactorGraph(), list[int]()
        for slot in range(self._graph.size()):
            factor = self._graph.at(slot)
            place.append(IN_PRIOR if factor is None else factors.size())
            if factor is not None:
                factors.add(factor)
        tail = factors.size()
        factors.add(self.tree.getFactorsUnsafe().at(self._auxiliary_slot))
        point = gtsam.Values(self._marginalized)
        point.insert(self.tree.getLinearizationPoint())
        isam = CheckpointedISAM2(self._params)
        try:
            isam.update(factors, point.extract(list(set(factors.keyVector()))), groups=groups, relinearize=True)
        except IndeterminateSystemError:
            return False
        self._isam, self._marginalized, self._tree_slot, self._prior, self._auxiliary_slot = (
            isam,
            gtsam.Values(),
            place,
            [],
            tail,
        )
        return True

    def _split(
        self, factors: gtsam.NonlinearFactorGraph, first: int
    ) -> tuple[gtsam.NonlinearFactorGraph, gtsam.NonlinearFactorGraph, IntArray]:
        """Factors to marginalize, the others, and the new slot of each of the others by its slot in the tree, IN_PRIOR
        for the rest (the last entry is that of IN_PRIOR itself).

        Marginalized are factors on poses before `first`, and those on landmarks observed only there.
        """
        assert self._auxiliary_slot is not None
        slots, frames = np.array(self._tree_slot), np.array(self._frame)
        slots, frames = slots[slots != IN_PRIOR], frames[slots != IN_PRIOR]
        staying_slots = [self._auxiliary_slot, *slots[frames >= first].tolist()]
        leaving_slots = [*self._prior, *slots[(frames < first) & (frames != NO_POSE)].tolist()]
        behind, ahead = _some(factors, leaving_slots), _some(factors, staying_slots)
        staying = set(ahead.keyVector())
        for there in slots[frames == NO_POSE].tolist():
            factor = factors.at(there)
            if staying.issuperset(factor.keys()):
                staying_slots.append(there)
                ahead.add(factor)
            else:
                behind.add(factor)
        place = np.full(factors.size() + 1, IN_PRIOR)
        place[staying_slots] = np.arange(len(staying_slots))
        return behind, ahead, place

    def estimate(self) -> gtsam.Values:
        """Estimates of all variables, marginalized ones and the auxiliary pose included."""
        values = gtsam.Values(self._marginalized)
        values.insert(self.tree.calculateEstimate())
        return values

    def release(self) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """Factors in their slots and the solution without the auxiliary pose; frees the tree."""
        values = self.estimate()
        values.erase(AUXILIARY_POSE)
        del self._isam
        return self._graph, values


def _auxiliary_factor(newest: Listing[int]) -> gtsam.NonlinearFactor:
    """Factor between the auxiliary pose and the variables of the newest state, which it does not constrain."""
    if len(newest) == 1:
        return gtsam.BetweenFactorPose3(newest[0], AUXILIARY_POSE, gtsam.Pose3(), AUXILIARY_NOISE)
    graph = gtsam.GaussianFactorGraph()
    noise, tail = gtsam.noiseModel.Diagonal.Sigmas(np.ones(6)), (AUXILIARY_POSE, np.eye(6), np.zeros(6))
    for key in newest:
        graph.push_back(gtsam.JacobianFactor(key, np.zeros((6, width(key))), *tail, noise))
    return gtsam.LinearContainerFactor(gtsam.JacobianFactor(graph))


def _some(factors: gtsam.NonlinearFactorGraph, slots: Iterable[int]) -> gtsam.NonlinearFactorGraph:
    """Graph of the factors in some slots, in their order."""
    result = gtsam.NonlinearFactorGraph()
    for slot in slots:
        result.add(factors.at(slot))
    return result


def marginalization_horizon(o: Observations, k: int) -> int:
    """Oldest frame of the tracks observed at k - UNSEEN_FRAMES or later, from observations up to frame k.

    Frame k + 1 where there is no such track.
    """
    recent, now = np.searchsorted(o.frame, [k - UNSEEN_FRAMES, k + 1])
    alive = np.isin(o.landmark[:now], o.landmark[recent:now])
    return int(o.frame[:now][alive].min(initial=k + 1))
