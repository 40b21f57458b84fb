"""The graph has the filters' likelihood, and its factors the slopes of their errors in our conventions."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import data
from fgbaseline.data import HuberKernel, Problem
from fgbaseline.data.velocity_increments import dead_reckoned_path
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.measurement_model import three_rows
from fgbaseline.smoother.graph.factors import FactorBuilder
from fgbaseline.smoother.graph.gtsam_conversions import reorder_tangent
from fgbaseline.smoother.graph.keys import landmark_key, pose_key

from ..builders.four_rows import State, cost
from ..builders.synthetic import Scene, drive, plain_problem

SEEDS = st.integers(0, 2**32 - 1)
SCENE = Scene(frames=6, n_points=8).sequence()


def graph_of(problem: Problem, factors: FactorBuilder) -> gtsam.NonlinearFactorGraph:
    """Every factor of the problem, whatever the geometry of its landmarks."""
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(factors.pose_prior())
    for k in range(problem.n_frames - 1):
        graph.push_back(factors.between(k))
    o = problem.observations()
    for k, j, pixel in zip(o.frame.tolist(), o.landmark.tolist(), o.pixel, strict=True):
        graph.push_back(factors.observation(k, landmark_key(j), three_rows(pixel)))
    if problem.landmark_prior is not None:
        for j in problem.features.tolist():
            graph.push_back(factors.landmark_prior(j, landmark_key(j)))
    return graph


def values_of(state: State, problem: Problem, factors: FactorBuilder) -> gtsam.Values:
    values = gtsam.Values()
    for k, pose in enumerate(state.world_T_imu):
        values.insert(pose_key(k), gtsam.Pose3(pose))
    for j in problem.features.tolist():
        values.insert(landmark_key(j), state.landmarks[j])
    return values


def near_truth(problem: Problem, random: np.random.Generator, size: float = 1.0) -> State:
    """The true state, moved by some centimeters and milliradians."""
    truth = problem.sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    state = State(truth.world_T_imu, truth.landmarks)
    n = 6 * problem.n_frames
    scale = np.concatenate([np.tile(np.repeat([0.05, 0.005], 3), problem.n_frames), np.full(state.size - n, 0.2)])
    return state.moved(size * scale * random.standard_normal(state.size))


PROBLEMS = {
    "no prior": plain_problem(SCENE),
    "first pose held": replace(plain_problem(SCENE), initial_covariance=np.zeros((6, 6))),
    "documented": data.documented(SCENE),
    "drive": data.documented(drive(), None),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_graph_and_the_four_rows_differ_by_a_constant(name: str) -> None:
    problem = PROBLEMS[name]
    factors = FactorBuilder(problem)
    graph = graph_of(problem, factors)
    random = np.random.default_rng(7)
    # vL - vR carries no information on the state.
    o = problem.observations()
    constant = float(np.sum((o.pixel[:, 1] - o.pixel[:, 3]) ** 2)) / (4.0 * problem.pixel_variance)
    states = [near_truth(problem, random, size) for size in (0.0, 0.5, 1.0, 2.0)]
    if "held" in name or problem.preset == "documented":
        # A first pose that is held may not move: its cost would drown all others.
        states = [State(np.concatenate([np.eye(4)[None], s.world_T_imu[1:]]), s.landmarks) for s in states]
    ours = np.array([cost(problem, s) for s in states])
    theirs = np.array([graph.error(values_of(s, problem, factors)) for s in states])
    for i in range(1, len(states)):
        difference = ours[i] - ours[0]
        assert theirs[i] - theirs[0] == pytest.approx(difference, rel=1e-9)
    np.testing.assert_allclose(ours - theirs, constant, rtol=1e-6, atol=1e-9 * ours.max())


def test_the_kernel_is_huber_on_the_norm_of_the_three_rows() -> None:
    k = 2.5
    problem = plain_problem(SCENE, HuberKernel(k))
    factors, state = FactorBuilder(problem), near_truth(problem, np.random.default_rng(0), 1.0)
    values = values_of(state, problem, factors)
    o, s = problem.observations(), problem.sequence
    points = se3.transform(se3.inverse(state.world_T_imu @ s.imu_T_cam)[o.frame], state.landmarks[o.landmark])
    r = (o.pixel - s.camera.project(points)) / np.sqrt(problem.pixel_variance)
    norm = np.sqrt(r[:, 0] ** 2 + r[:, 2] ** 2 + 2.0 * (0.5 * (r[:, 1] + r[:, 3])) ** 2)
    expected = np.where(norm <= k, 0.5 * norm**2, k * norm - 0.5 * k**2)
    errors = [
        factors.observation(int(o.frame[i]), landmark_key(int(o.landmark[i])), three_rows(o.pixel[i])).error(values)
        for i in range(len(o))
    ]
    assert (norm > k).any()
    np.testing.assert_allclose(errors, expected, rtol=1e-9)


@given(SEEDS)
def test_the_stereo_factor_is_predicted_minus_measured_through_the_extrinsic(seed: int) -> None:
    problem = PROBLEMS["no prior"]
    random = np.random.default_rng(seed)
    state, factors = near_truth(problem, random, 2.0), FactorBuilder(problem)
    i = int(random.integers(len(problem.observations())))
    o, s = problem.observations(), problem.sequence
    frame, landmark = int(o.frame[i]), int(o.landmark[i])
    factor = factors.observation(frame, landmark_key(landmark), three_rows(o.pixel[i]))

    def error(moved: State) -> FloatArray:
        cam_T_world = se3.inverse(moved.world_T_imu[frame] @ s.imu_T_cam)
        r = s.camera.project(se3.transform(cam_T_world, moved.landmarks[landmark])) - o.pixel[i]
        return np.array([r[0], r[2], 0.5 * (r[1] + r[3])])

    np.testing.assert_allclose(factor.unwhitenedError(values_of(state, problem, factors)), error(state), atol=1e-9)
    sigma = np.sqrt(problem.pixel_variance) * np.array([1.0, 1.0, np.sqrt(0.5)])
    columns = [
        *range(6 * frame, 6 * frame + 6),
        *range(state.size - 3 * (8 - landmark), state.size - 3 * (7 - landmark)),
    ]
    expected = slope(error, state, columns) / sigma[:, None]
    A = factor.linearize(values_of(state, problem, factors)).jacobian()[0]
    # GTSAM's columns are rotation, translation, point.
    np.testing.assert_allclose(A[:, [3, 4, 5, 0, 1, 2, 6, 7, 8]], expected, rtol=1e-5, atol=1e-5 * np.abs(A).max())


@given(SEEDS)
def test_the_motion_factor_is_the_logarithm_of_what_the_increment_leaves(seed: int) -> None:
    random = np.random.default_rng(seed)
    A = 0.1 * random.normal(size=(6, 9))
    W = A @ A.T
    problem = PROBLEMS["no prior"]
    problem = replace(problem, increment_covariance=np.broadcast_to(W, problem.increment_covariance.shape))
    state, factors = near_truth(problem, random, 3.0), FactorBuilder(problem)
    k = int(random.integers(problem.n_frames - 1))

    def error(moved: State) -> FloatArray:
        step = se3.inverse(moved.world_T_imu[k]) @ moved.world_T_imu[k + 1]
        return se3.log(se3.exp(-problem.increment[k]) @ step)

    values = values_of(state, problem, factors)
    factor = factors.between(k)
    np.testing.assert_allclose(factor.unwhitenedError(values)[[3, 4, 5, 0, 1, 2]], error(state), atol=1e-10)
    e = error(state)
    assert factor.error(values) == pytest.approx(0.5 * e @ np.linalg.solve(W, e), rel=1e-6)
    expected = slope(error, state, list(range(6 * k, 6 * k + 12)))
    J = factor.linearize(values).jacobian()[0]
    order = [3, 4, 5, 0, 1, 2]
    # Whitened: compare J^T J, which is expected^T W^-1 expected.
    information = (J.T @ J)[np.ix_([*order, *(6 + np.array(order))], [*order, *(6 + np.array(order))])]
    theirs = expected.T @ np.linalg.solve(W, expected)
    np.testing.assert_allclose(information, theirs, rtol=1e-4, atol=1e-5 * np.abs(theirs).max())


def slope(error: object, state: State, columns: list[int]) -> FloatArray:
    """Central differences of an error along some of the state's perturbations."""
    assert callable(error)
    h, result = 1e-6, []
    for i in columns:
        delta = np.zeros(state.size)
        delta[i] = h
        result.append((error(state.moved(delta)) - error(state.moved(-delta))) / (2.0 * h))
    return np.stack(result, axis=1)


