"""Sentences and captions of a bench: failures first, then accuracy with its uncertainty, then consistency."""

from math import isfinite
from typing import Any

import pandas as pd

from fgbaseline.compare.estimate_comparison import SAME_GRAPH
from fgbaseline.data.wording import plural

from ..formatting import interval, listed, number
from ..results.bench import ANSWERED, BENCH_METRICS, Results, consistency, judge, overall, rankings, records
from ..results.metric_record import Metric
from .evidence import MEANING, WITHIN

MOST_CASES = 10
"""number of cases up to which each has a sentence"""
TABLE = (
    "Means over the runs of a case. ATE, divergence and held-out error have 95 % intervals over several runs "
    "(Student's t). ATE: RMSE after SE(3) alignment to the ground truth. Divergence: RMSE from the reference of each "
    "run. Both are over the frames that all estimators of a run have. Coverage: share of the time with poses. "
    "Reprojection: median over all observations; 'of common': over those that every estimator used. "
    "ANEES: 6 is consistent; ↑ marks overconfident and ↓ conservative estimators (chi-square, 95 %). Bold: best of a "
    "case."
)
FIGURES = {
    "accuracy": "One mark per estimator. Line: 95 % interval of the mean, where there are several seeds.",
    "accuracy_against_time": "Time of an estimator per frame, on this machine, with the other workers running.",
    "scaling": "One mark per run. Dashed: the power of n that fits best, where sizes differ enough. Memory: peak of "
    "the whole process during an estimator, with about 200 MB of libraries.",
    "nees_": "NEES of each frame, averaged over the runs. Band: 95 % of the frames of a consistent estimator. Errors "
    "of consecutive frames are correlated, so a curve stays outside the band for a while.",
}
"""captions by the beginning of a figure's name"""


def sentences(results: Results) -> list[str]:
    """The verdict."""
    return [*_failures(results), *_trust(results), *_best(results), *_overall(results), *_consistency(results)]


def _failures(results: Results) -> list[str]:
    n = len(results.planned)
    text = []
    if results.failures:
        text.append(f"{len(results.failures)} of {plural(n, 'run')} failed; the reasons are below.")
    failed = results.runs[
        ~results.runs["status"].isin(ANSWERED) & ~results.runs["run"].isin(list(results.failures))
    ].groupby("estimator", sort=False)
    text += [f"{name} failed in {len(rows)} of {plural(n, 'run')}." for name, rows in failed]
    return text


def _trust(results: Results) -> list[str]:
    counts = results.runs.drop_duplicates("run")["trust"].value_counts().to_dict()
    return [
        f"The reference is {word} in {counts[word]} of {plural(len(results.planned), 'run')}: {MEANING[word]}."
        for word in ("untrusted", "doubtful")
        if word in counts
    ]


def _best(results: Results) -> list[str]:
    """The most accurate estimator of each case, by ground truth, else by held-out tracks."""
    ranked = rankings(results)
    if ranked.empty:
        return ["Estimators are not ranked by accuracy: no run has ground truth or held-out tracks."]
    of_case = {str(case): table for case, table in ranked.groupby("case", sort=False)}
    if len(of_case) > MOST_CASES:
        return []
    text = []
    for case, table in of_case.items():
        metric = next(metric for metric in BENCH_METRICS if (table["metric"] == metric.name).any())
        reference = results.references.get(case)
        unranked = frozenset(SAME_GRAPH) - {reference} if reference in SAME_GRAPH else frozenset()
        text.append(winner(case, table[table["metric"] == metric.name], metric, unranked))
    if without := [case for case in results.cases if case not in of_case]:
        text.append(f"Not ranked by accuracy, without ground truth and held-out tracks: {listed(without)}.")
    return text


def winner(case: str, ranked: pd.DataFrame, metric: Metric, unranked: frozenset[str]) -> str:
    """The smallest mean error among those that answered in every run, where it is not `tied` with another.

    Other minima of the reference's graph do not compete with it.
    """
    rows = [row for row in records(ranked) if row["estimator"] not in unranked] or records(ranked)
    most = max(row["runs"] for row in rows)
    first, *others = (row for row in rows if row["runs"] == most)
    unit = f" {metric.unit}".rstrip()
    figures = {row["estimator"]: f"{interval(row['mean'], row['low'], row['high'])}{unit}" for row in rows}
    fewer = [f"{row['estimator']} ({_answers(row, first, most, metric)})" for row in rows if row["runs"] < most]
    left_out = f"; not ranked for failed runs: {listed(fewer)}" if fewer else ""
    if not others:
        return f"{case}: {metric.short} {first['estimator']} {figures[first['estimator']]}{left_out}."
    if most == 1:
        each = listed(f"{figures[row['estimator']]} for {row['estimator']}" for row in (first, *others))
        return f"{case}: {metric.short} {each}; one run does not rank them{left_out}."
    tied = [row["estimator"] for row in others if row["tied"] and not row["behind_low"] > 0.0]
    level = [row["estimator"] for row in others if row["tied"] and row["behind_low"] > 0.0]
    apart = [f"{row['estimator']} {figures[row['estimator']]}" for row in others if not row["tied"]]
    title = f"{case}: {'' if tied or level else 'smallest '}{metric.short}"
    like = f"; no significant difference from {listed(tied)}" if tied else ""
    like += f"; the same within {WITHIN} as {listed(level)}" if level else ""
    larger = f"; larger, by the paired interval: {listed(apart)}" if apart else ""
    return f"{title} {first['estimator']} {figures[first['estimator']]} over {most} runs{like}{larger}{left_out}."


def _answers(row: dict[str, Any], first: dict[str, Any], most: int, metric: Metric) -> str:
    """Number of runs that an estimator answered, and its difference from the first one in those runs."""
    answered = f"{row['runs']} of {most} runs"
    if first["rank"] != 1 or not isfinite(row["behind"]):
        return answered
    side = "above" if row["behind"] >= 0.0 else "below"
    return f"{answered}, {number(abs(row['behind']))} {metric.unit} {side} {first['estimator']} in these"


def _overall(results: Results) -> list[str]:
    metric, table = judge(results), overall(results)
    if metric is None or table.empty:
        return []
    table = table[table["metric"] == metric.name].head(3)
    places = [f"{row['estimator']} {number(row['mean_rank'])}" for row in records(table)]
    return [] if not places else [f"Mean rank by {metric.short} over {table['cases'].max()} cases: {listed(places)}."]


def _consistency(results: Results) -> list[str]:
    table = consistency(results)
    if table.empty:
        return []
    text = []
    for case, of_case in table[table["runs"] > 1].groupby("case", sort=False):
        figures = [f"{row['estimator']} {number(row['anees'])} ({row['verdict']})" for row in records(of_case)]
        low, high = (number(float(of_case[side].iloc[0])) for side in ("low", "high"))
        text.append(f"{case}: ANEES {listed(figures)}; 95 % bounds {low} to {high}.")
    return text if len(text) <= MOST_CASES else []


def duration(seconds: float) -> str:
    """Duration as text: `3.2 s`, `12 min` or `3.4 h`."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 6000.0 else f"{seconds / 3600.0:.2g} h"
