"""The reference is the minimum of the problem's cost, its covariance the curvature's, and it says what it left out."""

from collections.abc import Callable
from dataclasses import replace

import gtsam
import numpy as np
import pytest

from fgbaseline import data, diagnosis, ekf, smoother
from fgbaseline.data import Estimate, HuberKernel, Observations, Problem, Sequence, Status
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.smoother.graph.factors import FactorBuilder
from fgbaseline.smoother.graph.keys import landmark_key
from fgbaseline.smoother.initialization.landmark_initialization import InitializationCriterion, UninitializedLandmarks

from ..builders.four_rows import State, assert_no_small_step_lowers_the_cost, information
from ..builders.synthetic import Scene, drive, first_frames, matched, plain_problem, position_errors, with_pixels
from .test_factors import graph_of, near_truth, values_of

SCENE = Scene().sequence()
Solver = Callable[[Problem], Estimate]


def batch(problem: Problem) -> State:
    """The minimum by GTSAM's Levenberg-Marquardt, from the truth, to the last digit."""
    factors = FactorBuilder(problem)
    truth = near_truth(problem, np.random.default_rng(0), 0.0)
    params = gtsam.LevenbergMarquardtParams()
    params.setRelativeErrorTol(1e-15)
    params.setAbsoluteErrorTol(1e-15)
    params.setMaxIterations(100)
    optimizer = gtsam.LevenbergMarquardtOptimizer(
        graph_of(problem, factors), values_of(truth, problem, factors), params
    )
    values = optimizer.optimize()
    poses = np.array([values.atPose3(gtsam.symbol("x", k)).matrix() for k in range(problem.n_frames)])
    return State(poses, np.array([values.atPoint3(landmark_key(int(j))) for j in problem.features]))


def state_of(estimate: Estimate) -> State:
    return State(estimate.world_T_imu, estimate.landmarks.position)


def nees(estimate: Estimate, sequence: Sequence) -> FloatArray:
    """(T-1,) normalized errors squared of the poses after the first, which is held; 6 on average if all is right."""
    assert sequence.truth is not None
    assert estimate.covariance is not None
    error = se3.log(se3.inverse(estimate.world_T_imu) @ sequence.truth.world_T_imu)[1:]
    return np.einsum("ni,ni->n", error, np.linalg.solve(estimate.covariance[1:], error[:, :, None])[:, :, 0])


NEAR = near_truth(plain_problem(SCENE), np.random.default_rng(1)).landmarks
PROBLEMS = {
    "plain": plain_problem(SCENE),
    "kernel": plain_problem(SCENE, HuberKernel(1.5)),
    "held": replace(plain_problem(SCENE), initial_covariance=np.zeros((6, 6))),
    "prior": replace(
        plain_problem(SCENE),
        landmark_prior=data.LandmarkPrior(
            near_truth(plain_problem(SCENE), np.random.default_rng(1)).landmarks, np.eye(3)
        ),
    ),
}


@pytest.mark.parametrize(("name", "tolerance"), [("plain", 1e-6), ("held", 1e-6), ("prior", 1e-6), ("kernel", 2e-5)])
def test_ten_poses_are_where_batch_levenberg_marquardt_finds_them(name: str, tolerance: float) -> None:
    # Under a kernel, reweighted least squares close in by a factor a step and stop a little early.
    problem = PROBLEMS[name]
    estimate = smoother.isam2(problem)
    assert estimate.status is Status.OK
    np.testing.assert_array_equal(estimate.landmarks.index, problem.features)
    assert estimate.used.all()
    expected = batch(problem)
    np.testing.assert_allclose(estimate.world_T_imu, expected.world_T_imu, rtol=0, atol=tolerance)
    distance = np.linalg.norm(expected.landmarks, axis=1)[:, None] * np.ones(3)
    np.testing.assert_array_less(np.abs(estimate.landmarks.position - expected.landmarks), tolerance * distance)