def test_the_order_of_tangents_is_turned_and_turned_back() -> None:
    named = np.add.outer(10 * np.arange(1, 7), np.arange(1, 7))
    assert reorder_tangent(named)[0].tolist() == [44, 45, 46, 41, 42, 43]
    np.testing.assert_array_equal(reorder_tangent(reorder_tangent(named)), named)


def test_a_point_behind_the_camera_raises_no_exception() -> None:
    problem = PROBLEMS["no prior"]
    factors = FactorBuilder(problem)
    state = near_truth(problem, np.random.default_rng(0), 0.0)
    behind = State(state.world_T_imu, state.landmarks + problem.sequence.imu_T_cam[:3, 2] * -100.0)
    values = values_of(behind, problem, factors)
    factor = factors.observation(0, landmark_key(0), three_rows(problem.observations().pixel[0]))
    assert np.isfinite(factor.error(values))
    np.testing.assert_array_equal(factor.linearize(values).jacobian()[0], 0.0)


def test_the_dead_reckoned_path_costs_no_motion() -> None:
    problem = PROBLEMS["no prior"]
    factors = FactorBuilder(problem)
    state = near_truth(problem, np.random.default_rng(0), 0.0)
    values = values_of(State(dead_reckoned_path(problem.increment), state.landmarks), problem, factors)
    assert sum(factors.between(k).error(values) for k in range(problem.n_frames - 1)) < 1e-20
    assert factors.pose_prior().error(values) == 0.0
