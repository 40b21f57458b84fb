"""What an answer costs: half of the squares that the problem weighs, and none where it is no whole answer."""

from dataclasses import replace

import numpy as np
import pytest

from fgbaseline.compare.residuals.cost import cost
from fgbaseline.data import Estimate, HuberKernel, LandmarkPrior, Landmarks, Problem
from fgbaseline.geometry import se3

from ..builders.synthetic import Scene, plain_problem, with_pixels

PROBLEM: Problem = plain_problem(Scene(frames=5, n_points=4).sequence())
TAKEN = np.ones(len(PROBLEM.sequence.observations), dtype=np.bool_)


def exact() -> tuple[Problem, Estimate]:
    """A problem without noise, and its answer."""
    truth = PROBLEM.sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    o = PROBLEM.sequence.observations
    world_T_cam = truth.world_T_imu @ PROBLEM.sequence.imu_T_cam
    seen = se3.transform(se3.inverse(world_T_cam)[o.frame], truth.landmarks[o.landmark])
    sequence = with_pixels(PROBLEM.sequence, PROBLEM.sequence.camera.project(seen))
    increment = se3.log(se3.relative(truth.world_T_imu))
    landmarks = Landmarks(np.arange(4), truth.landmarks)
    problem = replace(PROBLEM, sequence=sequence, increment=increment)
    return problem, Estimate("true", truth.world_T_imu, TAKEN, landmarks=landmarks)


def test_the_truth_without_noise_costs_nothing_and_each_residual_its_square() -> None:
    problem, estimate = exact()
    assert cost(problem, estimate, TAKEN) == pytest.approx(0.0, abs=1e-12)
    by = np.zeros((len(TAKEN), 4))
    by[3] = [1.0, 0.2, 0.0, 0.2]  # both images see v 0.2 px too low
    moved = replace(problem, sequence=with_pixels(problem.sequence, problem.sequence.observations.pixel + by))
    squared = (1.0 + 0.4**2 / 2.0) / problem.pixel_variance
    assert cost(moved, estimate, TAKEN) == pytest.approx(0.5 * squared, rel=1e-9)
    assert cost(moved, estimate, TAKEN & (np.arange(len(TAKEN)) != 3)) == pytest.approx(0.0, abs=1e-12)
    k = 1.5
    huber = k * np.sqrt(squared) - 0.5 * k**2
    assert cost(replace(moved, kernel=HuberKernel(k)), estimate, TAKEN) == pytest.approx(huber, rel=1e-9)


def test_a_motion_and_a_prior_cost_by_their_covariances() -> None:
    problem, estimate = exact()
    turned = problem.increment.copy()
    turned[2] += [0.03, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert estimate.landmarks.covariance is None
    other = replace(problem, increment=turned)
    residual = se3.log(se3.inverse(se3.exp(turned[2])) @ se3.exp(problem.increment[2]))
    expected = 0.5 * residual @ np.linalg.solve(problem.increment_covariance[2], residual)
    assert cost(other, estimate, TAKEN) == pytest.approx(expected, rel=1e-9)
    off = np.array([[0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, -0.1], [0.0, 0.0, 0.0]])
    covariance = np.diag([0.01, 0.02, 0.05])
    prior = LandmarkPrior(estimate.landmarks.position + off, covariance)
    expected = 0.5 * (0.3**2 / 0.01 + 0.2**2 / 0.02 + 0.1**2 / 0.05)
    assert cost(replace(problem, landmark_prior=prior), estimate, TAKEN) == pytest.approx(expected, rel=1e-9)


def test_an_answer_that_lacks_a_landmark_or_a_pose_has_no_cost() -> None:
    problem, estimate = exact()
    fewer = Landmarks(np.arange(3), estimate.landmarks.position[:3])
    assert np.isnan(cost(problem, replace(estimate, landmarks=fewer), TAKEN))
    gone = estimate.world_T_imu.copy()
    gone[2] = np.nan
    assert np.isnan(cost(problem, replace(estimate, world_T_imu=gone), TAKEN))
