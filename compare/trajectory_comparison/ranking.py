"""Ranking of estimates by the RMSE over their common stamps, with paired bootstrap intervals of the differences."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fgbaseline.compare.statistics.block_bootstrap import ErrorStatistics, bootstrapped
from fgbaseline.compare.statistics.paired_bootstrap import RmseDifference, rmse_difference
from fgbaseline.compare.trajectory.association import common_stamps, rankable
from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray

AT_MOST = 100_000_000
"""largest number of errors that a bootstrap draws"""
REPETITIONS = 1000


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Ranking(Displayed):
    """Position errors over the stamps that all ranked estimates have: see `compare.rankable`."""

    at: dict[str, IntArray]
    """indices of the pairs of poses at these stamps, by name, nearest first"""
    common: dict[str, ErrorStatistics]
    """statistics of the position errors over the pairs in `at`, m, by name, nearest first"""
    behind: dict[str, RmseDifference]
    """RMSE of each of `rivals` minus that of the first, which has no entry"""
    rivals: tuple[str, ...]
    """ranked estimates, smallest RMSE first, without by-products of the reference"""
    same: bool
    """whether the common stamps are all stamps of every estimate"""

    @property
    def moments(self) -> int:
        """Number of common stamps; 0 where no two estimates can be ranked."""
        return len(next(iter(self.at.values()), ()))

    def rmse(self, name: str) -> float:
        """RMSE of the positions over the common stamps, m."""
        return float(self.common[name]["rmse"].value)

    def rank(self, name: str) -> int | None:
        """Rank from 1; None for estimates that are not ranked, and for by-products of the reference."""
        return self.rivals.index(name) + 1 if name in self.rivals else None


def spread(errors: FloatArray, seed: int) -> ErrorStatistics:
    """`bootstrapped` statistics of errors (n,), with fewer repetitions for very long paths, at least 100."""
    repetitions = int(np.clip(AT_MOST // max(len(errors), 1), 100, REPETITIONS))
    return bootstrapped(errors, repetitions=repetitions, seed=seed)


def ranking_of(
    errors: Mapping[str, FloatArray],
    stamps: Mapping[str, np.ndarray],
    tolerance: float,
    by_products: frozenset[str],
    seed: int,
    statistics: Mapping[str, ErrorStatistics] | None = None,
) -> Ranking:
    """Ranking by the RMSE of `errors` (n,) at increasing `stamps` (n,), s, of the reference.

    If the estimates do not have equal stamps, stamps within `tolerance`, s, count as equal. `statistics` are those of
    all errors if already computed.
    """
    known = statistics or {}
    chosen = rankable({name: len(t) for name, t in stamps.items()})
    at = common_stamps({name: stamps[name] for name in chosen}, tolerance)
    at = {name: index for name, index in at.items() if len(index)}
    there = {name: errors[name][index] for name, index in at.items()}
    common = {
        name: known[name] if name in known and len(error) == len(errors[name]) else spread(error, seed)
        for name, error in there.items()
    }
    order = sorted(common, key=lambda name: common[name]["rmse"].value)
    rivals = [name for name in order if name not in by_products]
    return Ranking(
        at={name: at[name] for name in order},
        common={name: common[name] for name in order},
        behind={name: rmse_difference(there[name], there[rivals[0]], seed=seed) for name in rivals[1:]},
        rivals=tuple(rivals),
        same=all(len(at.get(name, ())) == len(t) for name, t in stamps.items()),
    )
