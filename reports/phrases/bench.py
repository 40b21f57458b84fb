"""What a bench says, in sentences: what failed first, then who is best and how sure that is, then consistency."""

from math import isfinite
from typing import Any

import pandas as pd

from ..formatting import interval, listed, number
from ..html.accuracy_verdict import SAME_GRAPH
from .figures import judge
from .results import ANSWERED, METRICS, Metric, Results
from .tables import consistency, overall, rankings, records

MOST_CASES = 10
"""that are told one by one"""


def sentences(results: Results) -> list[str]:
    """The verdict."""
    return [*_failures(results), *_trust(results), *_best(results), *_overall(results), *_consistency(results)]


def _failures(results: Results) -> list[str]:
    n = len(results.planned)
    said = []
    if results.failures:
        said.append(f"{len(results.failures)} of {n} runs failed altogether; why is said below.")
    failed = results.runs[
        ~results.runs["status"].isin(ANSWERED) & ~results.runs["run"].isin(list(results.failures))
    ].groupby("estimator", sort=False)
    said += [f"{name} gave no answer in {len(rows)} of {n} runs." for name, rows in failed]
    return said


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
    """Of each case, by what it has: truth, else held-out tracks."""
    ranked = rankings(results)
    if ranked.empty:
        return ["No run has a truth or held-out tracks, so nothing says which estimator is the most accurate."]
    of_case = {str(case): table for case, table in ranked.groupby("case", sort=False)}
    if len(of_case) > MOST_CASES:
        return []
    said = []
    for case, table in of_case.items():
        metric = next(metric for metric in METRICS if (table["metric"] == metric.name).any())
        reference = results.references.get(case)
        unranked = frozenset(SAME_GRAPH) - {reference} if reference in SAME_GRAPH else frozenset()
        said.append(_winner(case, table[table["metric"] == metric.name], metric, unranked))
    without = [case for case in results.cases if case not in of_case]
    return [*said, f"Nothing says who is most accurate in {listed(without)}."] if without else said


def _winner(case: str, ranked: pd.DataFrame, metric: Metric, unranked: frozenset[str]) -> str:
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
        return f"{case}: the {metric.title} of {first['estimator']} is {figures[first['estimator']]}{left_out}."
    if most == 1:
        each = listed(f"{figures[row['estimator']]} for {row['estimator']}" for row in (first, *others))
        return f"{case}: {metric.title} {each}; one run does not rank them{left_out}."
    best = number(first["mean"])
    tied = [row["estimator"] for row in others if row["tied"] or number(row["mean"]) == best]
    least = f"{figures[first['estimator']]} over {most} runs"
    if tied:
        said = f"{case}: {metric.title} {first['estimator']} {least}; these do not separate {listed(tied)} from it"
    else:
        said = f"{case}: {first['estimator']} has the least {metric.title}, {least}"
    apart = [f"{row['estimator']} {figures[row['estimator']]}" for row in others if row["estimator"] not in tied]
    larger = f"; larger, by the paired interval: {listed(apart)}" if apart else ""
    return f"{said}{larger}{left_out}."


def _answers(row: dict[str, Any], first: dict[str, Any], most: int, metric: Metric) -> str:
    """How many runs an estimator answered, and how it is beside the first one where both did."""
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
    return [f"Mean rank by {metric.title} over {table['cases'].max()} cases: {listed(places)}."]


def _consistency(results: Results) -> list[str]:
    table = consistency(results)
    if table.empty:
        return []
    said = []
    for case, of_case in table[table["runs"] > 1].groupby("case", sort=False):
        told = [f"{row['estimator']} {number(row['anees'])} ({row['verdict']})" for row in records(of_case)]
        low, high = (number(float(of_case[side].iloc[0])) for side in ("low", "high"))
        said.append(f"{case}: ANEES {listed(told)}; 95 % bounds {low} to {high}.")
    return said if len(said) <= MOST_CASES else []
