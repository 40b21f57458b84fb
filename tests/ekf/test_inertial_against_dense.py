"""The filters on raw inertial samples equal a literal dense one that shares no code with the strapdown equations."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from fgbaseline import ekf
from fgbaseline.data import Estimate, LandmarkMode, LandmarkPrior, Problem
from fgbaseline.data.problem.documented import average_back_projections
from fgbaseline.ekf import JointSettings, LandmarkRepresentation, Linearization
from fgbaseline.ekf.landmark_mapping import map_landmarks
from fgbaseline.geometry import FloatArray

from ..builders.dense_inertial_filter import DenseInertialDecoupledFilter, DenseInertialFilter
from ..builders.inertial import inertial_problem

TOLERANCE = 1e-8


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    with threadpool_limits(limits=1, user_api="blas"):
        yield


def few_landmarks(kernel: bool) -> Problem:
    """12 frames and every third landmark, so that the dense filter ends soon."""
    problem = inertial_problem(3, n_frames=12)
    problem = replace(problem, excluded=(problem.sequence.observations.landmark % 3 != 0).astype(np.uint8))
    problem = replace(problem, features=np.unique(problem.observations().landmark))
    return problem if kernel else replace(problem, kernel=None)


@pytest.mark.parametrize("kernel", [False, True], ids=["", "kernel"])
@pytest.mark.parametrize("coordinates", LandmarkRepresentation)
@pytest.mark.parametrize("linearization", Linearization)
def test_the_joint_filter_is_the_dense_one(
    linearization: Linearization, coordinates: LandmarkRepresentation, kernel: bool
) -> None:
    problem = few_landmarks(kernel)
    settings = JointSettings(coordinates, linearization, gate=None, disagreeing_share=None, unseen_frames=99)
    estimate = ekf.joint_ekf(problem, settings=settings)
    assert estimate.state_covariance is not None
    moments = DenseInertialFilter(problem, coordinates, linearization).run()
    for k, moment in enumerate(moments):
        np.testing.assert_allclose(estimate.world_T_imu[k], moment.pose, atol=TOLERANCE)
        np.testing.assert_allclose(additive(estimate)[k], moment.bias, atol=TOLERANCE)
        sigma = np.sqrt(np.maximum(np.diag(moment.joint)[:15], 1e-12))
        scale = np.outer(sigma, sigma)
        np.testing.assert_allclose(estimate.state_covariance[k] / scale, moment.joint[:15, :15] / scale, atol=1e-6)
    for j, point in zip(estimate.landmarks.index.tolist(), estimate.landmarks.position, strict=True):
        np.testing.assert_allclose(point, moments[-1].landmarks[j][0], rtol=1e-6, atol=TOLERANCE)


def test_dead_reckoning_is_the_dense_prediction() -> None:
    problem = few_landmarks(kernel=False)
    estimate, dense = ekf.dead_reckoning(problem), DenseInertialFilter(problem)
    assert estimate.state_covariance is not None
    assert estimate.covariance is not None
    for k in range(problem.n_frames - 1):
        dense.predict(k)
    np.testing.assert_allclose(estimate.world_T_imu[-1], dense.pose, atol=1e-11)
    np.testing.assert_allclose(additive(estimate)[-1], dense.bias, atol=1e-11)
    np.testing.assert_allclose(estimate.state_covariance[-1], dense.P, atol=1e-12)
    np.testing.assert_array_equal(estimate.covariance, estimate.state_covariance[:, :6, :6])


@pytest.mark.parametrize("reading", LandmarkMode)
def test_the_decoupled_filter_is_equations_11_to_13_on_the_inertial_state(reading: LandmarkMode) -> None:
    plain = few_landmarks(kernel=False)
    assert plain.sequence.truth is not None
    taken = plain.excluded == 0
    mean = average_back_projections(plain.sequence, plain.sequence.truth.world_T_imu, plain.features, taken)
    problem = replace(
        plain,
        landmark_prior=LandmarkPrior(mean, 0.2 * np.eye(3)),
        landmark_mode=reading,
        pixel_variance=15.0,
        mapping_pixel_variance=1.0,
    )
    dense, estimate = DenseInertialDecoupledFilter(problem), ekf.ekf(problem)
    expected = dense.slam()
    assert estimate.status == "ok"
    assert estimate.state_covariance is not None
    np.testing.assert_allclose(estimate.world_T_imu, expected.mu, atol=TOLERANCE)
    np.testing.assert_allclose(additive(estimate)[-1], dense.additive, atol=TOLERANCE)
    sigma = np.sqrt(np.einsum("nii->ni", expected.sigma)[1:])
    scale = sigma[:, :, None] * sigma[:, None, :]
    np.testing.assert_allclose(estimate.state_covariance[1:] / scale, expected.sigma[1:] / scale, atol=1e-6)
    np.testing.assert_allclose(estimate.landmarks.position, expected.m, rtol=1e-6)


def test_mapping_goes_along_inertial_dead_reckoning() -> None:
    problem = few_landmarks(kernel=False)
    estimate, path = ekf.landmark_mapping(problem), ekf.dead_reckoning(problem)
    np.testing.assert_array_equal(estimate.world_T_imu, path.world_T_imu)
    np.testing.assert_array_equal(additive(estimate), additive(path))
    along, _ = map_landmarks(problem, path.world_T_imu)
    np.testing.assert_array_equal(estimate.landmarks.position, along.mean)


def additive(estimate: Estimate) -> FloatArray:
    """(T, 9) velocity, gyroscope bias and accelerometer bias."""
    assert estimate.velocity is not None
    assert estimate.gyroscope_bias is not None
    assert estimate.accelerometer_bias is not None
    return np.concatenate([estimate.velocity, estimate.gyroscope_bias, estimate.accelerometer_bias], axis=1)
