"""Confidence intervals of statistics of errors that follow each other in time."""

import numpy as np
import pytest
from evo.core.metrics import APE, StatisticsType
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from fgbaseline import compare
from fgbaseline.compare.statistics.block_bootstrap import autocovariance, block_length
from fgbaseline.compare.statistics.bootstrap_resampling import (
    BlockDraws,
    draw_blocks,
    percentile_interval,
)
from fgbaseline.geometry import FloatArray, InputError


def autoregressive(n: int, phi: float, seed: int) -> FloatArray:
    """x_k = phi x_(k-1) + noise, from its stationary state; of mean 0."""
    noise = np.random.default_rng(seed).normal(size=n + 500)
    return np.asarray(lfilter([1.0], [1.0, -phi], noise)[500:])


@given(errors=st.lists(st.floats(0, 1e6), min_size=1, max_size=40))
def test_the_values_are_those_of_evo_and_numpy(errors: list[float]) -> None:
    table = compare.error_statistics([*errors, np.nan], repetitions=5)
    evo = APE()
    evo.error = np.array(errors)
    for statistic in StatisticsType:
        assert table.loc[statistic.value, "value"] == pytest.approx(evo.get_statistic(statistic), rel=1e-12, abs=1e-12)
    assert table.loc["p95", "value"] == pytest.approx(np.percentile(errors, 95))
    assert table.loc["n", "value"] == len(errors)
    assert table.loc[["min", "max", "sse", "n"], ["low", "high"]].isna().all(axis=None)


def test_autocovariance_is_its_definition() -> None:
    x = autoregressive(60, 0.5, 0) + 7.0
    centered = x - x.mean()
    expected = [np.sum(centered[lag:] * centered[: len(x) - lag]) / len(x) for lag in range(len(x))]
    np.testing.assert_allclose(autocovariance(x), expected, atol=1e-12)


@pytest.mark.parametrize("phi", [0.3, 0.6, 0.9])
def test_the_block_is_as_long_as_theory_has_it(phi: float) -> None:
    """For an AR(1), G / g = 2 phi / (1 - phi^2), so b = (3/2 (G / g)^2 n)^(1/3)."""
    n = 4000
    theory = (1.5 * (2 * phi / (1 - phi**2)) ** 2 * n) ** (1 / 3)
    found = np.median([block_length(autoregressive(n, phi, seed)).length for seed in range(30)])
    assert found == pytest.approx(theory, rel=0.12)


def test_block_lengths_of_white_constant_short_and_trending_series() -> None:
    assert block_length(np.random.default_rng(0).normal(size=1000)).length <= 5
    assert block_length(np.ones(100)) == (1, True)
    assert block_length(np.arange(5.0)) == (1, True)
    assert block_length(np.arange(300.0)) == (52, False)  # 3 sqrt(n): a trend has no end of correlation


def test_intervals_have_their_nominal_coverage() -> None:
    """An AR(1) of 0.8 and 1000 values: blocks come close to 95 %, single values are wrong most of the time."""
    hits = {None: 0, 1: 0}
    trials = 100
    for seed in range(trials):
        x = autoregressive(1000, 0.8, seed)
        for block in hits:
            low, high = compare.error_statistics(x, block=block, repetitions=100, seed=seed).loc[
                "mean", ["low", "high"]
            ]
            hits[block] += bool(low <= 0.0 <= high)
    assert hits[None] / trials > 0.87
    assert hits[1] / trials < 0.65


@pytest.mark.parametrize(("n", "block"), [(1, 2), (5, 6), (5, 0), (0, 2)])
def test_a_block_is_no_longer_than_the_series(n: int, block: int) -> None:
    with pytest.raises(InputError, match="block"):
        compare.error_statistics(np.ones(n), block=block)
    assert compare.error_statistics(np.ones(n), block=max(n, 1), repetitions=5).attrs["block"] == max(n, 1)


def test_the_rmse_has_its_interval_too() -> None:
    hits = 0
    for seed in range(100):
        low, high = compare.error_statistics(autoregressive(1000, 0.7, seed), repetitions=150).loc[
            "rmse", ["low", "high"]
        ]
        hits += bool(low <= 1 / np.sqrt(1 - 0.7**2) <= high)
    assert hits > 80


