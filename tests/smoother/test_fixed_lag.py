"""A fixed lag is iSAM2 where the window holds everything, near it otherwise, and forgets what it must."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest

from fgbaseline import smoother
from fgbaseline.data import HuberKernel, Observations, Status
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.measurement_model import three_rows
from fgbaseline.smoother import FixedLagSettings
from fgbaseline.smoother.errors import IndeterminateSystemError
from fgbaseline.smoother.fixed_lag.checkpointed_fixed_lag import CheckpointedFixedLag
from fgbaseline.smoother.graph.factors import FactorBuilder
from fgbaseline.smoother.graph.keys import distance_key, pose_key
from fgbaseline.smoother.isam2.settings import ISAM2Settings

from ..builders.synthetic import Scene, drive, matched, plain_problem, position_errors, with_pixels
from .test_isam2 import PROBLEMS, SCENE, flipped, truncated

TIGHT = ISAM2Settings(0.001, 0.0001, 0.0001)
LONG = FixedLagSettings(lag=1e3, isam2=TIGHT)


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_window_over_all_frames_ends_at_the_solution_of_isam2(name: str) -> None:
    problem = PROBLEMS[name]
    lagged, full = smoother.fixed_lag(problem, settings=LONG), smoother.isam2(problem)
    assert lagged.status is Status.OK
    np.testing.assert_array_equal(lagged.used, full.used)
    np.testing.assert_array_equal(lagged.landmarks.index, full.landmarks.index)
    # It has no final relinearization.
    assert lagged.covariance is not None
    assert full.covariance is not None
    assert_within(lagged.world_T_imu, full.world_T_imu, full.covariance, 0.4)
    sigma = np.sqrt(np.einsum("tii->ti", full.covariance))
    np.testing.assert_allclose(np.sqrt(np.einsum("tii->ti", lagged.covariance)), sigma, rtol=0.1, atol=1e-9)
    assert full.landmarks.covariance is not None
    assert lagged.landmarks.covariance is not None
    size = np.trace(full.landmarks.covariance, axis1=1, axis2=2)
    np.testing.assert_allclose(np.trace(lagged.landmarks.covariance, axis1=1, axis2=2), size, rtol=0.2)


def assert_within(poses: FloatArray, expected: FloatArray, covariance: FloatArray, sigmas: float) -> None:
    apart = np.abs(se3.log(se3.inverse(expected) @ poses))
    np.testing.assert_array_less(apart, sigmas * np.sqrt(np.einsum("tii->ti", covariance)) + 1e-5)


def test_a_fixed_lag_pose_is_that_of_its_last_frame_in_the_window() -> None:
    problem = replace(matched(drive(features_per_frame=30.0)), kernel=None)
    settings = FixedLagSettings(lag=1.05)
    estimate = smoother.fixed_lag(problem, settings=settings)
    assert estimate.covariance is not None
    for k in (5, 20, 30):
        # Frame k is in the window up to the tenth frame after it; nothing has been marginalized before frame 11.
        then = smoother.isam2(truncated(problem, k + 11))
        assert then.covariance is not None
        assert_within(estimate.world_T_imu[k][None], then.world_T_imu[k][None], then.covariance[k][None], 0.3)
        sigma = np.sqrt(np.diag(then.covariance[k]))
        np.testing.assert_allclose(np.sqrt(np.diag(estimate.covariance[k])), sigma, rtol=0.1)


def test_a_longer_lag_is_nearer_to_the_full_smoother() -> None:
    problem = matched(drive(seconds=8.0, features_per_frame=40.0))
    full = smoother.isam2(problem)
    apart = []
    for lag in (0.3, 1.0, 4.0):
        path = smoother.fixed_lag(problem, settings=FixedLagSettings(lag=lag)).world_T_imu
        apart.append(np.sqrt(np.mean((path - full.world_T_imu)[:, :3, 3] ** 2)))
    assert apart[0] > apart[1] > apart[2]


def test_a_landmark_that_is_observed_again_is_initialized_again() -> None:
    sequence = Scene(frames=30).sequence()
    o = sequence.observations
    gap = replace(sequence, observations=o.select((o.landmark != 3) | (o.frame < 6) | (o.frame >= 22)))
    problem = plain_problem(gap)
    estimate = smoother.fixed_lag(problem, settings=FixedLagSettings(lag=0.8))
    assert estimate.status is Status.OK
    assert estimate.used.all()
    assert 3 in estimate.landmarks.index
    assert sequence.truth is not None
    assert sequence.truth.landmarks is not None
    whole = smoother.fixed_lag(plain_problem(sequence), settings=FixedLagSettings(lag=0.8))
    np.testing.assert_allclose(estimate.world_T_imu, whole.world_T_imu, rtol=0, atol=0.1)


def test_observations_before_the_window_do_not_count_for_initialization() -> None:
    o = SCENE.observations
    rare = replace(SCENE, observations=o.select((o.landmark != 3) | (o.frame % 4 == 0)))
    estimate = smoother.fixed_lag(plain_problem(rare), settings=FixedLagSettings(lag=0.45))
    assert 3 not in estimate.landmarks.index
    assert 3 in smoother.fixed_lag(plain_problem(rare), settings=LONG).landmarks.index


def test_a_cheirality_violation_costs_that_landmark_alone() -> None:
    estimate = smoother.fixed_lag(flipped(5, slice(3, None)), settings=LONG)
    assert estimate.world_T_imu.shape == (10, 4, 4)
    assert np.isfinite(estimate.world_T_imu).all()
    assert 5 not in estimate.landmarks.index
    assert len(estimate.landmarks) == 11


def test_a_gap_longer_than_the_lag_is_bridged_by_the_motion() -> None:
    sequence = drive(features_per_frame=30.0)
    t = sequence.t.copy()
    t[25:] += 5.0
    velocity, rate = sequence.linear_velocity.copy(), sequence.angular_velocity.copy()
    velocity[24], rate[24] = velocity[24] / 51.0, rate[24] / 51.0
    problem = matched(replace(sequence, t=t, linear_velocity=velocity, angular_velocity=rate))
    estimate = smoother.fixed_lag(problem, settings=FixedLagSettings(lag=1.0))
    assert estimate.status is not Status.FAILED
    assert np.isfinite(estimate.world_T_imu).all()
    assert estimate.covariance is not None
    assert np.isfinite(estimate.covariance).all()


def test_without_observations_there_is_no_answer() -> None:
    estimate = smoother.fixed_lag(matched(replace(drive(), observations=Observations.none())))
    assert estimate.status is Status.FAILED


def test_frames_without_features_are_dead_reckoned() -> None:
    sequence = drive(features_per_frame=30.0)
    o = sequence.observations
    blind = replace(sequence, observations=o.select((o.frame < 15) | (o.frame > 40)))
    estimate = smoother.fixed_lag(matched(blind), settings=FixedLagSettings(lag=1.0))
    assert estimate.status is Status.OK
    assert position_errors(estimate, blind).max() < 2.0


def window(lag: float = 0.45) -> CheckpointedFixedLag:
    return CheckpointedFixedLag(lag, TIGHT, SCENE.camera.baseline)


PROBLEM = plain_problem(Scene(frames=12, n_points=6).sequence(), HuberKernel())
FACTORS = FactorBuilder(PROBLEM)


def near_key(landmark: int) -> int:
    return distance_key(landmark, 10.0)


def frame(k: int) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values, dict[int, float]]:
    truth, o = PROBLEM.sequence.truth, PROBLEM.observations()
    assert truth is not None
    assert truth.landmarks is not None
    graph, values, now = gtsam.NonlinearFactorGraph(), gtsam.Values(), 0.1 * k
    graph.push_back(FACTORS.pose_prior() if k == 0 else FACTORS.between(k - 1))
    values.insert(pose_key(k), gtsam.Pose3(truth.world_T_imu[k]))
    times = {pose_key(k): now}
    for i in np.flatnonzero(o.frame == k):
        key = near_key(int(o.landmark[i]))
        graph.push_back(FACTORS.observation(k, key, three_rows(o.pixel[i])))
        times[key] = now
        if k == 0:
            values.insert(key, truth.landmarks[o.landmark[i]])
    return graph, values, times


def everything(lag: CheckpointedFixedLag) -> dict[int, FloatArray]:
    values = lag.smoother.calculateEstimate()
    keys = lag.checkpoint.times
    return {key: values.atPose3(key).matrix() if key >= pose_key(0) else values.atPoint3(key) for key in keys}


def test_after_a_failed_update_the_window_is_restored_and_continues() -> None:
    smooth, troubled = window(), window()
    for k in range(12):
        if k in (3, 8, 9):
            before = everything(troubled)
            graph, values, times = frame(k)
            graph.push_back(FACTORS.observation(k, near_key(99), np.array([600.0, 590.0, 180.0])))
            values.insert(near_key(99), np.array([-500.0, 0.0, 0.0]))
            with pytest.raises(IndeterminateSystemError):
                troubled.update(graph, values, times | {near_key(99): 0.1 * k})
            after = everything(troubled)
            assert before.keys() == after.keys()
            for key, value in before.items():
                np.testing.assert_allclose(after[key], value, rtol=0, atol=1e-9)
        for lag in (smooth, troubled):
            lag.update(*frame(k))
    for key, value in everything(smooth).items():
        np.testing.assert_allclose(everything(troubled)[key], value, rtol=0, atol=0.03)


def test_a_marginalized_landmark_is_not_observed_again_and_its_information_stays() -> None:
    lag = window()
    for k in range(8):
        lag.update(*frame(k))
    gone = near_key(2)
    factors, values, times = frame(8)
    without = gtsam.NonlinearFactorGraph()
    for i in range(factors.size()):
        if gone not in factors.at(i).keys():  # noqa: SIM118
            without.push_back(factors.at(i))
    del times[gone]
    lag.update(without, values, times, {gone})
    stereo = [
        factor
        for i in range(lag.checkpoint.factors.size())
        if isinstance(factor := lag.checkpoint.factors.at(i), gtsam.GenericStereoFactor3D)
    ]
    assert stereo
    assert not any(gone in factor.keys() for factor in stereo)  # noqa: SIM118
    assert np.isfinite(everything(lag)[pose_key(8)]).all()


def test_the_covariances_of_some_are_those_of_all() -> None:
    lag = window()
    for k in range(8):
        lag.update(*frame(k))
    keys = list(lag.checkpoint.times)
    everyone = lag.checkpoint.covariances([[key] for key in keys])
    some = lag.checkpoint.covariances([[key] for key in keys[2:5]])
    assert list(some) == keys[2:5]
    for key, covariance in some.items():
        np.testing.assert_allclose(covariance, everyone[key], rtol=1e-6, atol=1e-12)


def test_a_flipped_pixel_pair_costs_no_frame() -> None:
    pixel = SCENE.observations.pixel.copy()
    pixel[37] = pixel[37][[2, 1, 0, 3]]
    estimate = smoother.fixed_lag(plain_problem(with_pixels(SCENE, pixel), HuberKernel()), settings=LONG)
    assert "frame without observations" not in {event.kind for event in estimate.events}