@pytest.mark.parametrize("solve", [smoother.isam2, smoother.batch])
@pytest.mark.parametrize("name", ["plain", "held", "prior"])
def test_no_small_step_lowers_the_cost_of_the_four_rows(solve: Solver, name: str) -> None:
    problem = PROBLEMS[name]
    assert_no_small_step_lowers_the_cost(problem, state_of(solve(problem)))


@pytest.mark.parametrize("solve", [smoother.isam2, smoother.batch])
@pytest.mark.parametrize("name", ["plain", "prior"])
def test_the_covariances_are_the_dense_inverse_of_the_curvature(solve: Solver, name: str) -> None:
    """Our curvature has the slopes of the motion's logarithm, as GTSAM's has."""
    problem = PROBLEMS[name]
    estimate = solve(problem)
    assert estimate.covariance is not None
    assert estimate.landmarks.covariance is not None
    dense, T = np.linalg.inv(information(problem, state_of(estimate))), problem.n_frames
    for k, covariance in enumerate(estimate.covariance):
        assert_near(covariance, dense[6 * k : 6 * k + 6, 6 * k : 6 * k + 6])
    for row, covariance in enumerate(estimate.landmarks.covariance):
        at = slice(6 * T + 3 * row, 6 * T + 3 * row + 3)
        assert_near(covariance, dense[at, at])


def assert_near(covariance: FloatArray, expected: FloatArray) -> None:
    unit = 1.0 / np.sqrt(np.diag(expected))
    scale = unit[:, None] * unit[None, :]
    np.testing.assert_allclose(covariance * scale, expected * scale, rtol=0, atol=1e-3)


def truncated(problem: Problem, frames: int) -> Problem:
    """The problem of the first frames alone."""
    sequence = first_frames(problem.sequence, frames)
    return replace(
        problem,
        sequence=sequence,
        increment=problem.increment[: frames - 1],
        increment_covariance=problem.increment_covariance[: frames - 1],
        excluded=problem.excluded[problem.sequence.observations.frame < frames],
    )


ONLINE = {
    "plain": (PROBLEMS["plain"], 0.1, 0.01),
    "drive": (replace(matched(drive(features_per_frame=30.0)), kernel=None), 0.1, 0.01),
    "kernel": (PROBLEMS["kernel"], 0.3, 0.1),
    "drive, kernel": (matched(drive(features_per_frame=30.0)), 0.3, 0.1),
}


