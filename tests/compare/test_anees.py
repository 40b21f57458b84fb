"""NEES over many runs lies in its bounds for estimates that know their errors, and outside for those that do not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import compare
from fgbaseline.compare.consistency.covariance import CovarianceState
from fgbaseline.compare.statistics.chi_square import chi_square_bounds, p_value, share_inside_bounds
from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, se3

FRAMES, RUNS = 40, 50


def random_walk(seed: int, claimed: float = 1.0) -> tuple[Estimate, Truth]:
    """A path whose error is a random walk of known covariance, of which it claims a multiple (in sigmas)."""
    random = np.random.default_rng(seed)
    step = np.diag(np.repeat([1e-4, 1e-6], 3))
    walk = np.cumsum(random.normal(size=(FRAMES, 6)) @ np.sqrt(step), axis=0)
    P: FloatArray = np.arange(1, FRAMES + 1)[:, None, None] * step
    poses = se3.compose(se3.exp(np.tile([0.5, 0.0, 0.0, 0.0, 0.0, 0.05], (FRAMES - 1, 1))))
    estimate = Estimate("filter", poses, np.zeros(0, dtype=np.bool_), covariance=claimed**2 * P)
    return estimate, Truth(poses @ se3.exp(walk))


def runs(claimed: float = 1.0) -> list[tuple[Estimate, Truth]]:
    return [random_walk(seed, claimed) for seed in range(RUNS)]


def test_consistent_runs_stay_in_the_bounds_and_overconfident_ones_do_not() -> None:
    honest, sure, timid = (compare.anees(runs(claimed)) for claimed in (1.0, 0.8, 1.25))
    inside = (honest["anees"] >= honest["low"]) & (honest["anees"] <= honest["high"])
    assert inside.mean() > 0.8  # 0.95 on average, but the frames of a run are correlated
    assert honest["anees"].mean() == pytest.approx(6.0, rel=0.08)
    assert (sure["anees"] > sure["high"]).mean() > 0.9
    assert (timid["anees"] < timid["low"]).mean() > 0.9
    assert (honest["runs"] == RUNS).all()


def test_the_bounds_are_those_of_the_textbook() -> None:
    low, high = chi_square_bounds(6.0, 50)
    assert (float(low), float(high)) == pytest.approx(tuple(chi2.ppf([0.025, 0.975], 300) / 50))
    np.testing.assert_allclose(p_value(np.array([3.0, 9.0]), 6.0), chi2.sf([3.0, 9.0], 6))
    drawn = np.random.default_rng(2).chisquare(6, 20000)
    assert share_inside_bounds(drawn, 6.0) == pytest.approx(0.95, abs=0.005)
    assert share_inside_bounds(drawn, 6.0, 0.5) == pytest.approx(0.5, abs=0.01)
    assert np.isnan(share_inside_bounds(np.array([np.nan]), 6.0))


def test_runs_that_end_early_count_where_they_are() -> None:
    short = random_walk(1)[0]
    poses = short.world_T_imu.copy()
    poses[10:] = np.nan
    table = compare.anees([random_walk(0), (replace(short, world_T_imu=poses), random_walk(1)[1])])
    assert table["runs"].tolist() == [2] * 10 + [1] * (FRAMES - 10)
    assert compare.anees([]).empty


def test_position_and_rotation_are_judged_apart() -> None:
    estimate, truth = random_walk(3)
    assert estimate.covariance is not None
    P = estimate.covariance.copy()
    P[:, 3:, 3:] /= 100.0
    table = compare.nees_table(replace(estimate, covariance=P), truth)
    honest = compare.nees_table(estimate, truth)
    np.testing.assert_allclose(table["position"], honest["position"])
    np.testing.assert_allclose(table["rotation"], 100.0 * honest["rotation"])
    np.testing.assert_allclose(honest["pose"], honest["position"] + honest["rotation"])


def test_a_covariance_is_held_absent_or_not_positive_definite() -> None:
    estimate, _ = random_walk(0)
    assert estimate.covariance is not None
    P = estimate.covariance.copy()
    P[0] = 0.0
    P[1] = -P[1]
    P[2, 0, 1] = P[2, 0, 0]  # not symmetric
    P[3, 0, 0] = np.nan
    P[4] *= 1e-9  # small in every direction is no defect as long as it is above what counts as held
    P[5, 0, 1] = P[5, 1, 0] = 2.0 * P[5, 0, 0]
    state = compare.covariance_state(replace(estimate, covariance=P))
    S = CovarianceState
    bad = S.NOT_POSITIVE_DEFINITE
    assert state[:6].tolist() == [S.HELD, bad, bad, S.ABSENT, S.HELD, bad]
    assert (state[6:] == S.POSITIVE_DEFINITE).all()
    assert (compare.covariance_state(replace(estimate, covariance=None)) == S.ABSENT).all()


def test_the_first_pose_alone_may_have_a_fixed_position_and_an_uncertain_rotation() -> None:
    estimate, _ = random_walk(0)
    assert estimate.covariance is not None
    P = estimate.covariance.copy()
    P[:2] = 0.0
    P[:2, 3:5, 3:5] = 1e-4 * np.eye(2)  # tilt; heading is fixed
    state = compare.covariance_state(replace(estimate, covariance=P))
    assert state[:2].tolist() == [CovarianceState.PARTLY_HELD, CovarianceState.NOT_POSITIVE_DEFINITE]
    sigma = compare.pose_sigma(replace(estimate, covariance=P))
    assert sigma.position[0] == 0.0
    np.testing.assert_allclose(sigma.rotation_deg[0], np.rad2deg(np.sqrt(2e-4)))
    for bad in (-1e-4, np.inf):
        P[0, 5, 5] = bad
        assert compare.covariance_state(replace(estimate, covariance=P))[0] in (
            CovarianceState.ABSENT,
            CovarianceState.NOT_POSITIVE_DEFINITE,
        )


def test_nees_shows_a_rigid_motion_that_an_alignment_would_remove() -> None:
    """Truth and estimate differ by one rigid motion: after alignment the error is zero, and NEES must show it."""
    estimate, _ = random_walk(0)
    turned = se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, 0.3]) @ estimate.world_T_imu
    values = compare.nees(estimate, Truth(turned))
    assert np.nanmin(values) > 100.0
    error = compare.body_error(estimate, Truth(estimate.world_T_imu @ se3.exp([0.1, 0, 0, 0, 0, 0.2])))
    np.testing.assert_allclose(error, np.tile([0.1, 0, 0, 0, 0, 0.2], (FRAMES, 1)), atol=1e-12)
