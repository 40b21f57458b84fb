"""NEES is 6 on average for errors drawn from the very covariance, and NaN where it is undefined."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import compare
from fgbaseline.compare.consistency.covariance import HELD, CovarianceState, is_positive_definite
from fgbaseline.compare.statistics.chi_square import chi_square_bounds, chi_square_quantile, share_inside_bounds
from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, se3

DRAWS = 4000


def drawn(scale: float = 1.0) -> tuple[Estimate, Truth]:
    """Poses whose errors are drawn from their covariances (times `scale` squared): T exp(e) is the true pose."""
    random = np.random.default_rng(11)
    A = random.normal(size=(DRAWS, 6, 6)) * np.repeat([0.1, 0.005], 3)[:, None]
    covariance = A @ np.swapaxes(A, 1, 2) + np.diag(np.repeat([1e-3, 1e-5], 3))
    error = np.einsum("tij,tj->ti", np.linalg.cholesky(covariance), random.normal(size=(DRAWS, 6)))
    poses = se3.exp(random.normal(size=(DRAWS, 6)))
    estimate = Estimate("filter", poses, np.zeros(0, dtype=np.bool_), covariance=covariance)
    return estimate, Truth(poses @ se3.exp(scale * error))


def test_errors_drawn_from_the_covariance_have_a_nees_of_six() -> None:
    values = compare.nees(*drawn())
    low, high = chi2.ppf([0.001, 0.999], 6 * DRAWS) / DRAWS
    assert low < np.mean(values) < high
    assert np.mean(values < chi2.ppf(0.95, 6)) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_errors_of_another_size_change_it_by_the_square(scale: float) -> None:
    np.testing.assert_allclose(compare.nees(*drawn(scale)), scale**2 * compare.nees(*drawn()), rtol=1e-6)


def test_nees_is_nan_without_truth_pose_or_definite_covariance() -> None:
    estimate, truth = drawn()
    assert estimate.covariance is not None
    poses, P, true = estimate.world_T_imu.copy(), estimate.covariance.copy(), truth.world_T_imu.copy()
    P[0] = 0.0
    true[1] = np.nan
    poses[2] = np.nan
    P[3, 0, 0] = np.nan
    P[4] = -P[4]
    P[5, 5, :] = P[5, :, 5] = 0.0
    values = compare.nees(replace(estimate, world_T_imu=poses, covariance=P), Truth(true))
    assert np.isnan(values[:6]).all()
    np.testing.assert_array_equal(values[6:], compare.nees(estimate, truth)[6:])


def test_an_estimate_without_covariance_has_none() -> None:
    estimate, truth = drawn()
    assert np.isnan(compare.nees(replace(estimate, covariance=None), truth)).all()


def test_a_rigid_motion_of_the_world_changes_no_metric() -> None:
    estimate, truth = drawn()
    motion: FloatArray = se3.exp([5.0, -3.0, 2.0, 0.4, 1.0, -2.0])
    moved = compare.nees(
        replace(estimate, world_T_imu=motion @ estimate.world_T_imu), Truth(motion @ truth.world_T_imu)
    )
    np.testing.assert_allclose(moved, compare.nees(estimate, truth), rtol=1e-6)


def test_the_ratio_of_sigmas_is_that_of_the_roots_of_the_variances() -> None:
    estimate, _ = drawn()
    assert estimate.covariance is not None
    larger = estimate.covariance * np.kron(np.array([[4.0, 1.0], [1.0, 0.25]]), np.ones((3, 3)))
    larger[0], larger[1] = 0.0, -larger[1]
    reference = replace(
        estimate, covariance=np.where(np.arange(DRAWS)[:, None, None] == 2, np.nan, estimate.covariance)
    )
    table = compare.sigma_ratio(replace(estimate, covariance=larger), reference)
    assert table.columns.tolist() == ["position", "rotation"]
    assert table.index.name == "frame"
    assert table.iloc[:3].isna().all(axis=None)  # held, no covariance, none in the reference
    np.testing.assert_allclose(table["position"][3:], 2.0)
    np.testing.assert_allclose(table["rotation"][3:], 0.5)
    for pair in ((replace(estimate, covariance=None), estimate), (estimate, replace(estimate, covariance=None))):
        assert compare.sigma_ratio(*pair).isna().all(axis=None)


def test_the_table_of_nees_has_a_row_for_each_frame() -> None:
    estimate, truth = drawn()
    for each in (estimate, replace(estimate, covariance=None)):
        table = compare.nees_table(each, truth)
        assert table.index.name == "frame"
        assert table.index.tolist() == list(range(DRAWS))
        assert table.columns.tolist() == ["pose", "position", "rotation"]


def test_an_error_is_nan_where_the_pose_or_the_truth_is() -> None:
    estimate, truth = drawn()
    poses, true = estimate.world_T_imu.copy(), truth.world_T_imu.copy()
    poses[0] = np.nan
    true[1] = np.nan
    error = compare.body_error(replace(estimate, world_T_imu=poses), Truth(true))
    assert np.isnan(error[:2]).all()
    assert np.isfinite(error[2:]).all()


@pytest.mark.parametrize(
    ("matrix", "is_one"),
    [
        ([[1.0, 0.5], [0.5, 1.0]], True),
        ([[1.0, 0.5], [0.5 + 5e-7, 1.0]], True),  # symmetric enough
        ([[1.0, 0.5], [0.5 + 2e-6, 1.0]], False),
        ([[1.0, 1.0], [1.0, 1.0]], False),
        ([[1.0, 1.0 - 1e-9], [1.0 - 1e-9, 1.0]], True),
        ([[1.0, 2.0], [2.0, 1.0]], False),
        ([[1.0, 0.0], [0.0, 0.0]], False),
        ([[1.0, 0.0], [0.0, -1.0]], False),
        ([[1e-20, 0.0], [0.0, 1e10]], True),  # units do not matter
        ([[1e-20, 2e-5], [2e-5, 1e10]], False),
    ],
)
def test_positive_definite_is_judged_by_correlations(matrix: list[list[float]], is_one: bool) -> None:
    assert is_positive_definite(np.array([matrix, np.eye(2).tolist()])).tolist() == [is_one, True]


def test_a_pose_is_held_up_to_a_variance_and_not_beyond() -> None:
    estimate, _ = drawn()
    P = np.tile(np.eye(6), (DRAWS, 1, 1))
    P[0] *= HELD
    P[1] *= 2.0 * HELD
    state = compare.covariance_state(replace(estimate, covariance=P))
    assert state[:2].tolist() == [CovarianceState.HELD, CovarianceState.POSITIVE_DEFINITE]


def test_bounds_hold_with_the_probability_that_is_asked_for() -> None:
    low, high = chi_square_bounds(3.0, 4, 0.5)
    assert (float(low), float(high)) == pytest.approx(tuple(chi2.ppf([0.25, 0.75], 12) / 4))
    assert tuple(map(float, chi_square_bounds(3))) == pytest.approx(tuple(chi2.ppf([0.025, 0.975], 3)))
    assert float(chi_square_quantile(0.9, 2)) == pytest.approx(chi2.ppf(0.9, 2))
    # A value that is not finite takes no part; each is held against its own degrees of freedom.
    assert share_inside_bounds(
        np.array([3.0, 3.0, 300.0, np.nan]), np.array([3.0, 300.0, 300.0, 3.0])
    ) == pytest.approx(2 / 3)
