"""The recorded NIS is nu^T S^-1 nu, and chi-square where the assumed noise is the true one."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline.data import HuberKernel
from fgbaseline.ekf import ekf, joint_ekf
from fgbaseline.ekf.joint.update import CholeskyFactor, NotPositiveDefiniteError
from fgbaseline.ekf.nis import decoupled_nis
from fgbaseline.geometry import se3

from ..builders.synthetic import Scene, first_innovation, plain_problem


def test_the_norm_of_a_joint_innovation_is_that_of_dense_algebra() -> None:
    random = np.random.default_rng(1)
    A = random.normal(size=(12, 20))
    residual, variance = random.normal(size=(4, 3)), np.array([0.4, 0.4, 0.2])
    HPHt = A @ A.T
    before = HPHt.copy()
    expected = residual.reshape(-1) @ np.linalg.solve(HPHt + np.diag(np.tile(variance, 4)), residual.reshape(-1))
    assert CholeskyFactor.of(HPHt, residual, variance).nis == pytest.approx(expected, rel=1e-12)
    np.testing.assert_array_equal(HPHt, before)
    with pytest.raises(NotPositiveDefiniteError):
        CholeskyFactor.of(-HPHt, residual, variance)


@pytest.mark.parametrize(("used", "lower"), [(6, 0), (6, 2), (6, 6), (4, 0), (4, 1), (4, 4)])
def test_the_factor_of_a_frame_gives_that_of_its_first_observations_with_more_noise_in_some(
    used: int, lower: int
) -> None:
    random = np.random.default_rng(2)
    A, residual, variance = random.normal(size=(18, 30)), random.normal(size=(6, 3)), np.array([0.4, 0.4, 0.2])
    added = random.uniform(0.1, 5.0, (lower, 3))
    noise = variance + np.concatenate([np.zeros((used - lower, 3)), added])
    expected = CholeskyFactor.of((A @ A.T)[: 3 * used, : 3 * used], residual[:used], noise)
    factor = CholeskyFactor.of(A @ A.T, residual, variance).reweighted(residual[:used], added)
    np.testing.assert_allclose(np.tril(factor.L), np.tril(expected.L), rtol=0, atol=1e-12)
    np.testing.assert_allclose(factor.whitened, expected.whitened, rtol=0, atol=1e-12)


def test_the_norm_with_known_landmarks_is_that_of_dense_algebra() -> None:
    pose = se3.exp([0.05, 0.02, -0.03, 0.01, 0.0, 0.02])
    innovation = first_innovation(Scene().sequence(), pose)
    A = np.random.default_rng(3).normal(size=(6, 6)) * 0.05
    sigma = A @ A.T
    three = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, 0.5, 0, 0.5]])
    H, nu = (three @ innovation.jacobian).reshape(-1, 6), (innovation.residual @ three.T).reshape(-1)
    S = H @ sigma @ H.T + 0.25 * np.diag(np.tile([1.0, 1.0, 0.5], 12))
    assert decoupled_nis(innovation, sigma) == pytest.approx(nu @ np.linalg.solve(S, nu), rel=1e-9)


def test_a_covariance_that_is_not_finite_has_no_nis() -> None:
    innovation = first_innovation(Scene().sequence(), np.eye(4))
    assert np.isnan(decoupled_nis(innovation, np.full((6, 6), np.nan)))


@pytest.mark.parametrize("assumed", [1.0, 0.5])
def test_the_joint_filter_s_innovations_are_chi_square_only_with_the_true_noise(assumed: float) -> None:
    total, degrees = 0.0, 0
    for seed in range(8):
        scene = Scene(seed=seed, frames=12)
        innovations = joint_ekf(plain_problem(scene.sequence(), pixel_sigma=assumed * scene.sigma_pixel)).innovations
        assert innovations is not None
        assert np.isnan(innovations.nis[0])  # nothing was known before
        total += np.nansum(innovations.nis)
        degrees += int(innovations.degrees.sum())
    assert degrees == 8 * 11 * 12 * 3
    low, high = chi2.ppf([0.001, 0.999], degrees)
    assert (low < total < high) == (assumed == 1.0)


@pytest.mark.parametrize("estimator", [ekf, joint_ekf])
def test_the_nis_is_taken_before_the_robust_kernel(estimator: object) -> None:
    assert callable(estimator)
    problem = plain_problem(Scene(frames=3).sequence())
    plain, robust = (estimator(replace(problem, kernel=k)).innovations for k in (None, HuberKernel(1e-3)))
    assert plain.nis[1] == pytest.approx(robust.nis[1], rel=1e-12)
    np.testing.assert_array_equal(plain.degrees, [0, 36, 36])