def test_the_same_seed_gives_the_same_interval() -> None:
    x = autoregressive(300, 0.9, 1)
    first, again, other = (compare.error_statistics(x, seed=seed) for seed in (3, 3, 4))
    assert first.equals(again)
    assert not first.equals(other)
    inside = first.loc[["rmse", "mean", "median", "std"]]
    assert (inside["low"] <= inside["value"]).all()
    assert (inside["value"] <= inside["high"]).all()


def test_a_series_too_short_for_its_correlation_is_reported() -> None:
    assert not compare.error_statistics(np.arange(60.0)).attrs["reliable"]
    assert not compare.error_statistics(autoregressive(5000, 0.1, 0).cumsum()).attrs["reliable"]
    assert compare.error_statistics(autoregressive(2000, 0.3, 0)).attrs["reliable"]


@pytest.mark.parametrize("n", [30, 101, 400])
@pytest.mark.parametrize("shape", ["ramp", "walk", "wave", "decay"])
def test_an_interval_contains_its_statistic_or_is_not_stated(n: int, shape: str) -> None:
    t, rng = np.linspace(0.0, 1.0, n), np.random.default_rng(n)
    errors = {
        "ramp": t**3,
        "walk": np.abs(rng.normal(size=n).cumsum()),
        "wave": np.abs(np.sin(7.0 * t)),
        "decay": np.exp(-5.0 * t) + 0.05 * np.abs(rng.normal(size=n)),
    }[shape]
    table = compare.error_statistics(errors)
    stated = table[table["low"].notna()]
    assert {"rmse", "mean"} <= {*stated.index}
    assert ((stated["low"] <= stated["value"] + 1e-12) & (stated["value"] <= stated["high"] + 1e-12)).all()


def test_one_error_has_no_interval_and_none_has_no_value() -> None:
    one = compare.error_statistics([2.0])
    assert one.loc["rmse", "value"] == 2.0
    assert one[["low", "high"]].isna().all(axis=None)
    none = compare.error_statistics([np.nan])
    assert none.drop("n").isna().all(axis=None)
    assert none.loc["n", "value"] == 0


@pytest.mark.parametrize("wrong", [{"confidence": 1.0}, {"confidence": 0.0}, {"repetitions": 0}, {"block": 11}])
def test_settings_that_make_no_sense_are_errors(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="bootstrap:"):
        compare.error_statistics(np.arange(10.0), **wrong)  # type: ignore[arg-type]


@given(values=st.lists(st.sampled_from([0.0, 1.0, 1.5, 4.0, 9.0]), min_size=1, max_size=30), block=st.integers(1, 30))
def test_sums_and_quantiles_are_those_of_the_series_written_out(values: list[float], block: int) -> None:
    x = np.array(values)
    n, block = len(x), min(block, len(x))
    draws = draw_blocks(n, block, 7, seed=3)
    assert ((draws.start >= 0) & (draws.start <= n - block)).all()
    series = np.stack(
        [np.concatenate([x[s : s + m] for s, m in zip(row, draws.length, strict=True)]) for row in draws.start]
    )
    assert series.shape == (7, n)
    np.testing.assert_allclose(draws.sums(x[:, None])[:, 0], series.sum(axis=1), atol=1e-12)
    np.testing.assert_allclose(draws.quantiles(x, (0.1, 0.5, 0.95)), np.quantile(series, (0.1, 0.5, 0.95), axis=1).T)


def test_common_errors_do_not_widen_the_interval_of_a_paired_difference() -> None:
    """The intervals of the two overlap, and yet one is the better one everywhere."""
    common = np.abs(autoregressive(1000, 0.8, 0))
    better, worse = common, common + 0.05
    low, high = (compare.error_statistics(e).loc["rmse"] for e in (worse, better))
    assert low["low"] < high["high"]
    found = compare.rmse_difference(worse, better)
    assert found.settled
    assert found.low <= found.value <= found.high
    rmse = [float(np.sqrt(np.mean(e**2))) for e in (worse, better)]
    assert found.value == pytest.approx(rmse[0] - rmse[1], rel=1e-12)
    back = compare.rmse_difference(better, worse)
    assert (back.value, back.low, back.high) == pytest.approx((-found.value, -found.high, -found.low), rel=1e-12)


def test_the_false_positive_rate_is_at_most_the_significance_level() -> None:
    random = np.random.default_rng(0)
    settled = 0
    for seed in range(100):
        common = autoregressive(600, 0.9, seed)
        pair = (common + 0.3 * random.normal(size=600) for _ in range(2))
        settled += compare.rmse_difference(*pair, repetitions=150).settled
    assert settled <= 15


