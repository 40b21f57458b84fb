"""Values of a comparison as `comparison.json` and `metrics.csv` hold them."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fgbaseline import compare
from fgbaseline.compare import SegmentErrors
from fgbaseline.compare.column_tables import Columns
from fgbaseline.compare.statistics.block_bootstrap import Bounded, ErrorStatistics
from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.sample_sizes import coverage, samples
from fgbaseline.geometry.path_length import path_length

from .json_files import INFINITE, finite, nulls

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.trajectory_comparison.reported_covariance import ReportedCovariance
    from fgbaseline.compare.trajectory_comparison.reprojection import Pixels

    from .comparison import Summary

WITH_INTERVAL = ("rmse", "mean", "median", "std", "p95")


def results_by_name(comparison: Comparison) -> dict[str, dict[str, Any]]:
    """Values of the reference and of every estimate, as JSON has them: None for what is not finite."""
    estimates = {name: _estimate(comparison, result) for name, result in comparison.results.items()}
    return {name: finite(of) for name, of in {comparison.reference.name: _reference(comparison), **estimates}.items()}


def summarize(comparison: Comparison, results: dict[str, dict[str, Any]], caption: str) -> "Summary":
    """The summary of `results_by_name`; `notes` has the reasons for missing parts."""
    from .comparison import Summary
    from .provenance import versions

    reference, estimates = results[comparison.reference.name], {name: results[name] for name in comparison.results}
    return Summary.model_validate(
        finite(
            {
                "caption": caption,
                "reference": reference,
                "estimates": estimates,
                "up": {"direction": comparison.up.tolist(), "source": comparison.up_from},
                "sequence": None if comparison.sequence is None else comparison.sequence.name,
                "settings": comparison.settings.record(),
                "versions": versions(),
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
        "path_m": path_length(path.position),
        "trust": None if trust is None else trust.verdict.name.lower(),
        "reasons": [] if trust is None else list(trust.reasons),
        "remarks": list(comparison.reference.remarks),
        **_pixels(comparison.reference_pixels),
        "held_out": _held_out(comparison, path.name),
    }


def _estimate(comparison: Comparison, result: Result) -> dict[str, Any]:
    matched, motion, reported = result.matched, result.matched.alignment, result.reported_covariance
    common, behind = comparison.ranking.common.get(result.name), comparison.behind.get(result.name)
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
        "drift": None if result.drift is None else {name: rate._asdict() for name, rate in result.drift.items()},
        "nees": None if reported is None else _nees(reported),
        "shares": {
            **{name: share for name, share in asdict(result.shares).items() if name != "rms"},
            "intervals": _bounded(result.share_intervals.by_name),
            "reliable": result.share_intervals.reliable,
        },
        "common": None if common is None else {"moments": comparison.ranking.moments, "rmse": common["rmse"]._asdict()},
        "behind": None if behind is None else asdict(behind),
        "final_m": float(result.divergence["position"][-1]),
        "passing": {
            "bound_m": result.bound,
            "t": None if result.passing is None else result.passing.t,
            "traveled_m": None if result.passing is None else result.passing.traveled,
        },
        **_pixels(result.pixels),
        "map": None if result.map is None else _map(result.map),
        "held_out": _held_out(comparison, result.name),
        "samples": samples(comparison, result),
        "notes": result.notes,
    }
    infinite = {path: INFINITE for path, is_infinite in nulls(values) if is_infinite}
    return {**values, "notes": result.notes | infinite}


def _statistics(of: ErrorStatistics) -> dict[str, Any]:
    return {
        **{name: of[name]._asdict() for name in WITH_INTERVAL},
        **{name: of[name].value for name in ("min", "max", "sse")},
        **{"n": int(of["n"].value), "missing": of.missing, "block": of.block, "reliable": of.reliable},
    }


def _bounded(figures: Mapping[str, Bounded]) -> dict[str, dict[str, float]]:
    return {name: figure._asdict() for name, figure in figures.items()}


def _records(columns: Columns) -> list[dict[str, Any]]:
    """A mapping for each row."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _segments(segments: SegmentErrors, seed: int) -> dict[str, Any]:
    return {
        "translation_percent": segments.translation_percent,
        "rotation_deg_per_m": segments.rotation_deg_per_m,
        "intervals": _bounded(segments.means(seed)),
        "official": segments.official,
        "by_length": _records(segments.means_by_length),
    }


def _map(table: "pd.DataFrame") -> dict[str, Any]:
    by_depth = compare.map_by_depth(table)[["n", "distance", "seen"]]
    return {
        "n": len(table),
        "median": float(table["distance"].median()),
        "p95": compare.summarized(table["distance"])["p95"],
        "median_seen": float(table["seen"].median()),
        "by_depth": by_depth.rename_axis("depth").reset_index().astype({"depth": str}).to_dict(orient="records"),
    }


def _nees(reported: "ReportedCovariance") -> dict[str, float | int]:
    summary = compare.nees_summary(reported.nees)
    kept = {name: summary[name] for name in ("mean", "median", "frames")}
    return {**kept, "not_positive_definite": reported.not_positive_definite}


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


def _pixels(pixels: "Pixels | None") -> dict[str, Any]:
    if pixels is None:
        return dict.fromkeys(("reprojection", "reprojection_common", "reprojection_along"))
    return {key: None if t is None else compare.reprojection_summary(t) for key, t in pixels.tables.items()}
