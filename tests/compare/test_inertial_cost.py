"""Cost of raw inertial samples and of the start: GTSAM's factor as a witness, chi-square at the truth, known steps."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest

from fgbaseline.compare.residuals.cost import cost, motion_squares
from fgbaseline.compare.residuals.inertial_cost import inertial_residuals, start_square
from fgbaseline.compare.residuals.noise_scale import motion_scale
from fgbaseline.data import Estimate, Problem
from fgbaseline.geometry import se3, strapdown

from ..builders.inertial import inertial_problem

PROBLEM = inertial_problem(2, n_frames=12)


def truth_of(problem: Problem) -> Estimate:
    """The true states as an estimate."""
    truth = problem.sequence.truth
    assert truth is not None
    return Estimate(
        "true",
        truth.world_T_imu,
        np.zeros(len(problem.sequence.observations), np.bool_),
        velocity=truth.velocity,
        gyroscope_bias=truth.gyroscope_bias,
        accelerometer_bias=truth.accelerometer_bias,
    )


def predicted(problem: Problem) -> Estimate:
    """The start, carried on by the samples alone."""
    imu, start = problem.imu, problem.start
    assert imu is not None
    assert start is not None
    poses, velocities = [problem.initial_pose], [start.velocity]
    for k in range(problem.n_frames - 1):
        motion = imu.motion(k, start.gyroscope_bias, start.accelerometer_bias)
        pose, velocity = strapdown.predict(poses[-1], velocities[-1], motion, imu.gravity_vector)
        poses.append(pose)
        velocities.append(velocity)
    T = problem.n_frames
    return replace(
        truth_of(problem),
        world_T_imu=np.array(poses),
        velocity=np.array(velocities),
        gyroscope_bias=np.tile(start.gyroscope_bias, (T, 1)),
        accelerometer_bias=np.tile(start.accelerometer_bias, (T, 1)),
    )


def test_dead_reckoning_from_the_start_costs_nothing_and_a_known_step_its_square() -> None:
    estimate, imu, start = predicted(PROBLEM), PROBLEM.imu, PROBLEM.start
    assert imu is not None
    assert start is not None
    assert estimate.velocity is not None
    none = np.zeros(len(estimate.used), np.bool_)
    assert cost(PROBLEM, estimate, none) == pytest.approx(0.0, abs=1e-12)
    step = np.array([0.02, -0.01, 0.03])
    last = estimate.velocity.copy()
    last[-1] += step
    covariance = inertial_residuals(imu, estimate)[1][-1]
    expected = step @ np.linalg.inv(covariance)[6:9, 6:9] @ step
    assert cost(PROBLEM, replace(estimate, velocity=last), none) == pytest.approx(0.5 * float(expected), rel=1e-6)


def test_the_start_costs_by_its_covariance_and_nothing_along_what_it_holds() -> None:
    estimate, start = predicted(PROBLEM), PROBLEM.start
    assert start is not None
    assert start.free_directions.shape == (15, 11)
    up = PROBLEM.initial_pose[2, :3]
    tilt = np.cross(up, [1.0, 0.0, 0.0])
    tilt *= 0.02 / np.linalg.norm(tilt)
    poses = estimate.world_T_imu.copy()
    poses[0] = poses[0] @ se3.exp(np.concatenate([np.zeros(3), tilt]))
    tilted = replace(estimate, world_T_imu=poses)
    assert start_square(PROBLEM, start, tilted) == pytest.approx(0.02**2 / 0.01**2, rel=1e-3)  # its up is the true one
    assert estimate.velocity is not None
    faster = replace(estimate, velocity=estimate.velocity + np.array([0.1, 0.0, 0.0]))
    assert start_square(PROBLEM, start, faster) == pytest.approx(0.1**2 / 0.05**2, rel=1e-6)
    assert np.isnan(start_square(PROBLEM, start, replace(estimate, velocity=None)))


def test_the_squares_are_those_of_gtsams_combined_factor() -> None:
    """GTSAM measures the position's error along a chord, not the logarithm: a difference of second order."""
    imu, estimate = PROBLEM.imu, truth_of(PROBLEM)
    v, bg, ba = estimate.velocity, estimate.gyroscope_bias, estimate.accelerometer_bias
    assert imu is not None
    assert v is not None
    assert bg is not None
    assert ba is not None
    ours, theirs = motion_squares(PROBLEM, estimate), []
    for k in range(PROBLEM.n_frames - 1):
        density, walk, force_density, force_walk = imu.densities[k].tolist()
        params = gtsam.PreintegrationCombinedParams(imu.gravity_vector)
        params.setIntegrationCovariance(1e-20 * np.eye(3))
        params.setGyroscopeCovariance(density**2 * np.eye(3))
        params.setAccelerometerCovariance(force_density**2 * np.eye(3))
        params.setBiasOmegaCovariance(walk**2 * np.eye(3))
        params.setBiasAccCovariance(force_walk**2 * np.eye(3))
        biases = [gtsam.imuBias.ConstantBias(ba[i], bg[i]) for i in (k, k + 1)]
        samples = gtsam.PreintegratedCombinedMeasurementsG(params, biases[0])
        at = imu.pieces(k)
        for force, rate, dt in zip(imu.specific_force[at], imu.angular_velocity[at], imu.dt[at].tolist(), strict=True):
            samples.integrateMeasurement(force, rate, dt)
        factor = gtsam.GalileanCombinedImuFactor(0, 1, 2, 3, 4, 5, samples)
        values = gtsam.Values()
        for i in (0, 1):
            values.insert(2 * i, gtsam.Pose3(estimate.world_T_imu[k + i]))
            values.insert(2 * i + 1, v[k + i])
            values.insert(4 + i, biases[i])
        theirs.append(2.0 * factor.error(values))
    np.testing.assert_allclose(ours, theirs, rtol=0.02)


def test_the_true_states_have_a_motion_scale_of_one() -> None:
    """Each piece holds the mean of two neighboring samples, so the ends of an interval average: 5 % less variance."""
    scales = [motion_scale(p, truth_of(p)) for p in (inertial_problem(seed, n_frames=30) for seed in range(12))]
    assert np.sqrt(np.mean(np.square(scales))) == pytest.approx(1.0, abs=0.06)


def test_an_estimate_without_velocity_or_with_a_gap_has_no_cost() -> None:
    estimate = truth_of(PROBLEM)
    assert np.isnan(motion_squares(PROBLEM, replace(estimate, velocity=None))).all()
    gone = estimate.world_T_imu.copy()
    gone[5] = np.nan
    squares = motion_squares(PROBLEM, replace(estimate, world_T_imu=gone))
    assert np.flatnonzero(np.isnan(squares)).tolist() == [4, 5]
