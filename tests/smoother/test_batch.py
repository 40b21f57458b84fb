"""Batch finds the minimum from far and near, says whether both agree, and has the covariances of the curvature."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest

from fgbaseline import compare, data, smoother
from fgbaseline.data import Estimate, Observations, Problem, Status
from fgbaseline.data.velocity_increments import dead_reckoned_path
from fgbaseline.smoother.batch.full_graph import full_graph
from fgbaseline.smoother.graph.gtsam_conversions import reorder_tangent, values_from_state
from fgbaseline.smoother.graph.keys import landmark_key, pose_key
from fgbaseline.smoother.graph.marginal_covariances import marginal_covariances
from fgbaseline.smoother.initialization.windowed_initialization import optimize_in_windows

from ..builders.synthetic import Scene, drive, matched, plain_problem, with_pixels
from .test_isam2 import PROBLEMS, SCENE


def kinds(estimate: Estimate) -> set[str]:
    return {event.kind for event in estimate.events}


@pytest.mark.parametrize("name", PROBLEMS)
def test_from_both_starts_it_ends_where_isam2_does(name: str) -> None:
    problem = PROBLEMS[name]
    estimate = smoother.batch(problem)
    assert estimate.status is Status.OK
    assert "both starts end at the same cost" in kinds(estimate)
    isam2 = estimate.by_products["isam2"]
    np.testing.assert_array_equal(estimate.used, isam2.used)
    np.testing.assert_array_equal(estimate.landmarks.index, isam2.landmarks.index)
    np.testing.assert_allclose(estimate.world_T_imu, isam2.world_T_imu, rtol=0, atol=5e-5)


def test_the_sweep_gives_the_covariances_of_gtsams_marginals() -> None:
    problem = matched(drive(features_per_frame=30.0))
    estimate = smoother.isam2(problem)
    assert estimate.covariance is not None
    kept = replace(problem, excluded=np.where(estimate.used, 0, 2).astype(np.uint8))
    graph, values = full_graph(kept), values_from_state(estimate.world_T_imu, estimate.landmarks)
    swept, marginals = marginal_covariances(graph, values), gtsam.Marginals(graph, values)
    assert len(swept) == problem.n_frames + len(estimate.landmarks)
    for key in [pose_key(1), pose_key(20), pose_key(problem.n_frames - 1), landmark_key(int(kept.features[0]))]:
        expected = marginals.marginalCovariance(key)
        np.testing.assert_allclose(swept[key], expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(estimate.covariance[9], reorder_tangent(swept[pose_key(9)]), rtol=1e-6, atol=1e-12)


def test_a_given_estimate_is_not_computed_again() -> None:
    problem = PROBLEMS["plain"]
    known = smoother.isam2(problem)
    calls: list[tuple[int, int]] = []
    estimate = smoother.batch(problem, lambda done, total: calls.append((done, total)), given={"isam2": known})
    assert calls == [(10, 10)]
    assert not estimate.by_products
    np.testing.assert_array_equal(estimate.world_T_imu, smoother.batch(problem).world_T_imu)


def test_the_answers_found_on_the_way_come_along() -> None:
    estimate = smoother.batch(PROBLEMS["plain"])
    assert list(estimate.by_products) == ["isam2", "isam2-online"]
    assert list(estimate.by_products["isam2"].by_products) == ["isam2-online"]


def biased(problem: Problem, rate: float) -> Problem:
    """The problem with a yaw rate that is off by `rate` (rad/s), and known to no better than a third of that."""
    increment, covariance = problem.increment.copy(), problem.increment_covariance.copy()
    increment[:, 5] += rate * problem.sequence.dt
    covariance[:, 5, 5] += (rate / 3.0 * problem.sequence.dt) ** 2
    return replace(problem, increment=increment, increment_covariance=covariance)


def test_windowed_initialization_brings_a_bent_path_to_where_a_descent_converges() -> None:
    problem = biased(matched(drive(seconds=15.0, features_per_frame=40.0)), 0.15)
    truth = problem.sequence.truth
    assert truth is not None
    path = dead_reckoned_path(problem.increment, problem.initial_pose)
    near, far = (
        np.linalg.norm((p - truth.world_T_imu)[:, :3, 3], axis=1).max()
        for p in (optimize_in_windows(problem, path), path)
    )
    assert far > 5.0
    assert near < 0.2 * far
    estimate = smoother.batch(problem)
    assert "both starts end at the same cost" in kinds(estimate)


def test_starts_that_end_at_different_minima_are_an_event_and_the_lower_cost_counts() -> None:
    problem = PROBLEMS["plain"]
    good = smoother.isam2(problem)
    # Behind the cameras no landmark pulls: a start from there stays there.
    lost = replace(good.landmarks, position=good.landmarks.position - [200.0, 0.0, 0.0])
    estimate = smoother.batch(problem, given={"isam2": replace(good, landmarks=lost)})
    (event,) = estimate.events
    assert event.kind == "starts end at different costs"
    assert "dead reckoning" in event.reason
    assert "isam2's solution" in event.reason
    np.testing.assert_allclose(estimate.world_T_imu, good.world_T_imu, rtol=0, atol=1e-5)


def test_without_isam2_batch_has_one_start_and_reports_it() -> None:
    problem = PROBLEMS["kernel"]
    failed = Estimate.failed("isam2", "indeterminate", problem.n_frames, len(problem.excluded))
    estimate = smoother.batch(problem, given={"isam2": failed})
    assert estimate.status is Status.RECOVERED
    assert "indeterminate" in estimate.reason
    assert "one start only" in kinds(estimate)
    assert estimate.used.all()
    np.testing.assert_allclose(estimate.world_T_imu, smoother.isam2(problem).world_T_imu, rtol=0, atol=1e-3)


def test_started_at_isam2_alone_it_reaches_the_minimum_of_both_starts_unless_isam2_failed() -> None:
    problem = PROBLEMS["plain"]
    given = {"isam2": smoother.isam2(problem)}
    both, one = smoother.batch(problem, given=given), smoother.batch(problem, given=given, from_dead_reckoning=False)
    (event,) = one.events
    assert event.kind == "started at isam2's solution only"
    assert "dead reckoning" not in event.reason
    assert one.status is Status.OK
    np.testing.assert_allclose(one.world_T_imu, both.world_T_imu, rtol=0, atol=1e-5)
    verdict = compare.trust(problem, given["isam2"], one)
    assert any("started at isam2's solution, agrees" in reason for reason in verdict.reasons)

    failed = Estimate.failed("isam2", "indeterminate", problem.n_frames, len(problem.excluded))
    alone = smoother.batch(problem, given={"isam2": failed}, from_dead_reckoning=False)
    assert "one start only" in kinds(alone)


def test_a_landmark_that_violates_cheirality_is_dropped() -> None:
    pixel = SCENE.observations.pixel.copy()
    flipped = SCENE.observations.landmark == 5
    pixel[flipped & (SCENE.observations.frame > 3)] = pixel[flipped & (SCENE.observations.frame > 3)][:, [2, 1, 0, 3]]
    problem = plain_problem(with_pixels(SCENE, pixel))
    estimate = smoother.batch(problem)
    assert 5 not in estimate.landmarks.index
    np.testing.assert_array_equal(estimate.used, SCENE.observations.landmark != 5)


def test_without_observations_there_is_no_answer() -> None:
    problem = matched(replace(drive(), observations=Observations.none()))
    estimate = smoother.batch(problem)
    assert estimate.status is Status.FAILED
    assert np.isnan(estimate.world_T_imu).all()


def test_the_documented_problem_as_a_batch() -> None:
    problem = data.documented(Scene(frames=20, n_points=20).sequence())
    estimate = smoother.batch(problem)
    assert estimate.status is not Status.FAILED
    assert kinds(estimate) & {"both starts end at the same cost", "starts end at different costs", "one start only"}