def test_pairs_without_a_difference_decide_nothing() -> None:
    x = np.arange(20.0)
    assert not compare.rmse_difference(x, x).settled
    nothing = compare.rmse_difference([np.nan], [1.0])
    assert not nothing.settled
    assert np.isnan([nothing.value, nothing.low, nothing.high]).all()
    assert (nothing.block, nothing.reliable) == (1, False)
    with pytest.raises(InputError, match="same n stamps"):
        compare.rmse_difference([1.0, 2.0], [1.0])


def politis_and_white(x: FloatArray) -> int:
    """Politis and White (2004) with the correction of Patton, Politis and White (2009), term by term."""
    n = len(x)
    R = autocovariance(x)
    widest = int(np.ceil(np.sqrt(n))) + 5
    quiet = [abs(R[k] / R[0]) < 2.0 * np.sqrt(np.log10(n) / n) for k in range(widest + 1)]
    m = next(m for m in range(widest) if all(quiet[m + 1 : m + 6]))
    M = min(2 * max(m, 1), widest)
    flat_top = {k: 1.0 if abs(k) / M <= 0.5 else 2.0 * (1.0 - abs(k) / M) for k in range(-M, M + 1)}
    g = sum(flat_top[k] * R[abs(k)] for k in flat_top)
    G = sum(flat_top[k] * abs(k) * R[abs(k)] for k in flat_top)
    if g <= 0.0:
        return 1
    return int(
        min(np.ceil((2.0 * G**2 / (4.0 / 3.0 * g**2)) ** (1 / 3) * n ** (1 / 3)), np.ceil(min(3 * n**0.5, n / 3)))
    )


@pytest.mark.parametrize("n", [40, 333, 1000])
@pytest.mark.parametrize("phi", [-0.6, 0.0, 0.4, 0.8])
def test_the_block_is_that_of_the_published_formula(n: int, phi: float) -> None:
    checked = 0
    for seed in range(10):
        x = autoregressive(n, phi, seed)
        length, ends = block_length(x)
        if ends:
            assert length == politis_and_white(x)
            checked += 1
    assert checked >= 4


def test_noise_that_takes_itself_back_needs_no_blocks() -> None:
    """Differences of noise: their autocovariances add up to about zero, and in some series to less."""
    for seed in range(20):
        x = np.diff(np.random.default_rng(seed).normal(size=101))
        assert block_length(x).length == politis_and_white(x)
    assert block_length(np.diff(np.random.default_rng(3).normal(size=101))) == (1, True)


def test_ten_values_are_looked_at_and_nine_are_too_few() -> None:
    assert block_length(np.arange(9.0)).length == 1
    assert block_length(np.arange(10.0)).length == politis_and_white(np.arange(10.0)) == 2


def test_ten_blocks_are_reliable_and_nine_are_not() -> None:
    noise = np.random.default_rng(0).normal(size=100)
    for block, enough in ((10, True), (11, False)):
        attrs = compare.error_statistics(noise, block=block, repetitions=5, confidence=0.5).attrs
        assert attrs == {"block": block, "blocks": 100 / block, "confidence": 0.5, "reliable": enough, "missing": 0}
    assert compare.rmse_difference(np.full(10, 2.0), np.ones(10)).reliable
    assert not compare.rmse_difference(np.full(9, 2.0), np.ones(9)).reliable


@pytest.mark.parametrize(("n", "block"), [(10_000, 2), (10_001, 3)])
def test_a_series_has_five_thousand_blocks_at_most(n: int, block: int) -> None:
    assert compare.error_statistics(np.ones(n), repetitions=1).attrs["block"] == block
    assert compare.rmse_difference(np.full(n, 2.0), np.ones(n), repetitions=1).block == block


def test_the_table_of_statistics_is_named() -> None:
    table = compare.error_statistics([1.0, 3.0], repetitions=50)
    assert table.index.name == "statistic"
    assert table.index.tolist() == ["rmse", "mean", "median", "std", "p95", "min", "max", "sse", "n"]
    assert table.columns.tolist() == ["value", "low", "high"]
    assert table["value"].tolist() == pytest.approx([5**0.5, 2.0, 2.0, 1.0, 2.9, 1.0, 3.0, 10.0, 2.0])
    # Two values in blocks of one: (1, 1), (1, 3), (3, 1) and (3, 3) are drawn.
    assert table.loc["mean", ["low", "high"]].tolist() == [1.0, 3.0]
    assert table.loc["std", ["low", "high"]].tolist() == [0.0, 1.0]


