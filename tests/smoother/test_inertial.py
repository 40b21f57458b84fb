"""Smoothers on raw inertial data: the strapdown likelihood, its minimum, its curvature, and consistent states."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import smoother
from fgbaseline.data import Estimate, Problem, Status
from fgbaseline.data.estimators.estimate import EventKind
from fgbaseline.geometry import FloatArray, se3, so3, strapdown
from fgbaseline.geometry.measurement_model import three_rows
from fgbaseline.smoother import FixedLagSettings, ISAM2Settings
from fgbaseline.smoother.batch.full_graph import full_graph
from fgbaseline.smoother.errors import IndeterminateSystemError
from fgbaseline.smoother.graph.factors import FactorBuilder
from fgbaseline.smoother.graph.frame_states import FrameStates
from fgbaseline.smoother.graph.gtsam_conversions import STATE_ORDER, bias_to_gtsam
from fgbaseline.smoother.graph.inertial_factors import FIXED_SIGMA, InertialFactors
from fgbaseline.smoother.graph.keys import state_keys
from fgbaseline.smoother.graph.marginal_covariances import marginal_covariances
from fgbaseline.smoother.initialization.inertial_windows import inertial_states
from fgbaseline.smoother.isam2.checkpointed_isam2 import CheckpointedISAM2

from ..builders.inertial import inertial_problem, state_errors

FRAMES = 25


@pytest.fixture(scope="module")
def problem() -> Problem:
    return inertial_problem(3, n_frames=FRAMES)


@pytest.fixture(scope="module")
def answer(problem: Problem) -> Estimate:
    return smoother.isam2(problem)


def factors_of(problem: Problem) -> InertialFactors:
    factors = FactorBuilder(problem).inertial
    assert factors is not None
    return factors


def nees(estimate: Estimate, problem: Problem) -> FloatArray:
    """(T-1,) normalized squared errors of the states after the first, whose position and heading are held."""
    assert estimate.state_covariance is not None
    error, P = state_errors(estimate, problem)[1:], estimate.state_covariance[1:]
    return np.einsum("ni,ni->n", error, np.linalg.solve(P, error[:, :, None])[:, :, 0])


def residuals(problem: Problem, states: FrameStates, points: dict[int, FloatArray]) -> FloatArray:
    """Whitened residuals of start, samples and stereo rows, by `geometry` alone; without a kernel."""
    imu, start, model = problem.imu, problem.start, problem.measurement
    assert imu is not None
    assert start is not None
    held = np.concatenate([np.full(3, 1e-5 * model.camera.baseline), np.full(3, 1e-5), np.full(9, FIXED_SIGMA)])
    first = np.concatenate(
        [
            se3.log(se3.inverse(problem.initial_pose) @ states.world_T_imu[0]),
            states.velocity[0] - start.velocity,
            states.bias[0] - start.bias,
        ]
    )
    parts = [np.linalg.solve(np.linalg.cholesky(start.covariance + np.diag(held**2)), first)]
    for k in range(problem.n_frames - 1):
        motion = imu.motion(k, states.bias[k, :3], states.bias[k, 3:])
        pose, velocity = strapdown.predict(states.world_T_imu[k], states.velocity[k], motion, imu.gravity_vector)
        after = states.world_T_imu[k + 1]
        twist = se3.log(se3.inverse(after) @ pose)
        turn = np.eye(4)
        turn[:3, :3] = after[:3, :3].T @ pose[:3, :3]
        turn[:3, 3] = after[:3, :3].T @ (velocity - states.velocity[k + 1])
        drift = states.bias[k] - states.bias[k + 1]
        apart = np.concatenate([twist, se3.log(turn)[:3], drift])  # GTSAM's chart of the navigation state
        parts.append(np.linalg.solve(np.linalg.cholesky(motion.noise), apart))
    o = problem.observations()
    for k, j, rows in zip(o.frame.tolist(), o.landmark.tolist(), three_rows(o.pixel), strict=True):
        cam_T_world = se3.inverse(states.world_T_imu[k] @ problem.sequence.imu_T_cam)
        uL, vL, uR, _ = model.camera.project(se3.transform(cam_T_world, points[j]))
        parts.append((np.array([uL, uR, vL]) - rows) / np.sqrt(model.row_variance))
    return np.concatenate(parts)


@pytest.mark.parametrize("seed", range(4))
def test_preintegration_is_the_strapdown_motion_and_its_covariance(seed: int) -> None:
    problem = inertial_problem(seed, n_frames=4)
    random, factors, imu = np.random.default_rng(seed), factors_of(problem), problem.imu
    assert imu is not None
    bias = random.normal(size=6) * np.repeat([0.02, 0.2], 3)
    samples = factors.preintegrated(1, bias)
    motion = imu.motion(1, bias[:3], bias[3:])
    np.testing.assert_allclose(samples.deltaRij().matrix(), motion.rotation, atol=1e-12)
    np.testing.assert_allclose(samples.deltaVij(), motion.velocity, atol=1e-12)
    np.testing.assert_allclose(samples.deltaPij(), motion.position, atol=1e-12)
    sigma = np.sqrt(np.diag(motion.noise))
    theirs = samples.residualCovariance()[STATE_ORDER][:, STATE_ORDER]
    np.testing.assert_allclose(theirs / np.outer(sigma, sigma), motion.noise / np.outer(sigma, sigma), atol=1e-9)
    pose, velocity = se3.exp(random.normal(size=6)), random.normal(size=3)
    for size in (0.0, 1e-3, 1e-2):  # biases away from those of the integration: to second order
        moved = bias + size * np.repeat([0.1, 1.0], 3)
        before = gtsam.NavState(gtsam.Pose3(pose), velocity)
        after = samples.predict(before, bias_to_gtsam(moved))
        expected = strapdown.predict(pose, velocity, imu.motion(1, moved[:3], moved[3:]), imu.gravity_vector)
        np.testing.assert_allclose(after.pose().matrix(), expected[0], atol=1e-12 + size**2)
        np.testing.assert_allclose(after.velocity(), expected[1], atol=1e-12 + size**2)


def test_gtsams_default_preintegration_is_of_first_order_in_the_length_of_a_piece() -> None:
    # It holds the attitude over a piece. The same samples in shorter pieces are the same motion for `strapdown`.
    imu, factors = inertial_problem(1, n_frames=3).imu, factors_of(inertial_problem(1, n_frames=3))
    assert imu is not None
    at, exact, apart = imu.pieces(0), imu.motion(0, np.zeros(3), np.zeros(3)), []
    for parts in (1, 2, 4, 8):
        default = gtsam.PreintegratedCombinedMeasurements(factors._params_of(0), bias_to_gtsam(np.zeros(6)))
        for force, rate, dt in zip(imu.specific_force[at], imu.angular_velocity[at], imu.dt[at].tolist(), strict=True):
            for _ in range(parts):
                default.integrateMeasurement(force, rate, dt / parts)
        ends = ((default.deltaVij(), exact.velocity), (default.deltaPij(), exact.position))
        apart.append([float(np.linalg.norm(theirs - ours)) for theirs, ours in ends])
    assert 1e-5 < apart[0][0] < 1e-2
    np.testing.assert_allclose(np.array(apart[:-1]) / apart[1:], 2.0, rtol=0.02)


def test_the_prior_of_the_start_has_its_correlations_and_true_jacobians(problem: Problem) -> None:
    random, start = np.random.default_rng(0), problem.start
    assert start is not None
    A = random.normal(size=(15, 15)) * np.repeat([0.1, 0.05, 0.3, 0.01, 0.1], 3)[:, None]
    factors = FactorBuilder(replace(problem, start=replace(start, covariance=A @ A.T))).inertial
    assert factors is not None
    states = FrameStates.unknown(problem)
    states.start(problem)
    delta = A @ random.normal(size=15)
    states.world_T_imu[0] = states.world_T_imu[0] @ se3.exp(delta[:6])
    states.velocity[0] += delta[6:9]
    states.bias[0] += delta[9:]
    values, prior = gtsam.Values(), factors.start_prior()
    states.insert(values, 0)
    assert prior.error(values) == pytest.approx(0.5 * delta @ np.linalg.solve(A @ A.T, delta), rel=1e-4)
    J, numeric = prior.linearize(values).jacobian()[0], []
    for key, n in zip(state_keys(0, True), (6, 3, 6), strict=True):
        for i in range(n):
            ends = []
            for h in (1e-6, -1e-6):
                step = gtsam.VectorValues()
                step.insert(key, h * np.eye(n)[i])
                ends.append(prior.whitenedError(values.retract(step)))
            numeric.append((ends[0] - ends[1]) / 2e-6)
    np.testing.assert_allclose(J, np.array(numeric).T, atol=1e-6 * np.abs(J).max())


def without_kernel(seed: int, n_frames: int) -> tuple[Problem, Estimate, FrameStates, dict[int, FloatArray]]:
    """A problem without kernel, masked to the landmarks that isam2 has estimated, its answer, states and points."""
    problem = replace(inertial_problem(seed, n_frames=n_frames), kernel=None)
    estimate = smoother.isam2(problem)
    seen = np.isin(problem.sequence.observations.landmark, estimate.landmarks.index)
    kept = replace(problem, excluded=np.where(seen, problem.excluded, np.uint8(1)))
    points = dict(zip(estimate.landmarks.index.tolist(), estimate.landmarks.position, strict=True))
    return kept, estimate, FrameStates.of_estimate(estimate), points


def test_costs_are_those_of_the_strapdown_equations_at_and_beside_the_solution() -> None:
    kept, estimate, states, points = without_kernel(2, 6)
    random = np.random.default_rng(1)
    graph = full_graph(kept, states)
    for size in (0.0, 1.0, 3.0):
        moved = states.copy()
        moved.world_T_imu[1:] = moved.world_T_imu[1:] @ se3.exp(size * 1e-4 * random.normal(size=(5, 6)))
        moved.velocity += size * 1e-3 * random.normal(size=moved.velocity.shape)
        moved.bias += size * 1e-5 * random.normal(size=moved.bias.shape)
        r = residuals(kept, moved, points)
        theirs = graph.error(moved.values(estimate.landmarks))
        # Biases away from those of the integration are to first order in GTSAM.
        assert theirs == pytest.approx(0.5 * r @ r, rel=1e-9 if size == 0.0 else 1e-5)


def test_batch_ends_where_isam2_ends_from_both_starts(problem: Problem, answer: Estimate) -> None:
    result = smoother.batch(problem, given={"isam2": answer})
    assert result.status is Status.OK
    assert [event.kind for event in result.events] == [EventKind.SAME_COST]
    for name, tolerance in (("world_T_imu", 1e-5), ("velocity", 1e-5), ("gyroscope_bias", 1e-6)):
        np.testing.assert_allclose(getattr(result, name), getattr(answer, name), atol=tolerance)
    np.testing.assert_allclose(result.accelerometer_bias, answer.accelerometer_bias, atol=1e-5)
    assert answer.state_covariance is not None
    np.testing.assert_allclose(result.state_covariance, answer.state_covariance, rtol=1e-2, atol=1e-7)


def test_windows_find_the_path_that_integration_loses(problem: Problem) -> None:
    truth = problem.sequence.truth
    assert truth is not None
    apart = np.linalg.norm(inertial_states(problem).world_T_imu[:, :3, 3] - truth.world_T_imu[:, :3, 3], axis=1)
    assert apart.max() < 0.1


def test_joint_marginals_are_blocks_of_the_dense_inverse() -> None:
    kept, estimate, states, _ = without_kernel(0, 5)
    graph, values = full_graph(kept, states), states.values(estimate.landmarks)
    keys = [state_keys(k, True) for k in range(5)]
    swept = marginal_covariances(graph, values, keys)
    ordering = gtsam.Ordering()
    for key in [*np.concatenate(keys).tolist(), *(key for key in values.keys() if chr(key >> 56) == "l")]:  # noqa: SIM118
        ordering.push_back(key)
    J = graph.linearize(values).jacobian(ordering)[0]
    scale = 1.0 / np.linalg.norm(J, axis=0)
    root = np.linalg.inv(np.linalg.qr(J * scale, mode="r")) * scale[:, None]
    dense = root @ root.T
    assert estimate.state_covariance is not None
    for k, (x, _, _) in enumerate(keys):
        block = dense[15 * k : 15 * k + 15, 15 * k : 15 * k + 15]
        sigma = np.sqrt(np.diag(block))
        np.testing.assert_allclose(swept[x] / np.outer(sigma, sigma), block / np.outer(sigma, sigma), atol=1e-4)
        if k:
            ours = estimate.state_covariance[k][np.ix_(STATE_ORDER, STATE_ORDER)]
            np.testing.assert_allclose(ours / np.outer(sigma, sigma), block / np.outer(sigma, sigma), atol=1e-3)


def test_position_and_heading_of_the_first_frame_have_no_variance(problem: Problem, answer: Estimate) -> None:
    assert problem.sequence.truth is not None
    up = problem.sequence.truth.world_T_imu[0, 2, :3]  # about which the start's covariance has none
    for estimate in (answer, answer.by_products["isam2-online"], smoother.fixed_lag(problem)):
        assert estimate.state_covariance is not None
        P = estimate.state_covariance[0]
        np.testing.assert_array_equal(P[:3], 0.0)
        np.testing.assert_allclose(P[3:6, 3:6] @ up, 0.0, atol=1e-15)
        assert np.all(np.diag(P)[6:] > 0.0)
        np.testing.assert_array_equal(estimate.covariance, estimate.state_covariance[:, :6, :6])


def test_answers_turn_with_the_world(problem: Problem, answer: Estimate) -> None:
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = so3.exp_so3([0.0, 0.0, 2.0]), [5.0, -3.0, 1.0]
    start = problem.start
    assert start is not None
    velocity = np.eye(15)
    velocity[6:9, 6:9] = turn[:3, :3]
    turned = replace(
        problem,
        initial_pose=turn @ problem.initial_pose,
        start=replace(
            start, velocity=turn[:3, :3] @ start.velocity, covariance=velocity @ start.covariance @ velocity.T
        ),
    )
    expected, result = answer.transformed(turn), smoother.isam2(turned)
    for name in ("world_T_imu", "velocity", "gyroscope_bias", "accelerometer_bias"):
        np.testing.assert_allclose(getattr(result, name), getattr(expected, name), atol=1e-6, err_msg=name)
    assert expected.state_covariance is not None
    assert result.state_covariance is not None
    sigma = np.sqrt(np.einsum("nii->ni", expected.state_covariance))[1:]
    scale = sigma[:, :, None] * sigma[:, None, :]
    np.testing.assert_allclose(result.state_covariance[1:] / scale, expected.state_covariance[1:] / scale, atol=1e-4)


def test_a_marginalized_tree_ends_where_one_tree_ends() -> None:
    problem = inertial_problem(4, n_frames=50)
    short = smoother.isam2(problem, settings=ISAM2Settings(tree_frames=20, kept_frames=8))
    whole = smoother.isam2(problem, settings=ISAM2Settings(tree_frames=1000))
    np.testing.assert_allclose(short.world_T_imu, whole.world_T_imu, atol=1e-5)
    assert short.velocity is not None
    assert whole.velocity is not None
    np.testing.assert_allclose(short.velocity, whole.velocity, atol=1e-5)
    now, then = (state_errors(e.by_products["isam2-online"], problem)[:, :3] for e in (short, whole))
    np.testing.assert_allclose(now, then, atol=1e-2)


def test_a_failed_update_costs_one_landmark(
    problem: Problem, answer: Estimate, monkeypatch: pytest.MonkeyPatch
) -> None:
    update, named = CheckpointedISAM2.update, list[int]()

    def failing(
        self: CheckpointedISAM2, factors: gtsam.NonlinearFactorGraph, *rest: object, **others: object
    ) -> object:
        keys = [key for key in factors.keyVector() if chr(key >> 56) in "abcdefghijk"]
        if not named and len(self.tree.getLinearizationPoint().keys()) > 100 and keys:
            named.append(keys[0])
            raise IndeterminateSystemError(keys[0], "made up")
        return update(self, factors, *rest, **others)  # type: ignore[arg-type]

    monkeypatch.setattr(CheckpointedISAM2, "update", failing)
    estimate = smoother.isam2(problem)
    assert named
    assert estimate.status is Status.RECOVERED
    assert sum(event.kind == "landmark dropped" for event in estimate.events) == 1
    sigma = np.sqrt(np.einsum("nii->ni", answer.state_covariance))
    np.testing.assert_array_less(np.abs(estimate.world_T_imu - answer.world_T_imu)[:, :3, 3], 0.5 * sigma[:, :3] + 1e-6)


def test_without_observations_of_a_frame_the_samples_carry_on(problem: Problem) -> None:
    o = problem.sequence.observations
    dark = replace(problem, excluded=np.where((o.frame >= 10) & (o.frame < 13), np.uint8(1), problem.excluded))
    for estimate in (smoother.isam2(dark), smoother.fixed_lag(dark)):
        assert estimate.status is Status.OK
        assert nees(estimate, dark)[9:13].max() < chi2.ppf(0.9999, 15)


def test_the_window_of_the_fixed_lag_is_the_whole_graph_where_it_is_long(problem: Problem, answer: Estimate) -> None:
    estimate = smoother.fixed_lag(problem, settings=FixedLagSettings(lag=100.0))
    np.testing.assert_allclose(estimate.world_T_imu, answer.world_T_imu, atol=2e-3)  # the relinearization thresholds
    assert estimate.state_covariance is not None
    assert answer.state_covariance is not None
    now, then = (np.sqrt(np.einsum("nii->ni", e.state_covariance)) for e in (estimate, answer))
    np.testing.assert_allclose(now[1:], then[1:], rtol=0.05)


@pytest.mark.slow
def test_states_are_consistent_over_fifty_seeds() -> None:
    runs = 50
    squares: dict[str, list[FloatArray]] = {"isam2": [], "isam2-online": []}
    for seed in range(runs):
        problem = inertial_problem(seed)
        estimate = smoother.isam2(problem)
        for e in (estimate, estimate.by_products["isam2-online"]):
            squares[e.name].append(nees(e, problem))
    low, high = chi2.ppf([0.025, 0.975], 15 * runs) / runs
    for each in squares.values():
        mean = np.mean(each, axis=0)[np.linspace(1, 48, 20).astype(int)]
        assert np.sum((mean > low) & (mean < high)) >= 18
