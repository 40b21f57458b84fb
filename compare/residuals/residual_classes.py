"""Residual patterns: reprojection errors by depth, track age, image region and camera."""

from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from pandas.api.typing import SeriesGroupBy

from fgbaseline.data import Sequence
from fgbaseline.data.observations import IntArray

DEPTHS = (0.0, 5.0, 10.0, 20.0, 40.0, 80.0, np.inf)
"""m, edges of the depth classes"""
AGES = (1, 2, 4, 7, 13, 26)
"""first observation of each class of track age"""
DISTANCE, AGE, REGION, SIDE = "distance", "track age", "image region", "camera"
REGION_ROWS, REGION_COLUMNS = ("top", "middle", "bottom"), ("left", "center", "right")


def residual_patterns(sequence: Sequence, table: pd.DataFrame) -> pd.DataFrame:
    """Residuals of a reprojection table by classes, one row per non-empty class.

    Columns: `by`, the kind of class; `of`, the class; `n`; `median`, `mean` and `p95` of the error, px; and the bias of
    the class, the median residuals `u` and `v` over both cameras, px. Kinds: `distance`, the depth in front of the left
    camera (no class behind it); `track age`, the number of observations of the track so far; `image region`, the ninth
    of the bounding box of the observations in the left image; `camera`, where the error of the left camera is the norm
    of uL and vL, and that of the right one of uR and vR.
    """
    u, v = table["uL"], table["vL"]
    if not sequence.monocular:
        u, v = 0.5 * (u + table["uR"]), 0.5 * (v + table["vR"])
    both = pd.DataFrame({"error": table["error"], "u": u, "v": v})
    age = _age(sequence)[table["observation"].to_numpy()]
    parts = [
        _classified(both, DISTANCE, _classes_of(table["depth"].to_numpy(), DEPTHS), depth_classes()),
        _classified(both, AGE, _classes_of(age, (*AGES, np.inf)), _ages()),
        _classified(
            both,
            REGION,
            _region(sequence, table),
            [f"{row} {column}" for row in REGION_ROWS for column in REGION_COLUMNS],
        ),
    ]
    for side, name in (("L", "left camera"), ("R", "right camera")):
        if side == "R" and sequence.monocular:
            continue
        u, v = table[f"u{side}"], table[f"v{side}"]
        one = pd.DataFrame({"error": np.hypot(u, v), "u": u, "v": v})
        parts.append(_classified(one, SIDE, np.zeros(len(one), dtype=np.int64), [name]))
    return pd.concat(parts, ignore_index=True)


def depth_classes() -> list[str]:
    """Names of the depth classes in tables."""
    return [f"{low:g} to {high:g} m" if np.isfinite(high) else f"{low:g} m and more" for low, high in pairwise(DEPTHS)]


def _classified(values: pd.DataFrame, by: str, code: IntArray, names: list[str]) -> pd.DataFrame:
    """Statistics of the rows of each class; rows whose code has no name are left out."""
    named = (code >= 0) & (code < len(names))
    groups = values[named].groupby(code[named])
    error = groups["error"]
    result = pd.DataFrame(
        {
            "n": groups.size(),
            "median": error.median(),
            "mean": error.mean(),
            "p95": _p95(error),
            "u": groups["u"].median(),
            "v": groups["v"].median(),
        }
    )
    result.insert(0, "of", [names[i] for i in result.index])
    result.insert(0, "by", by)
    return result


def _p95(errors: "SeriesGroupBy[Any, Any]") -> "pd.Series[float]":
    """95th percentile; infinite, not NaN, between a finite error and an infinite one."""
    above = errors.quantile(0.95, interpolation="higher")
    return above.where(np.isinf(above), errors.quantile(0.95))


def _classes_of(values: ArrayLike, edges: tuple[float, ...]) -> IntArray:
    """Class (n,) of each value, from its lower edge up to the next; -1 below the first, and for NaN."""
    v = np.asarray(values, dtype=np.float64)
    return np.where(np.isnan(v), -1, np.searchsorted(edges, v, side="right") - 1).astype(np.int64)


def _age(sequence: Sequence) -> IntArray:
    """Ordinal number (n,) of each observation in its track, 1 for the first."""
    o = sequence.observations
    order = o.by_track()
    landmark = o.landmark[order]
    age = np.empty(len(o), dtype=np.int64)
    age[order] = np.arange(len(o)) - np.searchsorted(landmark, landmark) + 1
    return age


def _region(sequence: Sequence, table: pd.DataFrame) -> IntArray:
    """Ninth (n,) of the left image, row by row, within the bounding box of the observations."""
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
