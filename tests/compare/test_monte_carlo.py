"""Means, rankings and ANEES over independent runs, against scipy and chi-square itself."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from fgbaseline import compare


@pytest.mark.parametrize("n", [2, 3, 30])
def test_the_interval_of_a_mean_is_students(n: int) -> None:
    values = np.random.default_rng(n).gamma(2.0, size=n)
    low, high = stats.t.interval(0.95, n - 1, loc=values.mean(), scale=stats.sem(values))
    assert compare.mean_interval(np.append(values, np.nan)) == pytest.approx((values.mean(), low, high, n))


def test_one_value_gives_no_interval_of_its_mean() -> None:
    assert compare.mean_interval(np.array([0.3])) == pytest.approx((0.3, np.nan, np.nan, 1), nan_ok=True)
    assert compare.mean_interval(np.array([np.nan])).n == 0


def test_a_small_constant_difference_is_significant_and_a_varying_one_is_not() -> None:
    random = np.random.default_rng(1)
    hard = random.uniform(0.1, 10.0, 20)  # some drives are harder than others, for all estimators
    errors = pd.DataFrame({"worse": 1.02 * hard, "best": hard, "like": hard * random.uniform(0.9, 1.15, 20)})
    table = compare.monte_carlo_ranking(errors)
    assert table.index[0] == "best"
    assert table["tied"].to_dict() == {"best": True, "like": True, "worse": False}
    assert table.loc["worse", "behind"] == pytest.approx(0.02 * hard.mean())
    # Unpaired means do not decide: their intervals overlap by far.
    assert table.loc["worse", "low"] < table.loc["best", "mean"]


def test_estimators_with_fewer_answers_rank_last_and_those_without_any_are_unranked() -> None:
    errors = pd.DataFrame({"bold": [0.1, np.nan, 0.1], "sound": [0.2, 0.9, 0.2], "gone": [np.nan] * 3})
    table = compare.monte_carlo_ranking(errors)
    assert list(table.index) == ["sound", "bold"]
    assert table["runs"].to_list() == [3, 2]
    assert table.loc["bold", "behind"] == pytest.approx(-0.1)


def test_consistent_covariances_are_inside_the_bounds_and_overconfident_ones_are_not() -> None:
    random = np.random.default_rng(3)
    honest = [random.chisquare(6, size=400) for _ in range(25)]
    table = compare.average_nees(honest)
    assert table["low"].iloc[0] == pytest.approx(stats.chi2.ppf(0.025, 150) / 25)
    assert table["high"].iloc[0] == pytest.approx(stats.chi2.ppf(0.975, 150) / 25)
    found = compare.anees_summary(honest)
    assert found.low < found.anees < found.high
    assert found.inside == pytest.approx(0.95, abs=0.04)
    sure = compare.anees_summary([2.0 * values for values in honest])
    assert sure.anees > sure.high
    assert sure.inside < 0.01


def test_runs_of_other_lengths_are_averaged_where_all_have_a_value() -> None:
    columns = [np.array([np.nan, 6.0, 7.0]), np.array([np.nan, 4.0]), np.full(3, np.nan)]
    found = compare.anees_summary(columns)
    assert (found.anees, found.runs) == (5.0, 2)
    assert compare.average_nees(columns)["runs"].to_list() == [0, 2, 1]


def test_no_value_has_no_mean_and_no_run_no_consistency() -> None:
    nothing = pytest.approx((np.nan, np.nan, np.nan, 0), nan_ok=True)
    assert compare.mean_interval(np.array([np.nan, np.nan])) == nothing
    assert compare.anees_summary([]) == pytest.approx((np.nan,) * 4 + (0,), nan_ok=True)
    assert compare.anees_summary([np.full(3, np.nan)]) == pytest.approx((np.nan,) * 4 + (0,), nan_ok=True)
    apart = [np.array([6.0, np.nan]), np.array([np.nan, 6.0])]
    assert compare.anees_summary(apart) == pytest.approx((np.nan,) * 4 + (2,), nan_ok=True)


def test_the_table_over_runs_has_a_row_for_each_frame() -> None:
    table = compare.average_nees([np.array([np.nan, 6.0, 8.0]), np.array([np.nan, 4.0])])
    assert table.index.name == "frame"
    assert table.index.tolist() == [0, 1, 2]
    assert table.columns.tolist() == ["anees", "runs", "low", "high"]
    assert table["anees"].tolist() == pytest.approx([np.nan, 5.0, 8.0], nan_ok=True)
    for column, p in (("low", 0.025), ("high", 0.975)):
        expected = [np.nan, stats.chi2.ppf(p, 12) / 2, stats.chi2.ppf(p, 6)]
        assert table[column].tolist() == pytest.approx(expected, nan_ok=True)


def test_the_ranking_of_a_known_case() -> None:
    table = compare.monte_carlo_ranking(
        pd.DataFrame({"b": [3.0, 5.0], "a": [1.0, 3.0], "twin": [1.0, 3.0], "gone": [np.nan] * 2})
    )
    assert table.index.name == "estimator"
    assert table.index.tolist() == ["a", "twin", "b"]
    assert table.columns.tolist() == [
        "rank", "runs", "mean", "low", "high", "behind", "behind_low", "behind_high", "tied"
    ]  # fmt: skip
    assert table["rank"].tolist() == [1, 2, 3]
    assert table["runs"].tolist() == [2, 2, 2]
    assert table["mean"].tolist() == [2.0, 2.0, 4.0]
    assert table["behind"].tolist() == [0.0, 0.0, 2.0]
    assert table["behind_low"].tolist() == table["behind_high"].tolist() == [0.0, 0.0, 2.0]  # every run says the same
    assert table["tied"].tolist() == [True, True, False]
    half = stats.t.ppf(0.975, 1)  # of two runs, s / sqrt(n) = 1
    assert table["low"].tolist() == pytest.approx([2.0 - half, 2.0 - half, 4.0 - half])
    assert table["high"].tolist() == pytest.approx([2.0 + half, 2.0 + half, 4.0 + half])


def test_anees_summary_of_known_figures() -> None:
    found = compare.anees_summary([np.array([6.0, 6.0, 60.0, 0.0])])
    assert found == pytest.approx((18.0, *stats.chi2.ppf([0.025, 0.975], 6), 0.5, 1))
