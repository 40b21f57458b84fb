"""Which estimate is nearest to the reference, over the moments that all have, and whether that is settled."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.compare import RmseDifference
from fgbaseline.data.observations import IntArray

from .spreading import spread


@dataclass(frozen=True, eq=False, slots=True)
class Ranking:
    """The errors of positions over the moments that all estimates have which take part: see `compare.taking_part`."""

    at: dict[str, IntArray]
    """by name, nearest first: which of its own pairs of poses are of these moments"""
    common: dict[str, pd.DataFrame]
    """the statistics over them, in the same order: see `compare.error_statistics`"""
    behind: dict[str, RmseDifference]
    """by how much each rival is farther from the reference than the nearest; that one is missing"""
    rivals: tuple[str, ...]
    """nearest first: those that the reference's own run did not give along"""
    same: bool
    """whether these are all the moments of every estimate"""

    @property
    def moments(self) -> int:
        """How many moments there are; 0 where no two estimates can be ranked."""
        return len(next(iter(self.at.values()), ()))

    def rmse(self, name: str) -> float:
        """Of the positions over the common moments, m."""
        return float(self.common[name]["value"]["rmse"])

    def rank(self, name: str) -> int | None:
        """From 1; None for what takes no part, and for by-products of the reference."""
        return self.rivals.index(name) + 1 if name in self.rivals else None


def ranking_of(
    errors: Mapping[str, "pd.Series[float]"],
    stamps: Mapping[str, np.ndarray],
    tolerance: float,
    by_products: frozenset[str],
    seed: int,
) -> Ranking:
    """All estimates by the RMSE of their `errors` (n,) at rising `stamps` (n,) of the reference.

    Stamps within `tolerance` (s) are one moment where the estimates do not have the same ones.
    """
    chosen = compare.taking_part({name: len(t) for name, t in stamps.items()})
    at = compare.common_moments({name: stamps[name] for name in chosen}, tolerance)
    at = {name: index for name, index in at.items() if len(index)}
    there = {name: errors[name].iloc[index] for name, index in at.items()}
    common = {name: spread(error, seed) for name, error in there.items()}
    order = sorted(common, key=lambda name: float(common[name]["value"]["rmse"]))
    rivals = [name for name in order if name not in by_products]
    values = {name: there[name].to_numpy() for name in order}
    return Ranking(
        at={name: at[name] for name in order},
        common={name: common[name] for name in order},
        behind={name: compare.rmse_difference(values[name], values[rivals[0]], seed=seed) for name in rivals[1:]},
        rivals=tuple(rivals),
        same=all(len(at.get(name, ())) == len(t) for name, t in stamps.items()),
    )
