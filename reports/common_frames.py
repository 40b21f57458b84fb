"""The frames that the estimators of a run have in common: who is nearer can only be asked of these."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray


@dataclass(frozen=True, slots=True)
class CommonRmse:
    """The RMSE of positions over the frames that all estimators have which take part."""

    rmse: float
    """m"""
    frames: int


def known(table: pd.DataFrame) -> BoolArray:
    """(T,) the frames for which a table of `compare.pose_errors` has a position."""
    return np.asarray(table["position"].notna(), dtype=np.bool_)


def common_rmse(tables: Mapping[str, pd.DataFrame]) -> dict[str, CommonRmse]:
    """By name the RMSE over the frames that all tables of `compare.pose_errors` have; empty without such a frame.

    An estimator with far fewer frames than the others takes no part: see `compare.rankable`.
    """
    there = {name: known(table) for name, table in tables.items()}
    names = compare.rankable({name: int(frames.sum()) for name, frames in there.items()})
    if not names:
        return {}
    common = np.logical_and.reduce([there[name] for name in names])
    n = int(common.sum())
    errors = {name: tables[name]["position"].to_numpy(dtype=np.float64)[common] for name in names}
    return {name: CommonRmse(compare.summarized(errors[name])["rmse"], n) for name in names} if n else {}


def same_frames(frames: Iterable[BoolArray]) -> bool:
    """Whether all of them are the same (T,)."""
    every = list(frames)
    return all(np.array_equal(every[0], other) for other in every[1:])


def share_of_time(t: FloatArray, frames: BoolArray) -> float:
    """The share of the recording's time in which there are these frames (T,): see `compare.time_coverage`."""
    return compare.time_coverage(t[frames], t)
