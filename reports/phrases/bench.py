"""Sentences and captions of a bench: failures first, then accuracy with its uncertainty, then consistency."""

from math import isfinite
from typing import Any

import pandas as pd

from fgbaseline.compare.estimate_comparison import SAME_GRAPH

from ..formatting import interval, listed, number
from ..results.bench import ANSWERED, METRICS, Results, consistency, judge, overall, rankings, records
from ..results.metrics import Metric

MOST_CASES = 10
"""that have a sentence each"""
TABLE = (
    "Means over the runs of a case; of errors in m and of held-out tracks with 95 % intervals where there are several "
    "runs (Student's t). Error to truth after SE(3) alignment (RMSE); divergence from the reference of each run (RMSE);"
    " both over the frames that all estimators of a run have; coverage is the share of the time in which an estimator "
    "has poses. Reprojection is the median over all observations, 'of common' over those that every estimator used. "
    "ANEES: 6 is consistent; ↑ marks estimators that are surer than they may be, ↓ those less sure, by chi-square at "
    "95 %. Best of a case in bold."
)
FIGURES = {
    "accuracy": "One mark an estimator; where there are several seeds, the line is the 95 % interval of the mean.",
    "accuracy_against_time": "The time an estimator took for a frame, on this machine and beside the other workers.",
    "scaling": "One mark a run; dashed the power of n that fits best, where sizes differ enough. Memory is that of the "
    "whole process while an estimator worked, some 200 MB of libraries among it.",
}
NEES = (
    "Each frame's NEES averaged over the runs. Inside the band it is what covariances that tell the truth would give; "
    "errors of neighbouring frames are nearly the same, so a curve stays where it has strayed to for a while."
)


def sentences(results: Results) -> list[str]:
    """The verdict."""
    return [*_failures(results), *_trust(results), *_best(results), *_overall(results), *_consistency(results)]


def _failures(results: Results) -> list[str]:
    n = len(results.planned)
    text = []
    if results.failures:
        text.append(f"{len(results.failures)} of {n} runs failed altogether; why is said below.")
    failed = results.runs[
        ~results.runs["status"].isin(ANSWERED) & ~results.runs["run"].isin(list(results.failures))
    ].groupby("estimator", sort=False)
    text += [f"{name} gave no answer in {len(rows)} of {n} runs." for name, rows in failed]
    return text


def _trust(results: Results) -> list[str]:
    counts = results.runs.drop_duplicates("run")["trust"].value_counts().to_dict()
    return [
        f"The reference is {word} in {counts[word]} of {len(results.planned)} runs: {meaning}."
        for word, meaning in (
            ("untrusted", "distances from it say how much two answers disagree, and not which one is right"),
            ("doubtful", "a small distance from it says more than a large one"),
        )
        if word in counts
    ]


def _best(results: Results) -> list[str]:
    """The most accurate estimator of each case, by truth, else by held-out tracks."""
    ranked = rankings(results)
    if ranked.empty:
        return ["No run has a truth or held-out tracks, so nothing says which estimator is the most accurate."]
    of_case = {str(case): table for case, table in ranked.groupby("case", sort=False)}
    if len(of_case) > MOST_CASES:
        return []
    text = []
    for case, table in of_case.items():
        metric = next(metric for metric in METRICS if (table["metric"] == metric.name).any())
        reference = results.references.get(case)
        unranked = frozenset(SAME_GRAPH) - {reference} if reference in SAME_GRAPH else frozenset()
        text.append(winner(case, table[table["metric"] == metric.name], metric, unranked))
    without = [case for case in results.cases if case not in of_case]
    return [*text, f"Nothing says who is most accurate in {listed(without)}."] if without else text


def winner(case: str, ranked: pd.DataFrame, metric: Metric, unranked: frozenset[str]) -> str:
    """The least mean error among those that answered in every run, where the paired interval separates it.

    Other minima of the reference's graph are no competitors of it.
    """
    rows = [row for row in records(ranked) if row["estimator"] not in unranked] or records(ranked)
    most = max(row["runs"] for row in rows)
    first, *others = (row for row in rows if row["runs"] == most)
    figures = {
        row["estimator"]: f"{interval(row['mean'], row['low'], row['high'])} {metric.unit}".rstrip() for row in rows
    }
    fewer = [f"{row['estimator']} ({_answers(row, first, most, metric)})" for row in rows if row["runs"] < most]
    left_out = f"; not ranked for missing answers: {listed(fewer)}" if fewer else ""
    if not others:
        return f"{case}: the {metric.short} of {first['estimator']} is {figures[first['estimator']]}{left_out}."
    if most == 1:
        each = listed(f"{figures[row['estimator']]} for {row['estimator']}" for row in (first, *others))
        return f"{case}: {metric.short} {each}; one run does not rank them{left_out}."
    best = number(first["mean"])
    tied = [row["estimator"] for row in others if row["tied"] or number(row["mean"]) == best]
    least = f"{figures[first['estimator']]} over {most} runs"
    if tied:
        text = f"{case}: {metric.short} {first['estimator']} {least}; these do not separate {listed(tied)} from it"
    else:
        text = f"{case}: {first['estimator']} has the least {metric.short}, {least}"
    apart = [f"{row['estimator']} {figures[row['estimator']]}" for row in others if row["estimator"] not in tied]
    larger = f"; larger, by the paired interval: {listed(apart)}" if apart else ""
    return f"{text}{larger}{left_out}."


def _answers(row: dict[str, Any], first: dict[str, Any], most: int, metric: Metric) -> str:
    """Number of runs that an estimator answered, and its difference from the first one where both did."""
    answered = f"{row['runs']} of {most} runs"
    if first["rank"] != 1 or not isfinite(row["behind"]):
        return answered
    side = "above" if row["behind"] >= 0.0 else "below"
    return f"{answered}, {number(abs(row['behind']))} {metric.unit} {side} {first['estimator']} there"


def _overall(results: Results) -> list[str]:
    metric, table = judge(results), overall(results)
    if metric is None or table.empty:
        return []
    table = table[table["metric"] == metric.name].head(3)
    places = [f"{row['estimator']} {number(row['mean_rank'])}" for row in records(table)]
    if not places:
        return []
    return [f"Mean rank by {metric.short} over {table['cases'].max()} cases: {listed(places)}."]


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