@pytest.mark.parametrize(("problem", "pose_tolerance", "sigma_tolerance"), ONLINE.values(), ids=ONLINE)
def test_an_online_pose_is_the_newest_pose_of_the_data_up_to_it(
    problem: Problem, pose_tolerance: float, sigma_tolerance: float
) -> None:
    online = smoother.isam2(problem).by_products["isam2-online"]
    assert online.covariance is not None
    T = problem.n_frames
    for frames in (2, 4, T // 2, T):
        then = smoother.isam2(truncated(problem, frames))
        k = frames - 1
        apart = se3.log(se3.inverse(then.world_T_imu[k]) @ online.world_T_imu[k])
        assert then.covariance is not None
        sigma = np.sqrt(np.diag(then.covariance[k]))
        np.testing.assert_array_less(np.abs(apart), pose_tolerance * sigma)
        np.testing.assert_allclose(np.sqrt(np.diag(online.covariance[k])), sigma, rtol=sigma_tolerance)


def test_online_sigmas_are_at_least_those_of_the_smoothed_poses() -> None:
    final = smoother.isam2(ONLINE["drive"][0])
    online = final.by_products["isam2-online"]
    assert final.covariance is not None
    assert online.covariance is not None
    now, then = (np.sqrt(np.einsum("nii->ni", e.covariance)) for e in (online, final))
    apart = se3.log(se3.inverse(final.world_T_imu[-1]) @ online.world_T_imu[-1])
    np.testing.assert_array_less(np.abs(apart), 0.1 * then[-1])
    np.testing.assert_allclose(now[-1], then[-1], rtol=0.02)
    assert np.all(now[1:] > 0.98 * then[1:])
    assert np.median(now[1:] / then[1:]) > 1.05


def test_the_by_products_pair_the_two_names_and_go_no_deeper() -> None:
    problem = PROBLEMS["plain"]
    final, online = smoother.isam2(problem), smoother.isam2_online(problem)
    assert (final.name, online.name) == ("isam2", "isam2-online")
    assert list(final.by_products) == ["isam2-online"]
    assert list(online.by_products) == ["isam2"]
    assert not final.by_products["isam2-online"].by_products
    assert not online.by_products["isam2"].by_products
    np.testing.assert_array_equal(online.world_T_imu, final.by_products["isam2-online"].world_T_imu)
    np.testing.assert_array_equal(online.by_products["isam2"].world_T_imu, final.world_T_imu)


def test_without_observations_there_is_no_reference() -> None:
    problem = matched(replace(drive(), observations=Observations.none()))
    for estimator in (smoother.isam2, smoother.isam2_online):
        estimate = estimator(problem)
        assert estimate.status is Status.FAILED
        assert estimate.reason == "no observations"
        assert np.isnan(estimate.world_T_imu).all()
        assert not estimate.used.any()


def test_a_landmark_with_few_observations_is_never_initialized_and_is_reported() -> None:
    o = SCENE.observations
    few = replace(SCENE, observations=o.select((o.landmark != 3) | (o.frame == 4) | (o.frame == 6)))
    problem = plain_problem(few)
    estimate = smoother.isam2(problem)
    assert 3 not in estimate.landmarks.index
    assert len(estimate.landmarks) == 11
    assert not estimate.used[problem.observations().landmark == 3].any()
    assert estimate.used[problem.observations().landmark != 3].all()
    (event,) = estimate.events
    assert (event.frame, event.kind, event.landmark) == (6, "landmark never determined", 3)
    # That is no trouble: it is what the data say.
    assert estimate.status is Status.OK


def test_an_initialized_landmark_adds_all_its_deferred_observations() -> None:
    # The third sight determines it; the two before count as well.
    o = SCENE.observations
    late = replace(SCENE, observations=o.select((o.landmark != 3) | (o.frame >= 7)))
    problem = plain_problem(late)
    estimate = smoother.isam2(problem)
    assert estimate.used.all()
    reference = batch(problem)
    np.testing.assert_allclose(estimate.landmarks.position[3], reference.landmarks[3], rtol=1e-5)


def flipped(landmark: int, frames: slice) -> Problem:
    """The scene with left and right image exchanged for one landmark: it is then seen behind the camera."""
    pixel = SCENE.observations.pixel.copy()
    where = (12 * np.arange(10) + landmark)[frames]
    pixel[where] = pixel[where][:, [2, 1, 0, 3]]
    return plain_problem(with_pixels(SCENE, pixel))


def test_a_cheirality_violation_costs_that_landmark_alone() -> None:
    estimate = smoother.isam2(flipped(5, slice(3, None)))
    assert estimate.status is Status.RECOVERED
    assert "landmark dropped" in estimate.reason
    (event,) = estimate.events
    assert (event.kind, event.landmark) == ("landmark dropped", 5)
    assert 3 <= event.frame <= 9
    assert event.reason
    assert 5 not in estimate.landmarks.index
    np.testing.assert_array_equal(estimate.used, SCENE.observations.landmark != 5)
    # The others are where they are without it.
    o = SCENE.observations
    without = smoother.isam2(plain_problem(replace(SCENE, observations=o.select(o.landmark != 5))))
    np.testing.assert_allclose(estimate.world_T_imu, without.world_T_imu, rtol=0, atol=1e-5)
    np.testing.assert_array_equal(estimate.landmarks.index, without.landmarks.index)
    np.testing.assert_allclose(estimate.landmarks.position, without.landmarks.position, rtol=1e-4, atol=1e-4)


@pytest.mark.slow
def test_on_clean_drives_the_reference_is_more_accurate_than_dead_reckoning_and_consistent() -> None:
    squares, consistency = [], []
    for path in ("town", "loop", "handheld"):
        for seed in (1, 2):
            sequence = drive(path, seconds=10.0, features_per_frame=40.0, seed=seed)
            problem = matched(sequence)
            estimate = smoother.isam2(problem)
            assert estimate.status is Status.OK
            assert estimate.used[problem.mask].mean() > 0.9
            ours, theirs = (np.mean(position_errors(e, sequence) ** 2) for e in (estimate, ekf.dead_reckoning(problem)))
            squares.append((ours, theirs))
            consistency.append(nees(estimate, sequence).mean())
            online = estimate.by_products["isam2-online"]
            consistency.append(nees(online, sequence).mean())
    ours, theirs = np.sqrt(np.mean(squares, axis=0))
    assert ours < 0.5 * theirs
    # 6 if all is right; the errors of a run hang together, so one run says little.
    assert 3.0 < np.mean(consistency) < 12.0


def test_a_problem_is_not_changed_and_solved_the_same_way_twice() -> None:
    problem = matched(drive())
    excluded, increment = problem.excluded.copy(), problem.increment.copy()
    one, other = smoother.isam2(problem), smoother.isam2(problem)
    np.testing.assert_array_equal(problem.excluded, excluded)
    np.testing.assert_array_equal(problem.increment, increment)
    np.testing.assert_array_equal(one.world_T_imu, other.world_T_imu)
    np.testing.assert_array_equal(one.used, other.used)


def test_progress_is_reported_after_every_frame() -> None:
    calls: list[tuple[int, int]] = []
    smoother.isam2(PROBLEMS["plain"], lambda done, total: calls.append((done, total)))
    assert calls == [(k + 1, 10) for k in range(10)]


@pytest.mark.parametrize("seed", [2, 8, 15])
def test_simultaneous_first_landmarks_do_not_disturb_the_path(seed: int) -> None:
    # Velocities so noisy that the first frames' dead reckoning is 4 px off in the images.
    sequence = simulate(
        Simulation(
            duration=3.0, features_per_frame=35.0, seed=seed, sigma_linear=0.5, sigma_angular=0.05, wrong_share=0.0
        )
    )
    noise = diagnosis.NoiseSettings(pixel=0.5, linear_velocity=0.5, angular_velocity=0.05)
    settings = diagnosis.AsRecordedSettings(
        noise=noise, shift=Shift.AFTER, mask=MaskSettings(prediction_gate=np.inf), kernel=None
    )
    estimate = smoother.isam2(diagnosis.calibrated(sequence, settings=settings))
    assert position_errors(estimate.by_products["isam2-online"], sequence)[2:].max() < 0.12


def test_no_landmark_is_initialized_behind_a_camera_that_observed_it() -> None:
    # Two views of a point, and a first one from a pose 3 m past it.
    problem = plain_problem(Scene(frames=3, n_points=1, sigma_pixel=0.0).sequence())
    truth = problem.sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    uninitialized = UninitializedLandmarks(problem, problem.observations(), InitializationCriterion())
    for i in range(3):
        uninitialized.add(0, i)
    path = truth.world_T_imu.copy()
    camera = path[2] @ problem.sequence.imu_T_cam
    depth = float(camera[:3, 2] @ (truth.landmarks[0] - camera[:3, 3]))
    path[0] = path[2]
    path[0, :3, 3] += (depth + 3.0) * camera[:3, 2]
    assert uninitialized.initialize([0], path) == []
    assert len(uninitialized.initialize([0], truth.world_T_imu)) == 1
