"""All figures of a comparison, as `comparison.json` and `metrics.csv` hold them."""

import math
import platform
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.compare import SegmentErrors
from fgbaseline.compare.travel import distance_travelled

from ..json_numbers import finite, nulls
from ..schema_base import INFINITE
from .claimed import Claimed
from .comparison import Comparison, Result
from .pixels import Pixels
from .samples import coverage, samples
from .schema import Summary

LIBRARIES = ("fgbaseline", "numpy", "pandas", "scipy")
WITH_INTERVAL = ("rmse", "mean", "median", "std", "p95")


def summarise(comparison: Comparison) -> Summary:
    """The summary; what is not a number is None, and where a part is missing `notes` says why."""
    return Summary.model_validate(
        finite(
            {
                "caption": comparison.caption,
                "reference": _reference(comparison),
                "estimates": {name: _estimate(comparison, result) for name, result in comparison.results.items()},
                "up": {"direction": comparison.up.tolist(), "source": comparison.up_from},
                "sequence": comparison.sequence,
                "settings": comparison.settings.record(),
                "versions": {"python": platform.python_version(), **{name: version(name) for name in LIBRARIES}},
            }
        )
    )


def _reference(comparison: Comparison) -> dict[str, Any]:
    path, trust = comparison.reference.trajectory, comparison.reference.trust
    return {
        "name": path.name,
        "source": path.source,
        "poses": len(path),
        "duration_s": float(path.t[-1] - path.t[0]) if path.stamped else None,
        "path_m": float(distance_travelled(path.position)[-1]),
        "trust": None if trust is None else trust.verdict.name.lower(),
        "reasons": [] if trust is None else list(trust.reasons),
        "remarks": list(comparison.reference.remarks),
        **_pixels(comparison.reference_pixels),
        "held_out": _held_out(comparison, path.name),
    }


def _estimate(comparison: Comparison, result: Result) -> dict[str, Any]:
    matched, motion = result.matched, result.matched.alignment
    values = {
        "source": result.entry.trajectory.source,
        "poses": len(result.entry.trajectory),
        "coverage": coverage(comparison, result),
        "rank": comparison.ranking.rank(result.name),
        "caption": matched.caption,
        "remarks": list(result.entry.remarks),
        "pairing": {
            "pairs": len(matched),
            "association": str(matched.association),
            "tolerance_s": matched.tolerance,
            "offset_s": matched.offset,
            "offset_range_s": None if result.offset is None else (result.offset.low, result.offset.high),
            "offset_determined": None if result.offset is None else result.offset.determined,
            "left_out_reference": matched.left_out_reference,
            "left_out_estimate": matched.left_out_estimate,
        },
        "alignment": {
            "kind": str(motion.kind),
            "rotation": motion.rotation.tolist(),
            "translation": motion.translation.tolist(),
            "scale": float(motion.scale),
            "poses": motion.n,
            "free": list(motion.free),
        },
        **{name: _statistics(table) for name, table in result.statistics.items()},
        "relative": {
            delta: {name: _statistics(table) for name, table in tables.items()}
            for delta, tables in result.relative_statistics.items()
        },
        "segments": None if result.segments is None else _segments(result.segments, comparison.settings.seed),
        "drift": None if result.drift is None else result.drift.to_dict(orient="index"),
        "nees": None if result.claimed is None else _nees(result.claimed),
        "shares": {
            name: getattr(result.shares, name)
            for name in ("scale", "heading", "noise", "scale_percent", "heading_deg", "heading_deg_per_s")
        }
        | {
            "intervals": result.share_intervals.to_dict(orient="index"),
            "reliable": bool(result.share_intervals.attrs["reliable"]),
        },
        "common": _common(comparison, result.name),
        "behind": _behind(comparison, result.name),
        "final_m": float(result.departure["position"].iloc[-1]),
        "passing": {
            "bound_m": result.bound,
            "t": None if result.passing is None else result.passing.t,
            "travelled_m": None if result.passing is None else result.passing.travelled,
        },
        **_pixels(result.pixels),
        "map": None if result.map is None else _map(result.map),
        "held_out": _held_out(comparison, result.name),
        "samples": samples(comparison, result),
        "notes": result.notes,
    }
    infinite = {path: INFINITE for path, is_infinite in nulls(values) if is_infinite}
    return {**values, "notes": result.notes | infinite}


def _statistics(table: pd.DataFrame) -> dict[str, Any]:
    values = table["value"]
    return {
        **{name: table.loc[name, ["value", "low", "high"]].to_dict() for name in WITH_INTERVAL},
        **{name: float(values[name]) for name in ("min", "max", "sse")},
        "n": int(values["n"]),
        "missing": int(table.attrs["missing"]),
        "block": int(table.attrs["block"]),
        "reliable": bool(table.attrs["reliable"]),
    }


def _segments(segments: SegmentErrors, seed: int) -> dict[str, Any]:
    return {
        "translation_percent": segments.translation_percent,
        "rotation_deg_per_m": segments.rotation_deg_per_m,
        "intervals": segments.intervals(seed).to_dict(orient="index"),
        "official": segments.official,
        "by_length": segments.by_length.reset_index().to_dict(orient="records"),
    }


def _common(comparison: Comparison, name: str) -> dict[str, Any] | None:
    statistics = comparison.ranking.common.get(name)
    if statistics is None:
        return None
    rmse = statistics.loc["rmse", ["value", "low", "high"]].to_dict()
    return {"moments": comparison.ranking.moments, "rmse": rmse}


def _behind(comparison: Comparison, name: str) -> dict[str, Any] | None:
    d = comparison.behind.get(name)
    if d is None:
        return None
    return {"value": d.value, "low": d.low, "high": d.high, "block": d.block, "reliable": d.reliable}


def _map(table: pd.DataFrame) -> dict[str, Any]:
    by_depth = compare.map_by_depth(table)[["n", "distance", "seen"]]
    return {
        "n": len(table),
        "median": float(table["distance"].median()),
        "p95": compare.summarised(table["distance"])["p95"],
        "median_seen": float(table["seen"].median()),
        "by_depth": by_depth.rename_axis("depth").reset_index().astype({"depth": str}).to_dict(orient="records"),
    }


def _nees(claimed: Claimed) -> dict[str, float | int]:
    known = claimed.nees[~np.isnan(claimed.nees)]
    mean, median = (float(np.mean(known)), float(np.median(known))) if len(known) else (math.nan, math.nan)
    return {
        "mean": mean,
        "median": median,
        "frames": len(known),
        "not_positive_definite": claimed.not_positive_definite,
    }


def _held_out(comparison: Comparison, name: str) -> dict[str, Any] | None:
    if comparison.held_out is None or name not in comparison.held_out.index:
        return None
    row = comparison.held_out.to_dict(orient="index")[name]
    return {
        "median": {"value": row["median"], "low": row["low"], "high": row["high"]},
        "behind": {"value": row["behind"], "low": row["behind_low"], "high": row["behind_high"]},
        "p95": row["p95"],
        "under_3px": row["under_3px"],
    }


def _pixels(pixels: Pixels | None) -> dict[str, Any]:
    tables = {} if pixels is None else {"": pixels.own, "_common": pixels.common, "_along": pixels.along}
    return {f"reprojection{kind}": _reprojection(tables.get(kind)) for kind in ("", "_common", "_along")}


def _reprojection(table: pd.DataFrame | None) -> dict[str, Any] | None:
    return None if table is None else compare.reprojection_summary(table)
