"""Statistics of a bench: cases (sequence and settings) by estimators, averaged over seeds; rankings; consistency."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.compare.limits import Better

from ..results.bench import ANSWERED, Results
from .table import Column


@dataclass(frozen=True, slots=True)
class Metric(Column):
    """A figure of a run's summary, and its column."""

    name: str = ""
    """in the CSV tables"""
    ranked: bool = False
    """whether it measures accuracy"""
    most: float = np.inf


METRICS = (
    Metric("error to truth", unit="m", path=("ate_common", "rmse"), name="ate", ranked=True, better=Better.LOWER),
    Metric("held-out error", unit="px", path=("held_out", "median"), name="held_out", ranked=True, better=Better.LOWER),
    Metric("from the reference", unit="m", path=("divergence_common", "rmse"), name="divergence", better=Better.LOWER),
    Metric("reprojection", unit="px", path=("reprojection", "median"), name="reprojection", better=Better.LOWER),
    Metric(
        "reprojection of common",
        unit="px",
        path=("reprojection_common", "median"),
        name="reprojection_common",
        better=Better.LOWER,
    ),
    Metric(
        "under 3 px", unit="share", path=("reprojection", "under_3px"), name="under_3px", most=1.0, better=Better.HIGHER
    ),
    Metric("NEES", unit="", path=("nees", "mean"), name="nees"),
    Metric("NEES from the reference", unit="", path=("nees_reference", "median"), name="nees_reference"),
    Metric("coverage", unit="share", path=("coverage",), name="coverage", most=1.0),
    Metric("matches used", unit="share", path=("observations", "share"), name="used", most=1.0),
)


def cases(results: Results) -> pd.DataFrame:
    """One row per case and estimator: runs, how many failed, and each metric's mean over seeds, `_low` and `_high`.

    Intervals are cut where a metric has no values: below zero, and of shares above one.
    """
    rows: list[dict[str, Any]] = []
    for case, estimator, group in _groups(results):
        row: dict[str, Any] = {
            "case": case,
            "estimator": estimator,
            "runs": len(group),
            "failed": int((~group["status"].isin(ANSWERED)).sum()),
            "trust": _least(group["trust"]),
        }
        for metric in METRICS:
            mean = compare.mean_interval(group[metric.name].to_numpy(dtype=np.float64))
            low, high = max(mean.low, 0.0), min(mean.high, metric.most)
            row |= {metric.name: mean.value, f"{metric.name}_low": low, f"{metric.name}_high": high}
        rows.append(row)
    table = pd.DataFrame(rows)
    empty = [name for name in table if name not in ("case", "estimator", "trust") and table[name].isna().all()]
    return table.drop(columns=empty)


def rankings(results: Results) -> pd.DataFrame:
    """Estimators ranked in every case by each metric of accuracy: see `compare.monte_carlo_ranking`."""
    parts = []
    for case in results.cases:
        for metric in (metric for metric in METRICS if metric.ranked):
            of_case = results.runs[results.runs["case"] == case]
            ranked = compare.monte_carlo_ranking(_wide(of_case, metric.name, results.estimators)).reset_index()
            if len(ranked):
                ranked["low"] = ranked["low"].clip(lower=0.0)
                ranked.insert(0, "metric", metric.name)
                ranked.insert(0, "case", case)
                parts.append(ranked)
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def overall(results: Results) -> pd.DataFrame:
    """The mean rank of each estimator over all cases, and its interval; empty where there is but one case.

    A case counts once, however many seeds it has. An estimator without an answer in a case comes last there.
    """
    ranked = rankings(results)
    parts = []
    for metric in dict.fromkeys(ranked["metric"]) if len(ranked) else ():
        of_metric = ranked[ranked["metric"] == metric].pivot_table(index="case", columns="estimator", values="rank")
        places = of_metric.reindex(columns=results.estimators).fillna(len(results.estimators))
        if len(places) < 2:
            continue
        means = {name: compare.mean_interval(places[name].to_numpy(dtype=np.float64)) for name in places}
        rows = [
            {
                "metric": metric,
                "estimator": name,
                "cases": mean.n,
                "mean_rank": mean.value,
                "low": max(mean.low, 1.0),
                "high": min(mean.high, float(len(means))),
                "first": int((places[name] == 1).sum()),
            }
            for name, mean in sorted(means.items(), key=lambda item: item[1].value)
        ]
        parts += rows
    return pd.DataFrame(parts)


def consistency(results: Results) -> pd.DataFrame:
    """ANEES of each estimator over the runs of a case that has truth, with chi-square bounds and verdict."""
    rows = []
    for case in results.cases:
        for name in results.estimators:
            columns = results.nees.get((case, name))
            if columns is None:
                continue
            found = compare.anees_summary(columns)
            rows.append({"case": case, "estimator": name, **found._asdict(), "verdict": _judged(found)})
    return pd.DataFrame(rows)


def nees_over_time(results: Results) -> pd.DataFrame:
    """ANEES frame by frame of each case and estimator, with its bounds: see `compare.average_nees`."""
    parts = []
    for (case, name), columns in results.nees.items():
        table = compare.average_nees(columns).reset_index()
        table.insert(0, "estimator", name)
        table.insert(0, "case", case)
        parts.append(table)
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def costs(results: Results) -> pd.DataFrame:
    """One row per case and estimator: seconds (mean over seeds, interval), ms a frame and the largest peak memory."""
    rows = []
    for (case, estimator), group in results.costs.groupby(["case", "estimator"], sort=False):
        seconds = compare.mean_interval(group["seconds"].to_numpy(dtype=np.float64))
        rows.append(
            {
                "case": case,
                "estimator": estimator,
                "seconds": seconds.value,
                "seconds_low": seconds.low,
                "seconds_high": seconds.high,
                "ms_per_frame": 1e3 * float((group["seconds"] / group["frames"]).mean()),
                "memory_mb": float(group["memory_mb"].astype(np.float64).max()),
            }
        )
    return pd.DataFrame(
        rows,
        columns=["case", "estimator", "seconds", "seconds_low", "seconds_high", "ms_per_frame", "memory_mb"],
    )


def judge(results: Results) -> Metric | None:
    """The metric of accuracy: error to truth, else that on held-out tracks, else none."""
    ranked = (metric for metric in METRICS if metric.ranked)
    return next((metric for metric in ranked if results.runs[metric.name].notna().any()), None)


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows, by column."""
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def _groups(results: Results) -> Iterator[tuple[str, str, pd.DataFrame]]:
    for case in results.cases:
        of_case = results.runs[results.runs["case"] == case]
        for name in results.estimators:
            group = of_case[of_case["estimator"] == name]
            if len(group):
                yield case, name, group


def _wide(runs: pd.DataFrame, metric: str, estimators: list[str]) -> pd.DataFrame:
    return runs.set_index(["run", "estimator"])[metric].unstack("estimator").reindex(columns=estimators)  # noqa: PD010


def _least(trust: pd.Series) -> str:
    """The worst trust in the references of several runs."""
    found = set(trust.dropna())
    return next((word for word in ("untrusted", "doubtful", "trusted") if word in found), "")


def _judged(found: compare.AneesSummary) -> str:
    if not np.isfinite(found.anees):
        return ""
    if found.anees > found.high:
        return "too sure"
    return "too cautious" if found.anees < found.low else "consistent"
