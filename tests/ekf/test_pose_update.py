"""PredictedState and pose update of the filter: their Jacobians, and what the covariance does."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import data, ekf
from fgbaseline.data.simulate import KITTI
from fgbaseline.ekf.motion_model import BodyState, PredictedState, VelocityMotion
from fgbaseline.ekf.pose_update import (
    PoseInnovation,
    pose_innovation,
    pose_posterior,
    standard_form_covariance,
)
from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, se3

from ..builders.dense_filter import DenseFilter
from ..builders.synthetic import Scene, drive, plain_problem

CAM_T_IMU = se3.inverse(KITTI.imu_T_cam)
V = 15.0
PRINTED = MeasurementModel(KITTI.camera, V)
SEEDS = st.integers(0, 2**32 - 1)


def sight(random: np.random.Generator, n: int = 8) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A pose, n points in front of it and the pixels they were measured at."""
    world_T_imu = se3.exp(np.r_[random.normal(size=3) * 20.0, random.normal(size=3)])
    in_camera = np.column_stack([random.uniform(-8.0, 8.0, (n, 2)), random.uniform(4.0, 40.0, n)])
    points = se3.transform(world_T_imu @ KITTI.imu_T_cam, in_camera)
    return world_T_imu, points, KITTI.camera.project(in_camera) + random.normal(size=(n, 4))


def covariance_of(random: np.random.Generator, scale: float = 1.0) -> FloatArray:
    A = random.normal(size=(6, 8))
    return scale * (A @ A.T)


@given(SEEDS)
def test_the_pose_jacobian_is_the_slope_along_the_right_perturbation(seed: int) -> None:
    world_T_imu, points, pixel = sight(np.random.default_rng(seed))
    H = pose_innovation(PRINTED, CAM_T_IMU, world_T_imu, points, pixel).jacobian

    def predicted(delta: FloatArray) -> FloatArray:
        return pixel - pose_innovation(PRINTED, CAM_T_IMU, world_T_imu @ se3.exp(delta), points, pixel).residual

    h = 1e-5
    slope = np.stack([(predicted(h * e) - predicted(-h * e)) / (2.0 * h) for e in np.eye(6)], axis=2)
    np.testing.assert_allclose(H, slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max())


