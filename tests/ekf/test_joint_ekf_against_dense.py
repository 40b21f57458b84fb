"""The joint filter is EKF-SLAM: equal to a literal dense one that marginalizes nothing and rejects nothing, to 1e-8."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from fgbaseline import ekf
from fgbaseline.data import Estimate, HuberKernel, LandmarkPrior, Observations, Problem, Sequence
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.ekf import GyroBiasPrior, JointSettings, LandmarkRepresentation, Linearization
from fgbaseline.geometry import FloatArray

from ..builders.dense_joint_filter import DenseJointFilter, Moment
from ..builders.synthetic import drive, matched

TOLERANCE = 1e-8
LONGER_THAN_ANY_GAP = 20
"""frames without an observation; landmarks whose tracks have ended are marginalized after them"""


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    with threadpool_limits(limits=1, user_api="blas"):
        yield


def returning() -> Sequence:
    """40 frames in a room where half of the points are lost and found again after half a second."""
    return simulate(
        Simulation(
            path="handheld",
            duration=4.0,
            features_per_frame=10.0,
            returning_share=0.5,
            return_after=0.5,
            track_length=5.0,
            wrong_share=0.0,
            seed=4,
        )
    )


def unmasked(sequence: Sequence) -> Problem:
    """Every observation takes part, gaps and all, without a kernel."""
    problem = matched(sequence)
    return replace(
        problem,
        kernel=None,
        excluded=np.zeros_like(problem.excluded),
        features=np.unique(sequence.observations.landmark),
    )


def with_prior(problem: Problem) -> Problem:
    """Some 10 cm of doubt about where each landmark truly is."""
    truth = problem.sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    off = 0.1 * np.random.default_rng(0).normal(size=(len(problem.features), 3))
    mean = truth.landmarks[problem.features] + off
    return replace(problem, landmark_prior=LandmarkPrior(mean, np.diag([0.01, 0.005, 0.02])))


def uncertain_start(problem: Problem) -> Problem:
    return replace(problem, initial_covariance=np.diag(np.repeat([1e-2, 1e-4], 3)))


def turning(problem: Problem) -> Problem:
    """The problem with a gyroscope that reads up to 0.04 rad/s at rest."""
    bias = problem.sequence.dt[:, None] * [0.02, -0.04, 0.03]
    return replace(problem, increment=problem.increment + np.hstack([np.zeros_like(bias), bias]))


def keeping(**settings: Any) -> JointSettings:
    return JointSettings(gate=None, unseen_frames=LONGER_THAN_ANY_GAP, **settings)


PROBLEMS = {
    "town, kernel": matched(drive("town", 2.5, 10.0)),
    "town, tight kernel": replace(matched(drive("town", 2.5, 10.0)), kernel=HuberKernel(1.0)),
    "town": unmasked(drive("town", 2.5, 10.0)),
    "town, prior": with_prior(unmasked(drive("town", 2.5, 10.0))),
    "loop, uncertain start": uncertain_start(matched(drive("loop", 2.5, 10.0))),
    "handheld": unmasked(drive("handheld", 2.5, 10.0)),
    "returning": unmasked(returning()),
    "returning, prior": with_prior(unmasked(returning())),
}


def same_covariance(actual: FloatArray, expected: FloatArray) -> None:
    """Relative to the matrix; and entry by entry to 1e-6, (I - K H) P as printed having lost the other digits."""
    difference = np.abs(actual - expected)
    np.testing.assert_array_less(difference, TOLERANCE * np.linalg.norm(expected) + 1e-300)
    sigma = np.sqrt(np.diag(expected))
    np.testing.assert_array_less(difference, 1e-6 * np.outer(sigma, sigma) + 1e-300)


def same_as_dense(problem: Problem, estimate: Estimate, moments: list[Moment]) -> None:
    assert estimate.covariance is not None
    assert estimate.landmarks.covariance is not None
    for k, moment in enumerate(moments):
        np.testing.assert_allclose(estimate.world_T_imu[k], moment.pose, rtol=0, atol=TOLERANCE)
        same_covariance(estimate.covariance[k], moment.covariance)
    np.testing.assert_array_equal(estimate.landmarks.index, problem.features)
    o = problem.observations()
    landmarks = estimate.landmarks
    for j, position, covariance in zip(landmarks.index, landmarks.position, estimate.landmarks.covariance, strict=True):
        marginalized = min(o.frame[o.landmark == j].max() + LONGER_THAN_ANY_GAP, len(moments) - 1)
        point, spread = moments[marginalized].landmarks[int(j)]
        np.testing.assert_allclose(position, point, rtol=TOLERANCE, atol=TOLERANCE)
        same_covariance(covariance, spread)


@pytest.mark.parametrize("linearization", Linearization)
@pytest.mark.parametrize("name", ["town, kernel", "loop, uncertain start", "returning", "town, prior"])
def test_with_a_gyroscope_bias_in_the_state_it_is_still_that_filter(name: str, linearization: Linearization) -> None:
    problem, prior = turning(PROBLEMS[name]), GyroBiasPrior(0.05, 0.003)
    estimate = ekf.joint_ekf(problem, settings=keeping(linearization=linearization, gyro_bias=prior))
    moments = DenseJointFilter(problem, linearization=linearization, gyro_bias=prior).run()
    same_as_dense(problem, estimate, moments)
    assert estimate.gyro_bias is not None
    assert np.abs(estimate.gyro_bias.mean[-1]).max() > 0.003
    for k, moment in enumerate(moments):
        np.testing.assert_allclose(estimate.gyro_bias.mean[k], moment.bias, rtol=0, atol=TOLERANCE)
        same_covariance(estimate.gyro_bias.covariance[k], moment.joint[6:9, 6:9])


@pytest.mark.parametrize("linearization", Linearization)
@pytest.mark.parametrize("coordinates", LandmarkRepresentation)
@pytest.mark.parametrize("name", PROBLEMS)
def test_poses_and_landmarks_are_those_of_the_filter_that_keeps_everything(
    name: str, coordinates: LandmarkRepresentation, linearization: Linearization
) -> None:
    problem = PROBLEMS[name]
    estimate = ekf.joint_ekf(problem, settings=keeping(coordinates=coordinates, linearization=linearization))
    assert estimate.status == "ok"
    assert estimate.events == ()
    np.testing.assert_array_equal(estimate.used, problem.mask)
    same_as_dense(problem, estimate, DenseJointFilter(problem, coordinates, linearization).run())


def test_a_landmark_observed_again_after_marginalization_is_a_new_one() -> None:
    problem = PROBLEMS["returning"]
    o = problem.observations()
    order = np.lexsort((o.frame, o.landmark))
    begins = (np.diff(o.landmark[order], prepend=-1) != 0) | (np.diff(o.frame[order], prepend=-1) > 1)
    stretch = np.empty(len(o), dtype=np.int64)
    stretch[order] = np.cumsum(begins) - 1
    n = int(stretch.max()) + 1
    assert n > len(problem.features)
    apart = replace(problem.sequence, observations=Observations(o.frame, stretch, o.pixel), n_landmarks=n, truth=None)
    several = replace(
        problem,
        sequence=apart,
        features=np.arange(n),
        excluded=np.zeros(len(o), dtype=np.uint8),
    )
    settings = JointSettings(gate=None, unseen_frames=0)
    ours, expected = ekf.joint_ekf(problem, settings=settings), ekf.joint_ekf(several, settings=settings)
    np.testing.assert_allclose(ours.world_T_imu, expected.world_T_imu, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(ours.covariance, expected.covariance, rtol=1e-6, atol=1e-12)


def test_a_landmark_that_is_observed_again_uses_its_prior_once() -> None:
    """One observation of a landmark, a frame without it, and one more: its estimate is the second observation's."""
    problem = PROBLEMS["returning, prior"]
    o = problem.observations()
    j = int(o.landmark[o.frame == 0][0])
    at = np.flatnonzero(o.landmark == j)
    later = at[o.frame[at] >= 2][0]
    assert problem.landmark_prior is not None
    sharp = replace(problem.landmark_prior, covariance=1e-12 * np.eye(3))
    excluded = np.where(np.isin(np.arange(len(o)), [at[0], later]), 0, 1).astype(np.uint8)
    two = replace(
        problem,
        landmark_prior=LandmarkPrior(sharp.mean[problem.feature_row(np.array([j]))], sharp.covariance),
        features=np.array([j]),
        excluded=excluded,
    )
    ends = [replace(two, excluded=np.where(np.arange(len(o)) == at[0], 0, 1).astype(np.uint8)), two]
    settings = JointSettings(gate=None, unseen_frames=0)
    one, both = (ekf.joint_ekf(problem, settings=settings) for problem in ends)
    np.testing.assert_array_equal(one.covariance, both.covariance)
