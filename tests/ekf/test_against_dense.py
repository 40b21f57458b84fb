"""The cheap forms of `ekf/` are the printed equations: equal to a literal dense transcription, to 1e-8."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from fgbaseline import data, ekf
from fgbaseline.data import Estimate, LandmarkMode, Problem
from fgbaseline.geometry import FloatArray

from ..builders.dense_filter import Answer, DenseFilter
from ..builders.synthetic import drive

TOLERANCE = 1e-8

CASES = [("handheld", 25), ("handheld", None), ("town", 30), ("town", None), ("loop", None)]


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    with threadpool_limits(limits=1, user_api="blas"):
        yield


def posed(path: str, features: int | None, reading: LandmarkMode = LandmarkMode.UPDATED) -> Problem:
    """50 frames with 40 to 75 landmarks, of which `features` are chosen."""
    return data.documented(drive(path), features, reading)


def same_poses(actual: FloatArray, expected: FloatArray) -> None:
    scale = np.maximum(1.0, np.linalg.norm(expected[:, :3, 3], axis=1))[:, None, None]
    np.testing.assert_array_less(np.abs(actual - expected), TOLERANCE * scale * np.ones((4, 4)))


def same_covariances(actual: FloatArray, expected: FloatArray) -> None:
    """Relative to each matrix; and entry by entry to 1e-6, (I - K H) Sigma as printed having lost the other digits."""
    norm = np.linalg.norm(expected, axis=(1, 2))[:, None, None]
    np.testing.assert_array_less(np.abs(actual - expected), TOLERANCE * norm * np.ones_like(expected) + 1e-300)
    sigma = np.sqrt(np.einsum("nii->ni", expected))
    scale = sigma[:, :, None] * sigma[:, None, :]
    np.testing.assert_array_less(np.abs(actual - expected), 1e-6 * scale + 1e-300)


def same_landmarks(estimate: Estimate, problem: Problem, expected: Answer) -> None:
    m = len(problem.features)
    np.testing.assert_array_equal(estimate.landmarks.index, problem.features)
    np.testing.assert_allclose(estimate.landmarks.position, expected.m, rtol=TOLERANCE, atol=TOLERANCE)
    blocks = expected.sigma_m.reshape(m, 3, m, 3)
    own = blocks[np.arange(m), :, np.arange(m), :]
    assert estimate.landmarks.covariance is not None
    same_covariances(estimate.landmarks.covariance, own)
    # What the 3x3 blocks leave out is nothing: the 3M x 3M covariance is block diagonal.
    blocks[np.arange(m), :, np.arange(m), :] = 0.0
    assert not blocks.any()


@pytest.mark.parametrize(("path", "features"), CASES)
def test_dead_reckoning_is_equation_9(path: str, features: int | None) -> None:
    problem = posed(path, features)
    mu, sigma = DenseFilter(problem).dead_reckoning()
    estimate = ekf.dead_reckoning(problem)
    assert estimate.covariance is not None
    same_poses(estimate.world_T_imu, mu)
    same_covariances(estimate.covariance, sigma)


@pytest.mark.parametrize(("path", "features"), CASES)
def test_mapping_is_equations_11_and_12_along_the_dead_reckoned_path(path: str, features: int | None) -> None:
    problem = posed(path, features)
    expected = DenseFilter(problem).mapping()
    estimate = ekf.landmark_mapping(problem)
    same_poses(estimate.world_T_imu, expected.mu)
    same_landmarks(estimate, problem, expected)
    assert estimate.name == "landmark-mapping"
    assert estimate.covariance is not None
    same_covariances(estimate.covariance, DenseFilter(problem).dead_reckoning()[1])


def test_the_noise_of_the_map_is_its_own() -> None:
    problem = replace(posed("town", 20), mapping_pixel_variance=7.0, pixel_variance=3.0)
    same_landmarks(ekf.landmark_mapping(problem), problem, DenseFilter(problem).mapping())
    alone = ekf.landmark_mapping(replace(problem, mapping_pixel_variance=None))
    same_landmarks(alone, problem, DenseFilter(replace(problem, mapping_pixel_variance=3.0)).mapping())


@pytest.mark.parametrize("reading", LandmarkMode)
@pytest.mark.parametrize(("path", "features"), CASES)
def test_slam_is_equations_9_to_13(path: str, features: int | None, reading: LandmarkMode) -> None:
    problem = posed(path, features, reading)
    expected = DenseFilter(problem).slam()
    estimate = ekf.ekf(problem)
    assert estimate.status == "ok"
    assert estimate.covariance is not None
    same_poses(estimate.world_T_imu, expected.mu)
    same_covariances(estimate.covariance, expected.sigma)
    same_landmarks(estimate, problem, expected)


def test_the_readings_differ() -> None:
    in_turn, held = (ekf.ekf(posed("town", None, reading)) for reading in LandmarkMode)
    assert np.abs(in_turn.world_T_imu - held.world_T_imu).max() > 1e-3
    mapped = ekf.landmark_mapping(posed("town", None))
    np.testing.assert_array_equal(held.landmarks.position, mapped.landmarks.position)
    assert np.abs(in_turn.landmarks.position - mapped.landmarks.position).max() > 1e-3