@given(SEEDS)
def test_the_posterior_is_that_of_the_printed_gain(seed: int) -> None:
    random = np.random.default_rng(seed)
    innovation = pose_innovation(PRINTED, CAM_T_IMU, *sight(random))
    sigma = covariance_of(random, 0.01)
    posterior = pose_posterior(sigma, innovation, np.ones(8))
    H = innovation.jacobian.reshape(-1, 6)
    S = H @ sigma @ H.T + V * np.eye(32)
    gain = sigma @ H.T @ np.linalg.inv(S)
    expected = (np.eye(6) - gain @ H) @ sigma
    np.testing.assert_allclose(posterior.correction, gain @ innovation.residual.reshape(-1), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(posterior.covariance, expected, rtol=1e-6, atol=1e-9 * sigma.max())
    assert posterior.innovation_condition == pytest.approx(np.linalg.cond(S), rel=1e-6)


@given(SEEDS, st.floats(-3.0, 20.0), st.floats(-12.0, 6.0), st.integers(1, 12))
def test_a_posterior_covariance_is_positive_and_below_the_prior_for_any_jacobian(
    seed: int, log_jacobian: float, log_sigma: float, n: int
) -> None:
    random = np.random.default_rng(seed)
    # Points at all depths, some at the camera plane.
    rows = 10.0 ** random.uniform(-3.0, max(log_jacobian, -3.0), (n, 1, 1))
    H = rows * random.normal(size=(n, 4, 6))
    sigma = covariance_of(random, 10.0**log_sigma)
    innovation = PoseInnovation(random.normal(size=(n, 4)), H, np.full(4, V))
    posterior = pose_posterior(sigma, innovation, np.ones(n))
    S = posterior.covariance
    np.testing.assert_array_equal(S, S.T)
    assert np.isfinite(posterior.correction).all()
    unit = 1.0 / np.sqrt(np.diag(sigma))
    scale = unit[:, None] * unit[None, :]
    assert np.linalg.eigvalsh(S * scale)[0] > -1e-14
    assert np.linalg.eigvalsh((sigma - S) * scale)[0] > -1e-9
    # The noise of the next step makes it positive definite beyond doubt: the filter can go on.
    still = PredictedState(BodyState(np.eye(4), np.empty(0)), np.eye(6), 1e-6 * sigma)
    np.linalg.cholesky(still.covariance(S))


def test_an_observation_in_the_camera_plane_does_not_dominate_the_pose_update() -> None:
    random = np.random.default_rng(4)
    innovation = pose_innovation(PRINTED, CAM_T_IMU, *sight(random))
    sigma = covariance_of(random, 0.01)
    one = pose_posterior(sigma, innovation, np.ones(8))
    for size in (1e8, 1e12, 1e16):
        # Says exactly, but along one direction only, what is already known: nothing else may change.
        direction = random.normal(size=6)
        H = np.vstack([innovation.jacobian, np.zeros((1, 4, 6))])
        H[-1, 0] = size * direction
        r = np.vstack([innovation.residual, np.zeros((1, 4))])
        r[-1, 0] = H[-1, 0] @ one.correction
        both = pose_posterior(sigma, PoseInnovation(r, H, innovation.variance), np.ones(9))
        np.testing.assert_allclose(both.correction, one.correction, rtol=1e-6)
        known = one.covariance @ direction
        expected = one.covariance - np.outer(known, known) / (direction @ known)
        np.testing.assert_allclose(both.covariance, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_the_printed_covariance_is_the_same_until_rounding_makes_it_indefinite() -> None:
    random = np.random.default_rng(5)
    innovation = pose_innovation(PRINTED, CAM_T_IMU, *sight(random))
    sigma, weight = covariance_of(random, 0.01), np.ones(8)
    ours, printed = (
        pose_posterior(sigma, innovation, weight).covariance,
        standard_form_covariance(sigma, innovation, weight),
    )
    np.testing.assert_allclose(printed, ours, rtol=0.0, atol=1e-9 * sigma.max())
    innovation.jacobian[0] *= 1e8
    ours = pose_posterior(sigma, innovation, weight).covariance
    assert np.linalg.eigvalsh(ours)[0] > -1e-16 * sigma.max()
    try:
        printed = standard_form_covariance(sigma, innovation, weight)
    except np.linalg.LinAlgError:
        return  # on some processors rounding leaves H Sigma H^T + V no inverse at all
    assert np.linalg.eigvalsh(0.5 * (printed + printed.T))[0] < 0.0


@given(SEEDS)
def test_observations_of_no_weight_change_nothing(seed: int) -> None:
    random = np.random.default_rng(seed)
    innovation = pose_innovation(PRINTED, CAM_T_IMU, *sight(random))
    sigma = covariance_of(random)
    posterior = pose_posterior(sigma, innovation, np.zeros(8))
    np.testing.assert_allclose(posterior.covariance, sigma, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(posterior.correction, 0.0)


def test_an_indefinite_covariance_is_refused() -> None:
    innovation = pose_innovation(PRINTED, CAM_T_IMU, *sight(np.random.default_rng(0)))
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        pose_posterior(np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1e-3]), innovation, np.ones(8))
    innovation.jacobian[0, 0, 0] = np.inf
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        pose_posterior(np.eye(6), innovation, np.ones(8))


@given(SEEDS)
def test_prediction_is_equation_9(seed: int) -> None:
    random = np.random.default_rng(seed)
    sigma, W = covariance_of(random), covariance_of(random)
    problem = replace(
        data.documented(drive()), increment=random.normal(size=(1, 6)), increment_covariance=np.array([W])
    )
    _, expected = DenseFilter(problem).predict(0, np.eye(4), sigma)
    actual = VelocityMotion(problem).predict(0, BodyState(np.eye(4), np.empty(0))).covariance(sigma)
    np.testing.assert_array_equal(actual, actual.T)
    np.testing.assert_allclose(actual, expected, rtol=1e-10, atol=1e-10)


def test_the_dead_reckoned_covariance_is_that_of_many_noisy_drives() -> None:
    problem = plain_problem(Scene(frames=40, sigma_velocity=(0.0, 0.0)).sequence())
    random, n = np.random.default_rng(3), 20_000
    steps = se3.exp(problem.increment)

    def noise(covariance: FloatArray) -> FloatArray:
        return se3.exp(random.standard_normal((n, 6)) @ np.linalg.cholesky(covariance).T)

    poses = problem.initial_pose @ noise(problem.initial_covariance)
    mean = problem.initial_pose
    for step, W in zip(steps, problem.increment_covariance, strict=True):
        poses, mean = poses @ step @ noise(W), mean @ step
    deviations = se3.log(se3.inverse(mean) @ poses)
    covariance = ekf.dead_reckoning(problem).covariance
    assert covariance is not None
    predicted = covariance[-1]
    L_inverse = np.linalg.inv(np.linalg.cholesky(predicted))
    whitened = deviations @ L_inverse.T
    # A sample covariance of n draws is off by about sqrt(2 / n) = 0.01.
    np.testing.assert_allclose(np.cov(whitened.T), np.eye(6), atol=0.05)


@given(SEEDS, st.floats(0.5, 5.0))
def test_the_kernel_lowers_the_weight_beyond_its_threshold_only(seed: int, threshold: float) -> None:
    random = np.random.default_rng(seed)
    world_T_imu, points, pixel = sight(random)
    pixel[::2] += 100.0 * random.normal(size=pixel[::2].shape)
    kernel, sigma = HuberKernel(threshold), covariance_of(random, 1e-4)
    innovation = pose_innovation(MeasurementModel(KITTI.camera, 2.25, kernel), CAM_T_IMU, world_T_imu, points, pixel)
    weight = kernel.weight(innovation.nis_per_observation(sigma))
    R = np.diag([2.25, 2.25, 1.125])
    for r, H, w in zip(innovation.residual, innovation.jacobian, weight, strict=True):
        whitened = np.sqrt(r @ np.linalg.inv(H @ sigma @ H.T + R) @ r)
        assert w == pytest.approx(min(1.0, threshold / whitened), rel=1e-6)
