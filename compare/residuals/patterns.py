"""Where reprojection errors come from: by distance, by how long a track has lasted, by place in the image, by side."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from pandas.api.typing import SeriesGroupBy

from fgbaseline.data import Sequence
from fgbaseline.data.observations import IntArray

from ..landmarks.map_difference import DEPTHS, depth_classes

AGES = (1, 2, 4, 7, 13, 26)
"""sights from which on a class of track age begins"""
DISTANCE, AGE, REGION, SIDE = "distance", "track age", "region", "side"
ROWS, COLUMNS = ("top", "middle", "bottom"), ("left", "middle", "right")


def residual_patterns(sequence: Sequence, table: pd.DataFrame) -> pd.DataFrame:
    """Residuals of a reprojection table in classes, one row per class that has any, with the columns

    `by` (distance, track age, region, side), `of` (the class), `n`, `median`, `mean` and `p95` of the error in px, and
    the mean residuals `u` and `v` (over both cameras) in px: a mean that is not zero is a bias of that class.
    `distance` is the depth in front of the left camera, `track age` counts the sights of the track in the recording,
    `region` is the ninth of the left image (as far as there are observations), and `side` compares the left camera's
    error, the norm of uL and vL, with the right one's. Observations behind the camera are in no class of distance.
    """
    u, v = 0.5 * (table["uL"] + table["uR"]), 0.5 * (table["vL"] + table["vR"])
    both = pd.DataFrame({"error": table["error"], "u": u, "v": v})
    age = _age(sequence)[table["observation"].to_numpy()]
    parts = [
        _classified(both, DISTANCE, _classes_of(table["depth"].to_numpy(), DEPTHS), depth_classes()),
        _classified(both, AGE, _classes_of(age, (*AGES, np.inf)), _ages()),
        _classified(both, REGION, _region(sequence, table), [f"{row} {column}" for row in ROWS for column in COLUMNS]),
    ]
    for side, name in (("L", "left camera"), ("R", "right camera")):
        u, v = table[f"u{side}"], table[f"v{side}"]
        one = pd.DataFrame({"error": np.hypot(u, v), "u": u, "v": v})
        parts.append(_classified(one, SIDE, np.zeros(len(one), dtype=np.int64), [name]))
    return pd.concat(parts, ignore_index=True)


def _classified(values: pd.DataFrame, by: str, code: IntArray, names: list[str]) -> pd.DataFrame:
    """Statistics of the rows of each class; those with a code that has no name are in none."""
    named = (code >= 0) & (code < len(names))
    groups = values[named].groupby(code[named])
    error = groups["error"]
    result = pd.DataFrame(
        {
            "n": groups.size(),
            "median": error.median(),
            "mean": error.mean(),
            "p95": _p95(error),
            "u": groups["u"].mean(),
            "v": groups["v"].mean(),
        }
    )
    result.insert(0, "of", [names[i] for i in result.index])
    result.insert(0, "by", by)
    return result


def _p95(errors: "SeriesGroupBy[Any, Any]") -> "pd.Series[float]":
    """The 95 % quantile; infinite, not NaN, where it lies between a finite error and an infinite one."""
    above = errors.quantile(0.95, interpolation="higher")
    return above.where(np.isinf(above), errors.quantile(0.95))


def _classes_of(values: ArrayLike, edges: tuple[float, ...]) -> IntArray:
    """(n,) the class from its lower edge on up to the next; -1 below the first, and for NaN."""
    v = np.asarray(values, dtype=np.float64)
    return np.where(np.isnan(v), -1, np.searchsorted(edges, v, side="right") - 1).astype(np.int64)


def _age(sequence: Sequence) -> IntArray:
    """(n,) which sight of its track each observation of the sequence is, 1 for the first."""
    o = sequence.observations
    order = o.by_track()
    landmark = o.landmark[order]
    age = np.empty(len(o), dtype=np.int64)
    age[order] = np.arange(len(o)) - np.searchsorted(landmark, landmark) + 1
    return age


def _region(sequence: Sequence, table: pd.DataFrame) -> IntArray:
    """(n,) the ninth of the left image, row by row, between the outermost observations."""
    pixel = sequence.observations.pixel[:, :2]
    if len(pixel) == 0:
        return np.empty(0, dtype=np.int64)
    low, high = pixel.min(axis=0), pixel.max(axis=0)
    share = (pixel[table["observation"].to_numpy()] - low) / np.maximum(high - low, 1e-9)
    third = np.minimum((3.0 * share).astype(np.int64), 2)
    return np.asarray(3 * third[:, 1] + third[:, 0], dtype=np.int64)


def _ages() -> list[str]:
    last = [*(after - 1 for after in AGES[1:]), None]
    return [
        f"{low} and more" if high is None else str(low) if low == high else f"{low} to {high}"
        for low, high in zip(AGES, last, strict=True)
    ]
