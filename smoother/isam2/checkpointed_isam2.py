"""iSAM2 with checkpoints: an exception of GTSAM leaves its tree destroyed."""

from collections.abc import Mapping
from collections.abc import Sequence as Listing
from typing import NamedTuple

import gtsam

from ..errors import IndeterminateSystemError, named_variable
from ..graph.keys import pose_key

CHECKPOINT_INTERVAL, CHECKPOINT_SHARE = 50, 0.125
"""Updates between checkpoints: at least CHECKPOINT_INTERVAL, and CHECKPOINT_SHARE of all updates before."""


class Update(NamedTuple):
    """The arguments of one call of `ISAM2.update`."""

    factors: gtsam.NonlinearFactorGraph
    values: gtsam.Values
    removed: tuple[int, ...] = ()
    groups: Mapping[int, int] | None = None
    """elimination group by key: larger groups are eliminated later; unlisted keys are in group 0"""
    relinearize: bool = False
    """force relinearization at this update"""
    no_relin_keys: gtsam.KeyList | None = None
    """variables that keep their linearization points at this update"""


class CheckpointedISAM2:
    """`gtsam.ISAM2` with atomic updates.

    After a failure the last copy of the tree is restored and the updates since then are repeated, which gives the same
    tree and factor slots. A copy costs time in proportion to the tree, so the interval grows with it. A checkpoint is
    also taken after each failure, because failures come in series.
    """

    def __init__(self, params: gtsam.ISAM2Params, interval: int = CHECKPOINT_INTERVAL, first: int = 0) -> None:
        """`first` is the frame of a pose that the tree has after every update."""
        self.tree = gtsam.ISAM2(params)
        self._first = pose_key(first)
        self._interval = interval
        self._updates = 0
        self._groups = _Groups()
        self._take_checkpoint()

    def _take_checkpoint(self) -> None:
        self._checkpoint = gtsam.ISAM2(self.tree)
        self._since_checkpoint: list[Update] = []

    def update(
        self,
        factors: gtsam.NonlinearFactorGraph,
        values: gtsam.Values,
        removed: Listing[int] = (),
        groups: Mapping[int, int] | None = None,
        relinearize: bool = False,
        no_relin_keys: gtsam.KeyList | None = None,
    ) -> gtsam.ISAM2Result:
        """Update the tree; where GTSAM fails, restore it and raise IndeterminateSystemError.

        Without `groups` GTSAM eliminates all variables of the new factors last.
        """
        step = Update(factors, values, tuple(removed), groups, relinearize, no_relin_keys)
        if len(self._since_checkpoint) >= max(self._interval, int(CHECKPOINT_SHARE * self._updates)):
            self._take_checkpoint()
        try:
            result = self._apply(step)
        except (RuntimeError, IndexError) as error:
            self.tree = gtsam.ISAM2(self._checkpoint)
            for past in self._since_checkpoint:
                self._apply(past)
            self._take_checkpoint()
            raise IndeterminateSystemError(named_variable(str(error)), str(error)) from error
        self._since_checkpoint.append(step)
        self._updates += 1
        return result

    def _apply(self, step: Update) -> gtsam.ISAM2Result:
        """Update and solve the tree: a pivot of zero may show only then, and the next update starts at the solution."""
        result = self.tree.update(
            step.factors,
            step.values,
            list(step.removed),
            constrainedKeys=None if step.groups is None else self._groups.with_those_of(step.groups),
            noRelinKeys=step.no_relin_keys,
            force_relinearize=step.relinearize,
        )
        self.tree.calculateEstimatePose3(self._first)
        return result


class _Groups:
    """Elimination groups as GTSAM's map, to which only the changes between two updates are applied.

    Every change is a call of GTSAM, and a dozen of hundreds of entries change.
    """

    def __init__(self) -> None:
        self._map = gtsam.KeyGroupMap()
        self._set: Mapping[int, int] = {}

    def with_those_of(self, groups: Mapping[int, int]) -> gtsam.KeyGroupMap:
        """GTSAM's map with these groups."""
        before = self._set
        for key in before.keys() - groups.keys():
            self._map.erase(key)
        # Differences of sets of items take three times as long: they hash every pair.
        for key, group in [pair for pair in groups.items() if before.get(pair[0]) != pair[1]]:
            if key in before:
                self._map.erase(key)
            self._map.insert2(key, group)
        self._set = groups
        return self._map
