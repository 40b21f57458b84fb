"""Better and worse are claimed only where the paired bootstrap supports it: words, sign and significance together."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline import compare
from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.phrases.bench import winner
from fgbaseline.reports.phrases.evidence import held_out_sentences, significance_sentences
from fgbaseline.reports.phrases.run_accuracy import ate_sentences, divergence_sentences
from fgbaseline.reports.results.bench import BENCH_METRICS
from fgbaseline.reports.tables.run import main_table

from ..builders.runs import FRAMES, answer, as_dict, run_of, scene
from ..builders.synthetic import plain_problem

NAMES = ("isam2", "ekf", "joint-ekf", "batch")


@cache
def plain_run() -> Run:
    problem = plain_problem(scene())
    return run_of(problem, *(answer(problem, name) for name in NAMES))


def run_with(truth: dict[str, FloatArray], divergence: dict[str, FloatArray]) -> Run:
    """A run whose position errors are these."""
    run, results = plain_run(), {}
    for name, result in run.results.items():
        if name in truth:
            traveled = np.linspace(0.0, 100.0, FRAMES)
            tables = [
                pd.DataFrame({"position": e, "rotation_deg": 0.0, "traveled": traveled})
                for e in (truth[name], divergence[name])
            ]
            results[name] = replace(result, truth_aligned=tables[0], divergence=tables[1])
    return replace(run, results=results)


def rmse(errors: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(errors**2)))


SERIES = st.builds(
    lambda seed, level, spread, slope: np.abs(
        level + slope * np.linspace(0.0, 1.0, FRAMES) + spread * np.random.default_rng(seed).normal(size=FRAMES)
    ),
    st.integers(0, 1000),
    st.sampled_from([0.01, 1.0, 1.0 + 1e-6, 1.05, 1.5]),
    st.sampled_from([0.0, 1e-5, 0.1, 0.5]),
    st.sampled_from([0.0, 0.5]),
)


def names_after(sentence: str, start: str, end: str) -> list[str]:
    part = sentence.partition(start)[2].partition(end)[0]
    return [name for name in NAMES if f" {name} " in f" {part.replace(',', ' ').replace('.', ' ')} "]


@settings(max_examples=40, deadline=None)
@given(st.lists(SERIES, min_size=2, max_size=3), st.lists(st.booleans(), min_size=3, max_size=3))
def test_words_sign_and_significance_agree(series: list[FloatArray], holes: list[bool]) -> None:
    errors = {}
    for name, values, hole in zip(NAMES, series, holes, strict=False):
        errors[name] = values.copy()
        if hole:
            errors[name][40:] = np.nan
    everywhere = ~np.any([np.isnan(e) for e in errors.values()], axis=0)
    common = {name: e[everywhere] for name, e in errors.items()}
    run = run_with(errors, errors)

    worse = next((s for s in ate_sentences(run) if s.startswith("The reference isam2 has a larger ATE")), "")
    said = names_after(worse, "than", ", by paired")
    for name in errors.keys() - {"isam2"}:
        larger, smaller = rmse(common["isam2"]), rmse(common[name])
        d = compare.rmse_difference(common["isam2"], common[name])
        assert (name in said) == (d.low > 0.0 and larger > 1.01 * smaller)

    rivals = {name: e for name, e in errors.items() if name != "isam2"}
    both = ~np.any([np.isnan(e) for e in rivals.values()], axis=0)
    least = min(rmse(e[both]) for e in rivals.values())
    tied = [name for name, e in rivals.items() if rmse(e[both]) == least]
    first_sentence, *others = [s for s in divergence_sentences(run) if "minimum" not in s]
    first = next(name for name in tied if f": {name} " in first_sentence)
    farther = names_after(next((s for s in others if s.startswith("Larger divergence than")), ""), ":", "$")
    for name in rivals.keys() - {first}:
        d = compare.rmse_difference(rivals[name][both], rivals[first][both])
        larger, smaller = (rmse(rivals[rival][both]) for rival in (name, first))
        assert (name in farther) == (d.low > 0.0 and larger > 1.01 * smaller)
    alone = set(farther) - {first} == rivals.keys() - {first} and len(rivals) > 1
    assert first_sentence.startswith("Smallest divergence from isam2") == alone


def test_a_difference_below_one_percent_is_not_claimed() -> None:
    larger, smaller = 0.004617, 0.004605  # printed as 0.00462 and 0.00461
    d = compare.rmse_difference(np.full(100, larger), np.full(100, smaller))
    assert d.settled
    assert not compare.is_claimed(d, larger, smaller)
    assert compare.is_claimed(d, 1.02 * smaller, smaller)
    errors = {"isam2": np.full(FRAMES, larger), "ekf": np.full(FRAMES, smaller)}
    said = ate_sentences(run_with(errors, errors))
    assert said[1:] == ["The ATE of ekf and isam2 is the same within 1 %: not ranked."]


def test_a_comparison_of_files_claims_from_the_same_difference_on() -> None:
    rmse = {"first": 1.0, "level": 1.0099, "larger": 1.0101, "unsure": 1.5}
    behind = {
        name: compare.RmseDifference(value - 1.0, -1.0 if name == "unsure" else 0.5 * (value - 1.0), 2.0, 1, 50.0, True)
        for name, value in rmse.items()
        if name != "first"
    }
    larger, level, other = significance_sentences(rmse, behind)
    assert larger.startswith("Larger position RMSE than first, by paired bootstrap: larger (")
    assert level.startswith("Same position RMSE as first within 1 %: level (")
    assert other.startswith("No significant difference from first, by paired bootstrap: unsure (")


def test_the_minimum_of_the_same_graph_is_not_ranked_against_the_reference() -> None:
    errors = {"isam2": np.full(FRAMES, 2.0), "ekf": np.full(FRAMES, 3.0), "batch": np.full(FRAMES, 1.0)}
    run = run_with(errors, {"isam2": np.zeros(FRAMES), "ekf": np.full(FRAMES, 3.0), "batch": np.full(FRAMES, 0.01)})
    assert not [s for s in ate_sentences(run) if "larger ATE" in s or "significant" in s]
    sentences = divergence_sentences(run)
    assert ": ekf 3.00 m " in sentences[0]
    assert "batch, which minimizes the same cost as isam2: divergence 0.0100 m (RMSE)." in sentences


def test_values_with_the_same_digits_are_best_together_and_the_same_graph_is_not_nearest() -> None:
    problem = plain_problem(scene())
    drifts = {"isam2": 1.0, "ekf": 3.0, "joint-ekf": 3.0 + 1e-6, "batch": 1.01}
    run = run_of(problem, *(answer(problem, name, (0.0, drift, 0.0)) for name, drift in drifts.items()))
    document = as_dict(run)["estimators"]
    table = main_table(run, document)
    at = [column.heading for column in table.columns].index("RMSE, m")
    assert {row.name: row.cells[at].best for row in table.rows if row.name != "isam2"} == {
        "ekf": True,
        "joint-ekf": True,
        "batch": False,
    }


ATE = next(metric for metric in BENCH_METRICS if metric.name == "ate")


def ranked(**columns: list[float]) -> pd.DataFrame:
    return compare.monte_carlo_ranking(pd.DataFrame(columns)).reset_index()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 6), st.sampled_from([0.0, 1e-6, 0.05, 1.0]))
def test_a_bench_claims_the_least_error_only_where_runs_separate_it(seed: int, runs: int, apart: float) -> None:
    random = np.random.default_rng(seed)
    table = pd.DataFrame(1.0 + 0.1 * random.random((runs, 3)), columns=["a", "b", "c"])
    table["b"] += apart
    table["c"] = table["c"].where(random.random(runs) < 0.8)
    sentence = winner("drive", compare.monte_carlo_ranking(table).reset_index(), ATE, frozenset())
    whole = [name for name in table if table[name].notna().all()]
    means = table[whole].mean()
    first = str(means.idxmin())
    claims = "smallest" in sentence
    separated = []
    for name in whole:
        interval = compare.mean_interval((table[name] - table[first]).to_numpy())
        if name != first and interval.low > 0.0 and means[name] > 1.01 * means[first]:
            separated.append(name)
    assert claims == (len(whole) > 1 and len(separated) == len(whole) - 1 and runs > 1)
    if claims:
        assert f"smallest ATE {first} " in sentence
    larger = sentence.partition("larger, by the paired interval: ")[2].partition(";")[0]
    assert [name for name in whole if f"{name} " in larger] == (separated if runs > 1 else [])


@pytest.mark.parametrize(("larger", "is_larger"), [(1.009, False), (1.011, True)])
def test_runs_bench_and_held_out_tracks_claim_from_the_same_difference_on(larger: float, is_larger: bool) -> None:
    errors = {"isam2": np.full(FRAMES, larger), "ekf": np.full(FRAMES, 1.0)}
    assert any("larger ATE" in s for s in ate_sentences(run_with(errors, errors))) == is_larger

    table = ranked(a=[1.0, 1.1, 0.9], b=[larger, 1.1 * larger, 0.9 * larger])
    assert table["tied"].tolist() == [True, not is_larger]
    assert winner("drive", table, ATE, frozenset()).startswith("drive: smallest ATE a ") == is_larger
    fewer = ranked(a=[1.0, 1.0, 9.0], b=[larger, 1.001 * larger, np.nan])  # compared over the runs that both have
    assert fewer["tied"].tolist() == [True, not is_larger]

    held_out = pd.DataFrame({"median": [1.0, larger], "behind_low": [0.0, 1e-3]}, index=["a", "b"])
    same = ["The held-out error of a and b is the same within 1 %."]
    assert held_out_sentences(held_out, "the tracks")[1:] == ([] if is_larger else same)


def test_one_run_ranks_no_estimator_and_missing_estimates_are_named() -> None:
    assert "one run does not rank them" in winner("drive", ranked(a=[1.0], b=[2.0]), ATE, frozenset())
    said = winner("drive", ranked(a=[1.0, 1.1, 1.0], b=[2.0, 2.1, 2.0], c=[0.1, np.nan, np.nan]), ATE, frozenset())
    assert "smallest ATE a " in said
    assert "not ranked for failed runs: c (1 of 3 runs, 0.900 m below a in these)" in said
    same = winner("drive", ranked(isam2=[1.0, 1.1, 1.0], batch=[0.9, 0.8, 0.9]), ATE, frozenset({"batch"}))
    assert "batch" not in same


@pytest.mark.parametrize("names", [("a", "b"), ("a", "b", "c")])
def test_a_paired_ranking_is_in_the_order_of_the_common_moments(names: tuple[str, ...]) -> None:
    random = np.random.default_rng(3)
    errors = {name: random.random(50) for name in names}
    errors["a"][:10] = np.nan
    found = compare.paired_ranking(errors)
    assert found.moments == 40
    assert list(found.rmse.values()) == sorted(found.rmse.values())
    assert all(d.value >= 0.0 for d in found.behind.values())
    assert found.rmse["b"] == pytest.approx(rmse(errors["b"][10:]))
    nothing = compare.paired_ranking({"a": [np.nan, 1.0], "b": [1.0, np.nan]})
    assert (nothing.rmse, nothing.moments) == ({}, 0)
