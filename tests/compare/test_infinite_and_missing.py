"""Infinite and missing errors count: infinite stays infinite, NaN is counted beside the figure."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import compare, ekf
from fgbaseline.compare import estimate_comparison as comparison
from fgbaseline.compare.statistics.descriptive import quantile
from fgbaseline.data import Estimate, Landmarks, Problem
from fgbaseline.data.triangulate_landmarks import landmarks_along
from fgbaseline.reports.formatting import number
from fgbaseline.reports.html.run_page import render
from fgbaseline.reports.results.run import summarize
from fgbaseline.reports.tables.run import main_table, metrics_table

from ..builders.synthetic import Scene, plain_problem

ERRORS = st.lists(st.sampled_from([0.0, 1.0, 2.5, 40.0, np.inf, np.nan]), max_size=30)


@given(ERRORS)
def test_infinite_values_stay_infinite_and_nan_is_counted(errors: list[float]) -> None:
    summary = compare.summarized(errors)
    known = [e for e in errors if not np.isnan(e)]
    assert summary["missing"] == len(errors) - len(known)
    for name in ("rmse", "mean", "max"):
        assert np.isinf(summary[name]) == (np.inf in known)
    for name, share in (("median", 0.5), ("p95", 0.95)):
        assert np.isnan(summary[name]) == (not known)
        if known:  # an infinite error is larger than any finite one
            huge = float(np.quantile(np.minimum(known, 1e12), share))
            assert summary[name] == (np.inf if huge > 1e6 else pytest.approx(huge))


def test_one_and_two_infinite_errors_have_no_finite_rmse() -> None:
    assert compare.summarized([1.0, np.inf, np.inf])["rmse"] == np.inf
    assert compare.error_statistics([1.0, np.inf, np.inf]).loc["rmse", "value"] == np.inf
    assert compare.mean_interval(np.array([1.0, np.inf]))[:1] == (np.inf,)


@given(ERRORS)
def test_the_statistics_of_a_series_count_like_its_summary(errors: list[float]) -> None:
    table, summary = compare.error_statistics(errors, repetitions=3), compare.summarized(errors)
    assert table.attrs["missing"] == summary["missing"]
    assert table.loc["n", "value"] == len(errors) - summary["missing"]
    for name in ("rmse", "mean", "median", "p95"):
        assert table.loc[name, "value"] == pytest.approx(summary[name], nan_ok=True)


def test_quantiles_between_finite_errors_do_not_see_the_infinite_ones() -> None:
    assert quantile(np.array([1.0, 3.0, np.inf, np.inf]), 0.25) == pytest.approx(2.5)
    assert quantile(np.array([1.0, 3.0, np.inf]), 0.5) == 3.0


def test_an_infinite_error_decides_no_ranking_and_is_not_omitted() -> None:
    found = compare.rmse_difference([1.0, np.inf, 1.0], [2.0, 2.0, 2.0])
    assert found.value == np.inf
    assert not found.settled
    both = compare.rmse_difference([1.0, np.inf], [np.inf, 1.0])
    assert np.isnan(both.value)
    assert not both.settled


def test_an_infinite_mean_ranks_last_and_two_of_them_tie() -> None:
    ranked = compare.monte_carlo_ranking(pd.DataFrame({"a": [np.inf, np.inf], "b": [1.0, 2.0], "c": [np.inf, 3.0]}))
    assert ranked.index[0] == "b"
    assert ranked.loc["c", "mean"] == np.inf
    tie = compare.monte_carlo_ranking(pd.DataFrame({"a": [np.inf, 1.0], "c": [np.inf, 1.0]}))
    assert tie["tied"].all()


def test_an_infinite_nees_is_outside_and_makes_the_mean_infinite() -> None:
    table = compare.average_nees([np.array([6.0, np.inf, np.nan]), np.array([6.0, 6.0, 6.0])])
    assert table["anees"].tolist() == [6.0, np.inf, 6.0]
    assert table["runs"].tolist() == [2, 2, 1]


def answer(problem: Problem, *, infinite: bool = False, missing: bool = False) -> Estimate:
    truth = problem.sequence.truth
    assert truth is not None
    landmarks = landmarks_along(problem, truth.world_T_imu)
    position = landmarks.position.copy()
    if infinite:
        position[0] = np.inf
    if missing:
        position[1] = np.nan
    return Estimate("mine", truth.world_T_imu, problem.mask, landmarks=Landmarks(landmarks.index, position))


def test_landmarks_at_infinity_and_unknown_ones_are_counted_in_the_reprojection() -> None:
    problem = plain_problem(Scene().sequence())
    table = compare.reprojection(problem.sequence, answer(problem, infinite=True, missing=True))
    summary = compare.reprojection_summary(table)
    assert summary["rmse"] == np.inf
    assert summary["missing"] == 10
    assert summary["n"] == 110
    by_frame = compare.reprojection_by(table, "frame")
    assert (by_frame["rmse"] == np.inf).all()
    assert (by_frame["missing"] == 1).all()


def run_of(estimate: Estimate, problem: Problem) -> comparison.Run:
    poses = estimate.world_T_imu.copy()
    poses[6:] = np.nan
    half = replace(ekf.dead_reckoning(problem), name="half", world_T_imu=poses)
    return comparison.compare_all(problem, {"isam2": replace(estimate, name="isam2"), "half": half}, {})


def test_summary_page_and_metrics_say_infinite_and_count_the_missing() -> None:
    problem = plain_problem(Scene().sequence())
    run = run_of(answer(problem, infinite=True, missing=True), problem)
    summary = summarize(run)
    document: dict[str, Any] = json.loads(json.dumps(summary.model_dump(mode="json", by_alias=True), allow_nan=False))
    isam2, half = (document["estimators"][name] for name in ("isam2", "half"))
    assert isam2["reprojection"]["rmse"] is None
    assert isam2["notes"]["reprojection.rmse"] == "infinite"
    assert isam2["reprojection"]["missing"] == 10
    assert half["ate"]["missing"] == half["divergence"]["missing"] == 4
    table = main_table(run, document["estimators"])
    assert any("4 errors are missing (NaN) and left out" in text for _, text in table.notes)
    written = metrics_table(summary).set_index(["estimator", "metric"])["value"]
    assert written["half", "ate.missing"] == 4
    assert render(run, document, {})


def test_an_infinite_number_is_printed_as_infinite() -> None:
    assert (number(np.inf), number(-np.inf), number(np.nan)) == ("∞", "−∞", "–")