def test_an_interval_leaves_out_the_same_share_at_both_ends() -> None:
    drawn = np.arange(101.0)[:, None] * [1.0, -1.0]
    np.testing.assert_allclose(percentile_interval(drawn, 0.5), [[25.0, -75.0], [75.0, -25.0]])
    np.testing.assert_allclose(percentile_interval(drawn), [[2.5, -97.5], [97.5, -2.5]])
    errors, others = np.random.default_rng(4).normal(size=(2, 60))
    wide, narrow = (compare.rmse_difference(errors, others, confidence=c) for c in (0.95, 0.5))
    assert wide.low < narrow.low < narrow.high < wide.high
    again, other = (compare.rmse_difference(errors, others, confidence=0.5, seed=s) for s in (0, 1))
    assert narrow == again != other


def test_moments_that_one_of_the_two_lacks_are_left_out() -> None:
    found = compare.rmse_difference([3.0, np.nan, 3.0, 3.0], [1.0, 1.0, np.nan, 1.0])
    assert (found.value, found.low, found.high, found.block) == (2.0, 2.0, 2.0, 1)
    assert found.settled
    with pytest.raises(InputError, match="same n stamps"):
        compare.rmse_difference([[1.0]], [[1.0]])


@pytest.mark.parametrize(
    ("low", "high", "settled"), [(0.1, 2.0, True), (-2.0, -0.1, True), (0.0, 2.0, False), (-2.0, 0.0, False)]
)
def test_an_interval_that_touches_zero_has_no_sign(low: float, high: float, settled: bool) -> None:
    value = 1.0 if low + high > 0.0 else -1.0
    assert compare.RmseDifference(value, low, high, 1, 100.0, True).settled == settled


def test_looking_at_a_few_draws_at_a_time_changes_nothing() -> None:
    x = np.random.default_rng(5).normal(size=120_000)
    draws = draw_blocks(len(x), 1000, 9, seed=2)  # four of them at a time
    one_by_one = [BlockDraws(draws.start[k : k + 1], draws.length) for k in range(9)]
    np.testing.assert_array_equal(
        draws.quantiles(x, (0.5, 0.95)), np.concatenate([one.quantiles(x, (0.5, 0.95)) for one in one_by_one])
    )
    assert (len(draws), draws.n) == (9, 120_000)
    short = draw_blocks(2000, 1, 600, seed=3)  # 250 at a time
    sums = short.sums(x[:2000, None])
    np.testing.assert_allclose(sums[:, 0], x[short.start].sum(axis=1), atol=1e-9)


@given(
    values=st.lists(st.sampled_from([0.0, 1.0, 1.5, 4.0, 9.0]) | st.floats(-1e3, 1e3), min_size=2, max_size=60),
    block=st.integers(1, 60),
    draws=st.sampled_from([1, 2, 9, 50, 200]),
    at=st.sampled_from([0.0, 0.3, 0.5, 0.95, 1.0]),
    confidence=st.sampled_from([0.5, 0.95, 0.999]),
)
def test_the_interval_of_a_quantile_is_that_of_all_its_draws(
    values: list[float], block: int, draws: int, at: float, confidence: float
) -> None:
    x = np.array(values)
    drawn = draw_blocks(len(x), min(block, len(x)), draws, seed=5)
    all_of_them = percentile_interval(drawn.quantiles(x, (at,)), confidence)[:, 0]
    np.testing.assert_allclose(drawn.quantile_interval(x, at, confidence), all_of_them, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("n", "block"), [(5000, 200), (5000, 1), (20_000, 4)])
def test_the_interval_of_a_quantile_of_long_series(n: int, block: int) -> None:
    for x in (autoregressive(n, 0.9, 1), np.abs(autoregressive(n, 0.5, 2).cumsum()), np.arange(n) // 100.0):
        drawn = draw_blocks(n, block, 300, seed=1)
        for at in (0.5, 0.95):
            every = percentile_interval(drawn.quantiles(x, (at,)))[:, 0]
            np.testing.assert_allclose(drawn.quantile_interval(x, at), every, rtol=1e-12)
