"""NEES is 6 on average for errors drawn from the very covariance, and NaN where nothing can be said."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import compare
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


def test_it_is_nan_without_truth_pose_or_a_covariance_that_is_one() -> None:
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


def test_a_world_moved_as_a_whole_changes_nothing() -> None:
    estimate, truth = drawn()
    motion: FloatArray = se3.exp([5.0, -3.0, 2.0, 0.4, 1.0, -2.0])
    moved = compare.nees(
        replace(estimate, world_T_imu=motion @ estimate.world_T_imu), Truth(motion @ truth.world_T_imu)
    )
    np.testing.assert_allclose(moved, compare.nees(estimate, truth), rtol=1e-6)
