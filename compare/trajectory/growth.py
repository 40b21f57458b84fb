"""How the difference from the reference grows along the path, and when it passes a bound."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from fgbaseline.geometry import InputError

from ..statistics.descriptive import summarised
from .association import Matched
from .divergence import pose_errors

PARTS = 10


def growing_divergence(matched: Matched, up: ArrayLike = (0.0, 0.0, 1.0)) -> pd.DataFrame:
    """What `pose_errors` says of each matched pose, with `t` (s) and, of the path so far, `percent_of_path`:

    the position difference per metre travelled, %; NaN before the reference has moved. As aligned as `matched` is: for
    the growth from a common start that is `none` or `first-pose`.
    """
    table = pose_errors(matched.estimate.world_T_body, matched.reference.world_T_body, up)
    moved = table["travelled"].where(table["travelled"] > 0)
    return table.assign(t=matched.reference.t, percent_of_path=100.0 * table["position"] / moved)


def growth_by_part(table: pd.DataFrame, parts: int = PARTS) -> pd.DataFrame:
    """The path of a `growing_divergence` table in `parts` pieces of equal length, one row each:

    `from_m`, `to_m`, `frames` in it, `rmse` of the position difference (m), `per_metre` (m/m) and `per_frame` (m) by
    how much the difference grew from the piece's first pose to the next one's, `heading_deg` at its end. A piece
    without a pose has NaN. Raises InputError where the reference does not move.
    """
    travelled = table["travelled"].to_numpy()
    if parts < 1 or not travelled[-1] > 0:
        raise InputError("growth: a path that stands still cannot be split by length, nor one into fewer than 1 part")
    edges = np.linspace(0.0, travelled[-1], parts + 1)
    first = np.searchsorted(travelled, edges[:-1], side="left")
    last = np.append(first[1:], len(travelled) - 1)
    position = table["position"].to_numpy()
    frames = last - first
    frames[-1] += 1
    end = np.append(first[1:], len(travelled))
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = position[last] - position[first]
        return pd.DataFrame(
            {
                "from_m": edges[:-1],
                "to_m": edges[1:],
                "frames": frames,
                "rmse": [summarised(position[a:b])["rmse"] for a, b in zip(first, end, strict=True)],
                "per_metre": grown / (travelled[last] - travelled[first]),
                "per_frame": grown / (last - first),
                "heading_deg": table["heading_deg"].to_numpy()[last],
            }
        ).rename_axis("part")


@dataclass(frozen=True, slots=True)
class Passing:
    """The first time that a difference is beyond a bound."""

    frame: int
    t: float
    """s"""
    travelled: float
    """m"""
    value: float


def first_beyond(table: pd.DataFrame, bound: float, column: str = "position") -> Passing | None:
    """Where the size of a column of a `growing_divergence` table first exceeds a bound; None where it never does."""
    beyond = np.flatnonzero(np.abs(table[column].to_numpy()) > bound)
    if len(beyond) == 0:
        return None
    row = table.iloc[beyond[0]]
    return Passing(int(table.index[beyond[0]]), float(row["t"]), float(row["travelled"]), float(row[column]))
