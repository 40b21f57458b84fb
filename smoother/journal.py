"""An iSAM2 that can go back: after an exception GTSAM leaves the tree destroyed."""

import re
from collections.abc import Sequence as Listing
from typing import NamedTuple

import gtsam


class Update(NamedTuple):
    """The arguments of one call of `ISAM2.update`."""

    factors: gtsam.NonlinearFactorGraph
    values: gtsam.Values
    removed: tuple[int, ...] = ()
    last: int | None = None
    """the key of a variable that is to be eliminated after all others"""
    relinearise: bool = False
    """at this update, whichever the next one is that would"""


class IndeterminateSystemError(Exception):
    """An update failed; the tree is as it was before it. `key` is the variable that GTSAM named, if any."""

    def __init__(self, key: int | None, text: str) -> None:
        super().__init__(text)
        self.key = key


class RestorableISAM2:
    """`gtsam.ISAM2` with updates that either succeed or change nothing.

    Every `interval` updates a copy of the tree is kept; after a failure the copy is restored and the updates since
    then are repeated, which gives the same tree and the same factor slots.
    """

    def __init__(self, params: gtsam.ISAM2Params, interval: int = 50) -> None:
        self.tree = gtsam.ISAM2(params)
        self._interval = interval
        self._copy = gtsam.ISAM2(self.tree)
        self._since_copy: list[Update] = []

    def update(
        self,
        factors: gtsam.NonlinearFactorGraph,
        values: gtsam.Values,
        removed: Listing[int] = (),
        last: int | None = None,
        relinearise: bool = False,
    ) -> gtsam.ISAM2Result:
        """One update; raises IndeterminateSystemError, the tree being restored, where GTSAM fails.

        GTSAM eliminates all variables of the new factors last, unless `last` names the only one that is to be.
        """
        step = Update(factors, values, tuple(removed), last, relinearise)
        if len(self._since_copy) >= self._interval:
            self._copy = gtsam.ISAM2(self.tree)
            self._since_copy = []
        try:
            result = _apply(self.tree, step)
        except (RuntimeError, IndexError) as error:
            self.tree = gtsam.ISAM2(self._copy)
            for past in self._since_copy:
                _apply(self.tree, past)
            raise IndeterminateSystemError(named_variable(str(error)), str(error)) from error
        self._since_copy.append(step)
        return result


def _apply(tree: gtsam.ISAM2, step: Update) -> gtsam.ISAM2Result:
    groups = None
    if step.last is not None:
        groups = gtsam.KeyGroupMap()
        groups.insert2(step.last, 1)
    return tree.update(
        step.factors,
        step.values,
        list(step.removed),
        constrainedKeys=groups,
        force_relinearize=step.relinearise,
    )


def named_variable(text: str) -> int | None:
    """The key of the variable that a message of GTSAM names."""
    match = re.search(r"variable\s+(\d+)", text)
    return int(match.group(1)) if match else None
