"""What the joint filter promises: covariances, what it rejects and says, and what it leaves alone."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from fgbaseline import data, ekf
from fgbaseline.data import Estimate, EventKind, Excluded, HuberKernel, Observations, Problem, Sequence, Status
from fgbaseline.data.estimators.registry import Estimator
from fgbaseline.ekf import JointSettings, LandmarkRepresentation, Linearization
from fgbaseline.ekf.joint.gating import gate_observations
from fgbaseline.ekf.joint.landmark_representation import (
    chart,
    coordinates_of,
    generators,
    homogeneous,
    motion_jacobian,
    world_points,
)
from fgbaseline.ekf.joint.process_noise import MAX_REJECTED, inflation_factor
from fgbaseline.ekf.joint.update import Innovation, NotPositiveDefiniteError, StackedJacobian, kalman_update
from fgbaseline.geometry import FgbaselineError, FloatArray, MeasurementModel, se3
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.measurement_model import ROW_VARIANCE, back_projected, three_rows

from ..builders.synthetic import Scene, drive, matched, plain_problem, position_errors, with_pixels

SCENE = Scene().sequence()
EVERY_WAY = [JointSettings(c, way) for c in LandmarkRepresentation for way in Linearization]


def random_pose(seed: int) -> FloatArray:
    return se3.exp(np.random.default_rng(seed).normal(size=6))


def assert_covariances(covariances: FloatArray) -> None:
    """Symmetric to the last digit; scaled to unit variances, positive to rounding."""
    np.testing.assert_array_equal(covariances, np.swapaxes(covariances, 1, 2))
    unit = 1.0 / np.sqrt(np.einsum("nii->ni", covariances))
    assert np.linalg.eigvalsh(covariances * unit[:, :, None] * unit[:, None, :]).min() > -1e-9


# The pieces


@given(st.integers(0, 10_000), st.sampled_from(LandmarkRepresentation))
def test_the_derivatives_of_an_observation_are_its_finite_differences(
    seed: int, coordinates: LandmarkRepresentation
) -> None:
    random = np.random.default_rng(seed)
    camera, T = SCENE.camera, random_pose(seed)
    rows = np.column_stack([random.uniform(100, 900, 4), random.uniform(50, 90, 4), random.uniform(50, 300, 4)])
    rows[:, 1] = rows[:, 0] - random.uniform(2, 60, 4)
    world_T_cam = T @ SCENE.imu_T_cam
    charts = np.tile(chart(coordinates, world_T_cam), (4, 1, 1))
    xi = coordinates_of(charts, back_projected(camera, rows) @ world_T_cam.T)
    cam_T_imu = se3.inverse(SCENE.imu_T_cam)

    def predicted(delta: FloatArray, step: FloatArray) -> FloatArray:
        return predict(camera, cam_T_imu, T @ se3.exp(delta), homogeneous(charts, xi + step)).pixel

    np.testing.assert_allclose(predicted(np.zeros(6), np.zeros(3)), rows, rtol=1e-9)
    seen = predict(camera, cam_T_imu, T, homogeneous(charts, xi))
    h = 1e-6
    pose_jacobian = [(predicted(h * e, np.zeros(3)) - predicted(-h * e, np.zeros(3))) / (2 * h) for e in np.eye(6)]
    np.testing.assert_allclose(seen.pose_jacobian(), np.stack(pose_jacobian, axis=2), rtol=1e-5, atol=1e-3)
    unit = np.abs(xi).min() * h
    by_xi = [(predicted(np.zeros(6), unit * e) - predicted(np.zeros(6), -unit * e)) / (2 * unit) for e in np.eye(3)]
    analytic = seen.point_jacobian() @ charts[:, :, :3]
    np.testing.assert_allclose(analytic, np.stack(by_xi, axis=2), rtol=1e-4, atol=1e-4 * np.abs(analytic).max())


@given(st.integers(0, 10_000))
def test_three_rows_have_the_information_of_four(seed: int) -> None:
    # The gain on (uL, uR, (vL + vR) / 2) against that on (uL, vL, uR, vR), the textbook's way.
    random = np.random.default_rng(seed)
    n, size = 4, 6 + 3 * 5
    half = random.normal(size=(size, size))
    P, V = half @ half.T, 0.7
    slot = random.permutation(5)[:n]
    three = StackedJacobian(slot, random.normal(size=(n, 3, 6)), random.normal(size=(n, 3, 3)))
    residual = random.normal(size=(n, 4))
    H = np.zeros((n, 4, size))
    for i, j in enumerate(slot):
        uL, uR, v = 0, 1, 2
        for row, source in enumerate((uL, v, uR, v)):
            H[i, row, :6] = three.pose_jacobian[i, source]
            H[i, row, 6 + 3 * j : 9 + 3 * j] = three.landmark_jacobian[i, source]
    H = H.reshape(4 * n, size)
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + V * np.eye(4 * n))
    updated = P.copy()
    innovation = Innovation.of(three, three_rows(residual), updated)
    delta = kalman_update(innovation, innovation.factorize(V * ROW_VARIANCE), updated)
    np.testing.assert_allclose(delta, K @ residual.reshape(-1), rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(updated, (np.eye(size) - K @ H) @ P, rtol=1e-6, atol=1e-9 * np.abs(P).max())
    np.testing.assert_array_equal(updated, updated.T)


def test_an_update_with_an_indefinite_covariance_is_refused_and_changes_nothing() -> None:
    P = -np.eye(9)
    before = P.copy()
    H = StackedJacobian(np.array([0]), np.ones((1, 3, 6)), np.eye(3)[None])
    innovation = Innovation.of(H, np.ones((1, 3)), P)
    with pytest.raises(NotPositiveDefiniteError):
        kalman_update(innovation, innovation.factorize(np.ones((1, 3))), P)
    np.testing.assert_array_equal(P, before)


@given(st.integers(0, 10_000), st.sampled_from(LandmarkRepresentation))
def test_observations_are_invariant_to_a_rigid_motion_of_poses_and_landmarks(
    seed: int, coordinates: LandmarkRepresentation
) -> None:
    random = np.random.default_rng(seed)
    T = random_pose(seed)
    points = np.column_stack([random.uniform(-5, 5, (6, 2)), random.uniform(5, 50, 6), np.ones(6)])
    world_T_cam = T @ SCENE.imu_T_cam
    charts = np.tile(chart(coordinates, world_T_cam @ se3.exp(0.1 * random.normal(size=6))), (6, 1, 1))
    xi = coordinates_of(charts, points @ world_T_cam.T)
    seen = predict(SCENE.camera, se3.inverse(SCENE.imu_T_cam), T, homogeneous(charts, xi))
    nu = motion_jacobian(generators(charts), xi)
    moved = seen.pose_jacobian() @ se3.adjoint(se3.inverse(T)) + seen.point_jacobian() @ charts[:, :, :3] @ nu
    assert np.abs(moved).max() < 1e-9 * np.abs(seen.pose_jacobian()).max()
    # and nu is what the name says
    g = 1e-6 * random.normal(size=6)
    there = coordinates_of(charts, homogeneous(charts, xi) @ se3.exp(g).T)
    np.testing.assert_allclose(there - xi, nu @ g, atol=1e-9 * max(1.0, np.abs(nu).max()))


@given(st.integers(0, 10_000))
def test_converted_world_points_have_the_propagated_covariance(seed: int) -> None:
    random = np.random.default_rng(seed)
    C = random_pose(seed)
    points = np.column_stack([random.uniform(-5, 5, (6, 2)), random.uniform(5, 50, 6), np.ones(6)]) @ C.T
    charts = np.tile(chart(LandmarkRepresentation.INVERSE_DEPTH, C), (6, 1, 1))
    xi = coordinates_of(charts, points)
    found = world_points(charts, xi, np.tile(1e-12 * np.eye(3), (6, 1, 1)))
    np.testing.assert_allclose(found.position, points[:, :3], rtol=1e-9, atol=1e-9)
    assert found.in_front.all()
    steps = 1e-6 * np.eye(3)
    J = np.stack([(homogeneous(charts, xi + e) - homogeneous(charts, xi - e)) / 2e-6 for e in steps], axis=2)
    X = homogeneous(charts, xi)
    by_xi = (J[:, :3] - X[:, :3, None] / X[:, 3:, None] * J[:, 3:]) / X[:, 3, None, None]
    expected = 1e-12 * by_xi @ np.swapaxes(by_xi, 1, 2)
    np.testing.assert_allclose(found.covariance, expected, rtol=1e-5, atol=1e-9 * expected.max())


# The filter


@pytest.mark.parametrize("coordinates", LandmarkRepresentation)
def test_initialization_without_prior_is_the_limit_of_an_uninformative_prior(
    coordinates: LandmarkRepresentation,
) -> None:
    o = SCENE.observations
    two = plain_problem(replace(SCENE, observations=o.select((o.frame < 2) & (o.landmark < 4))))
    plain = ekf.joint_ekf(two, settings=JointSettings(coordinates))
    # At its back-projection, where it is linearized the same, but with 1 km of doubt.
    world_T_cam = two.initial_pose @ SCENE.imu_T_cam
    first = three_rows(two.observations().pixel[:4])
    X = back_projected(SCENE.camera, first) @ world_T_cam.T
    prior = data.LandmarkPrior(np.zeros((len(two.features), 3)), 1e6 * np.eye(3))
    prior.mean[:4] = X[:, :3] / X[:, 3:]
    vague = ekf.joint_ekf(replace(two, landmark_prior=prior), settings=JointSettings(coordinates))
    assert plain.covariance is not None
    assert vague.covariance is not None
    np.testing.assert_allclose(vague.world_T_imu[0], plain.world_T_imu[0], atol=1e-9)
    np.testing.assert_allclose(vague.covariance[0], plain.covariance[0], rtol=1e-3, atol=1e-7)
    np.testing.assert_allclose(vague.world_T_imu[1], plain.world_T_imu[1], atol=1e-3)
    np.testing.assert_allclose(np.diagonal(vague.covariance[1]), np.diagonal(plain.covariance[1]), rtol=2e-2)


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.sampled_from(["town", "loop", "handheld"]), st.sampled_from(EVERY_WAY))
def test_covariances_are_covariances(seed: int, path: str, how: JointSettings) -> None:
    problem = matched(drive(path, seconds=3.0, features_per_frame=15.0, seed=seed, wrong=0.05))
    estimate = ekf.joint_ekf(problem, settings=how)
    assert estimate.covariance is not None
    assert estimate.landmarks.covariance is not None
    assert not estimate.covariance[0].any()
    assert_covariances(estimate.covariance[1:])
    assert_covariances(estimate.landmarks.covariance)


@pytest.mark.parametrize("how", EVERY_WAY, ids=lambda how: f"{how.coordinates}-{how.linearization}")
def test_where_the_world_has_its_origin_makes_no_difference(how: JointSettings) -> None:
    problem = replace(plain_problem(SCENE), kernel=HuberKernel(1.5))
    G = se3.exp([50.0, -20.0, 7.0, 0.5, -1.0, 2.0])
    here = ekf.joint_ekf(problem, settings=how)
    there = ekf.joint_ekf(replace(problem, initial_pose=G), settings=how)
    np.testing.assert_allclose(there.world_T_imu, G @ here.world_T_imu, atol=1e-8)
    np.testing.assert_allclose(there.covariance, here.covariance, atol=1e-10)
    np.testing.assert_allclose(there.landmarks.position, se3.transform(G, here.landmarks.position), atol=1e-6)


@pytest.mark.parametrize("coordinates", LandmarkRepresentation)
def test_uncertainty_of_the_world_frame_moves_nothing_but_in_the_textbook_linearization(
    coordinates: LandmarkRepresentation,
) -> None:
    problem = replace(matched(drive("town", seconds=5.0, features_per_frame=20.0)), kernel=None)
    doubt = replace(problem, initial_covariance=np.diag(np.repeat([1.0, 0.1], 3)))
    apart = {}
    for how in Linearization:
        sure, unsure = (ekf.joint_ekf(p, settings=JointSettings(coordinates, how)) for p in (problem, doubt))
        apart[how] = np.abs(sure.world_T_imu - unsure.world_T_imu).max()
    assert apart[Linearization.INVARIANT] < 1e-6
    assert apart[Linearization.FIRST_ESTIMATE] < 1e-6
    assert apart[Linearization.TEXTBOOK] > 1e-3


def test_a_frame_without_observations_is_a_prediction() -> None:
    o = SCENE.observations
    problem = plain_problem(replace(SCENE, observations=o.select(o.frame != 6)))
    estimate = ekf.joint_ekf(problem)
    expected = estimate.world_T_imu[5] @ se3.exp(problem.increment[5])
    np.testing.assert_allclose(estimate.world_T_imu[6], expected, rtol=0, atol=1e-14)
    assert estimate.status is Status.OK


def test_without_observations_there_is_no_filter() -> None:
    problem = matched(replace(drive(), observations=Observations.none()))
    estimate = ekf.joint_ekf(problem)
    assert estimate.status is Status.FAILED
    assert estimate.reason == "no observations"
    assert np.isnan(estimate.world_T_imu).all()
    assert not estimate.used.any()


def garbled(share: float, frames: range, seed: int = 0) -> tuple[Problem, np.ndarray]:
    """A drive, and which of its observations in the given frames are tens of pixels off; the mask does not know."""
    sequence = drive("town", seconds=10.0, features_per_frame=40.0)
    o, random = sequence.observations, np.random.default_rng(seed)
    wrong = np.isin(o.frame, np.array(frames)) & (random.random(len(o)) < share)
    pixel = o.pixel.copy()
    pixel[wrong] += random.uniform(20.0, 100.0, (wrong.sum(), 4)) * random.choice([-1.0, 1.0], (wrong.sum(), 4))
    problem = matched(sequence)
    return replace(problem, sequence=with_pixels(sequence, pixel)), wrong[problem.mask]


def test_a_gate_rejects_wrong_matches_and_counts_them() -> None:
    problem, wrong = garbled(0.1, range(20, 80))
    gated = ekf.joint_ekf(problem)
    rejected = ~gated.used[problem.mask]
    first = np.zeros(len(wrong), dtype=np.bool_)
    first[np.unique(problem.observations().landmark, return_index=True)[1]] = True
    # A landmark whose first match is wrong starts in the wrong place, and disagrees with all that follow.
    landmark = problem.observations().landmark
    misplaced = np.isin(landmark, landmark[wrong & first])
    assert rejected[wrong & ~first & ~misplaced].mean() > 0.95
    assert rejected[~wrong & ~first & ~misplaced].mean() < 0.02
    kinds = Counter[str]()
    for event in gated.events:
        if event.landmark is None:
            kinds[event.kind] += int(event.reason.split(" of ")[0])
    assert set(kinds) == {"outside the gate", "behind the camera"}
    assert kinds["outside the gate"] > 0.75 * kinds.total()
    assert kinds.total() == rejected.sum()
    # What is rejected does not pull; the kernel alone lets 60 px pull as hard as 2.5 sigma, frame after frame.
    weighted = ekf.joint_ekf_ungated(problem)
    errors = [np.sqrt(np.mean(position_errors(e, problem.sequence) ** 2)) for e in (gated, weighted)]
    assert errors[0] < 0.1
    assert errors[0] < 0.1 * errors[1]


@pytest.mark.parametrize("kernel", [HuberKernel(), None])
def test_a_frame_of_wrong_matches_is_rejected_and_the_filter_recovers(kernel: HuberKernel | None) -> None:
    clean = replace(matched(drive("town", seconds=10.0, features_per_frame=40.0)), kernel=kernel)
    problem, _ = garbled(0.9, range(50, 51))
    problem = replace(problem, kernel=kernel)
    estimate = ekf.joint_ekf_ungated(problem)
    np.testing.assert_array_equal(~estimate.used[problem.mask], problem.observations().frame == 50)
    assert estimate.status is Status.RECOVERED
    assert "1 of 100 frames, first at frame 50" in estimate.reason
    (event,) = (event for event in estimate.events if event.kind == "frame disagrees")
    assert event.frame == 50
    ours, undisturbed = (position_errors(e, clean.sequence) for e in (estimate, ekf.joint_ekf_ungated(clean)))
    assert np.abs(ours - undisturbed).max() < 0.1
    # Believed, it does harm.
    believing = ekf.joint_ekf(problem, settings=JointSettings(gate=None, disagreeing_share=None))
    assert np.abs(position_errors(believing, clean.sequence) - undisturbed).max() > 0.1


def test_the_filter_recovers_from_a_jump_of_all_observations_by_new_landmarks() -> None:
    # A velocity that never was: all that is known disagrees until other landmarks take over.
    sequence = drive("town", seconds=10.0, features_per_frame=40.0)
    velocity = sequence.linear_velocity.copy()
    velocity[50] += [300.0, 0.0, 0.0]
    problem = matched(sequence)
    increment = problem.increment.copy()
    increment[50, 0] += 30.0
    estimate = ekf.joint_ekf(replace(problem, increment=increment))
    assert estimate.status is Status.RECOVERED
    assert np.isfinite(estimate.world_T_imu).all()
    late = problem.observations().frame > 90
    assert estimate.used[problem.mask][late].mean() > 0.5


def disagreeing_frames(estimate: Estimate) -> list[int]:
    return [event.frame for event in estimate.events if event.kind == EventKind.FRAME_DISAGREES]


@pytest.mark.parametrize(
    "solve", [ekf.joint_ekf, ekf.joint_ekf_ungated, ekf.joint_ekf_bias, ekf.joint_ekf_first_estimate]
)
def test_after_two_frames_that_agree_in_themselves_the_process_noise_is_inflated(solve: Estimator) -> None:
    clean = matched(drive("town", seconds=10.0, features_per_frame=40.0))
    increment = clean.increment.copy()
    increment[49, 5] += 0.05  # rad of yaw to frame 50, with a sigma of 0.001
    estimate = solve(replace(clean, increment=increment))
    assert disagreeing_frames(estimate) == [50]
    (inflated,) = (event for event in estimate.events if event.kind == EventKind.PROCESS_NOISE_INFLATED)
    assert inflated.frame == 51
    assert estimate.used[clean.mask][clean.observations().frame == 51].mean() > 0.8
    apart = np.linalg.norm(se3.log(se3.inverse(solve(clean).world_T_imu) @ estimate.world_T_imu)[:, 3:], axis=1)
    assert apart[50] > 0.04
    assert apart[51:].max() < 0.005
    assert_covariances(estimate.covariance[1:])  # frame 0 defines the world


@pytest.mark.parametrize("n", [2, 5, 9])
def test_successive_frames_of_wrong_matches_never_inflate_the_process_noise(n: int) -> None:
    problem, _ = garbled(0.9, range(50, 50 + n))
    estimate = ekf.joint_ekf(problem)
    assert disagreeing_frames(estimate) == list(range(50, 50 + n))
    assert EventKind.PROCESS_NOISE_INFLATED not in {event.kind for event in estimate.events}
    assert estimate.used[problem.mask][problem.observations().frame >= 50 + n].mean() > 0.9


@pytest.mark.parametrize("seed", range(3))
def test_tracks_that_all_move_to_other_points_are_rejected_for_ten_frames_at_most(seed: int) -> None:
    sequence = drive("handheld", seconds=10.0, features_per_frame=40.0, seed=seed)
    problem, o = matched(sequence), sequence.observations
    moving = np.intersect1d(o.landmark[o.frame == 49], o.landmark[o.frame == 50])
    to = np.arange(sequence.n_landmarks)
    to[moving] = np.roll(moving, 1)
    pixel, place = (
        o.pixel.copy(),
        {seen: i for i, seen in enumerate(zip(o.frame.tolist(), o.landmark.tolist(), strict=True))},
    )
    excluded = problem.excluded.copy()
    for i in np.flatnonzero((o.frame >= 50) & np.isin(o.landmark, moving)):
        there = place.get((int(o.frame[i]), int(to[o.landmark[i]])))
        if there is None:
            excluded[i] = Excluded.PREDICTION
        else:
            pixel[i] = o.pixel[there]
    estimate = ekf.joint_ekf(replace(problem, sequence=with_pixels(sequence, pixel), excluded=excluded))
    frames = disagreeing_frames(estimate)
    assert frames[0] == 50
    assert len(frames) <= MAX_REJECTED
    assert estimate.used[(excluded == Excluded.NO) & (o.frame > 60)].mean() > 0.8


@given(st.integers(0, 10_000))
def test_the_nis_given_the_others_is_that_of_the_conditional_gaussian(seed: int) -> None:
    random = np.random.default_rng(seed)
    n, size = 4, 6 + 3 * 4
    half = random.normal(size=(size, size))
    H = StackedJacobian(random.permutation(n), random.normal(size=(n, 3, 6)), random.normal(size=(n, 3, 3)))
    residual, variance = random.normal(size=(n, 3)), random.uniform(0.5, 2.0, 3)
    innovation = Innovation.of(H, residual, half @ half.T)
    S, nu = H.multiply(np.ascontiguousarray(innovation.HP.T)) + np.diag(np.tile(variance, n)), residual.reshape(-1)
    expected = []
    for i in range(n):
        own = np.arange(3 * n) // 3 == i
        gain = S[np.ix_(own, ~own)] @ np.linalg.inv(S[np.ix_(~own, ~own)])
        error = nu[own] - gain @ nu[~own]
        expected.append(error @ np.linalg.solve(S[np.ix_(own, own)] - gain @ S[np.ix_(~own, own)], error))
    np.testing.assert_allclose(innovation.nis_given_others(variance), expected, rtol=1e-7)


def at_infinity(disparity: float) -> Sequence:
    """The scene with two landmarks whose disparity is the given one in every frame."""
    pixel = SCENE.observations.pixel.copy()
    far = SCENE.observations.landmark < 2
    pixel[far, 2] = pixel[far, 0] - disparity
    return with_pixels(SCENE, pixel)


@pytest.mark.parametrize("disparity", [0.0, -3.0])
def test_landmarks_at_infinity_are_used_and_reported(disparity: float) -> None:
    estimate = ekf.joint_ekf_ungated(plain_problem(at_infinity(disparity)))
    assert estimate.status is Status.OK
    assert np.isfinite(estimate.world_T_imu).all()
    assert estimate.used.mean() > 0.9
    undetermined = {
        event.landmark: event.reason for event in estimate.events if event.kind == "landmark never determined"
    }
    for j in {0, 1} & set(undetermined):
        assert "infinity" in undetermined[j]
    assert {0, 1} <= set(undetermined) | set(estimate.landmarks.index.tolist())
    assert np.isfinite(estimate.landmarks.position).all()


def test_in_world_coordinates_landmarks_without_depth_are_deferred() -> None:
    estimate = ekf.joint_ekf(plain_problem(at_infinity(0.0)), settings=JointSettings.textbook())
    assert not estimate.used[SCENE.observations.landmark < 2].any()
    assert estimate.used[SCENE.observations.landmark >= 2].all()
    undetermined = [event for event in estimate.events if event.kind == "landmark never determined"]
    assert [event.landmark for event in undetermined] == [0, 1]
    assert estimate.status is Status.OK


def test_a_covariance_that_was_never_definite_is_an_event_with_its_frame() -> None:
    problem = replace(plain_problem(SCENE), initial_covariance=-np.eye(6))
    estimate = ekf.joint_ekf(problem)
    assert estimate.status is Status.RECOVERED
    assert "first at frame 1, the joint covariance was no longer positive definite" in estimate.reason
    assert estimate.events[0].kind == "covariance lost"
    assert estimate.events[0].frame == 1


def test_a_state_that_is_not_finite_fails_with_its_frame() -> None:
    problem = plain_problem(SCENE)
    increment = problem.increment.copy()
    increment[4] = np.nan
    estimate = ekf.joint_ekf(replace(problem, increment=increment))
    assert estimate.status is Status.FAILED
    assert "frame 5" in estimate.reason
    assert np.isfinite(estimate.world_T_imu[:5]).all()
    assert np.isnan(estimate.world_T_imu[5:]).all()
    assert not estimate.used[SCENE.observations.frame >= 5].any()


@pytest.mark.parametrize(
    "wrong",
    [
        {"gate": 0.0},
        {"gate": 1.0},
        {"gate": 99.0},
        {"disagreeing_share": 0.0},
        {"max_landmarks": 0},
        {"unseen_frames": -1},
    ],
)
def test_settings_that_cannot_be_are_named(wrong: dict[str, float]) -> None:
    (name,) = wrong
    with pytest.raises(FgbaselineError, match=f"^{name}: .*{wrong[name]}"):
        JointSettings(**wrong)


def test_masked_observations_are_excluded() -> None:
    problem = plain_problem(SCENE)
    excluded = problem.excluded.copy()
    excluded[::3] = Excluded.PREDICTION
    o = SCENE.observations
    masked = ekf.joint_ekf(replace(problem, excluded=excluded))
    without = ekf.joint_ekf(plain_problem(replace(SCENE, observations=o.select(excluded == Excluded.NO))))
    np.testing.assert_array_equal(masked.world_T_imu, without.world_T_imu)
    np.testing.assert_array_equal(masked.used, excluded == Excluded.NO)


def test_progress_is_reported_after_every_frame_and_the_time_is_measured() -> None:
    calls: list[tuple[int, int]] = []
    estimate = ekf.joint_ekf(matched(drive()), lambda done, total: calls.append((done, total)))
    assert calls == [(k + 1, 50) for k in range(50)]
    assert np.all(estimate.seconds > 0.0)
    assert estimate.seconds_total >= estimate.seconds.sum()


def test_a_problem_is_not_changed_and_solved_the_same_way_twice() -> None:
    problem = plain_problem(SCENE)
    arrays = (problem.increment, problem.excluded, problem.initial_covariance, problem.initial_pose)
    before = [array.copy() for array in arrays]
    first, second = ekf.joint_ekf(problem), ekf.joint_ekf(problem)
    for array, kept in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(array, kept)
    np.testing.assert_array_equal(first.world_T_imu, second.world_T_imu)
    np.testing.assert_array_equal(first.landmarks.covariance, second.landmarks.covariance)


def test_it_is_installed_under_its_name() -> None:
    assert data.find_estimator("joint-ekf") is ekf.joint_ekf


def estimates(problem: Problem) -> dict[str, Estimate]:
    return {
        "joint": ekf.joint_ekf(problem),
        "separate": ekf.ekf(problem),
        "dead reckoning": ekf.dead_reckoning(problem),
    }


def test_on_clean_drives_it_is_nearer_to_the_truth_than_the_filter_with_separate_covariances() -> None:
    squares: dict[str, list[float]] = {}
    for path in ("town", "loop", "handheld"):
        for seed in (1, 2, 3):
            sequence = drive(path, seconds=20.0, features_per_frame=40.0, seed=seed)
            for name, estimate in estimates(matched(sequence)).items():
                assert estimate.status is Status.OK
                squares.setdefault(name, []).append(float(np.mean(position_errors(estimate, sequence) ** 2)))
    rmse = {name: np.sqrt(np.mean(each)) for name, each in squares.items()}
    assert rmse["joint"] < 0.8 * rmse["separate"]
    assert rmse["joint"] < 0.35 * rmse["dead reckoning"]


WILD, TAME = 1e6, 1.0


def measured(kernel: HuberKernel | None) -> MeasurementModel:
    return MeasurementModel(SCENE.camera, 1.0, kernel)


@pytest.mark.parametrize(
    ("wild", "tame", "believed"), [(3, 3, True), (4, 3, False), (4, 0, True), (3, 2, False), (0, 6, True)]
)
def test_a_frame_is_rejected_where_more_than_half_of_five_or_more_observations_disagree(
    wild: int, tame: int, believed: bool
) -> None:
    verdict = gate_observations(np.repeat([WILD, TAME], [wild, tame]), measured(None), JointSettings(gate=None))
    assert verdict.accepted.tolist() == [believed] * (wild + tame)
    assert verdict.rejection is (None if believed else EventKind.FRAME_DISAGREES)
    always = gate_observations(
        np.repeat([WILD, TAME], [wild, tame]), measured(None), JointSettings(gate=None, disagreeing_share=None)
    )
    assert always.accepted.all()
    assert (always.weight == 1.0).all()


def test_the_inflation_factor_is_the_smallest_power_of_two_with_the_median_of_chi_square() -> None:
    random = np.random.default_rng(0)
    covariance, by_motion = np.tile(np.eye(3), (101, 1, 1)), np.tile(0.1 * np.eye(3), (101, 1, 1))
    residual = random.normal(size=(101, 3)) * np.sqrt(1.0 + 0.1 * 1000.0)
    factor = inflation_factor(residual, covariance, by_motion)
    assert factor in (512.0, 1024.0, 2048.0)

    def median(f: float) -> float:
        return float(np.median((residual**2).sum(axis=1) / (1.0 + 0.1 * f)))

    assert median(factor) <= chi2.ppf(0.5, 3) < median(factor / 2.0)
    assert inflation_factor(residual, covariance, np.zeros_like(by_motion)) is None
    assert inflation_factor(np.full_like(residual, np.nan), covariance, by_motion) is None


def test_nan_residuals_reject_the_frame() -> None:
    assert gate_observations(np.full(5, np.nan), measured(None), JointSettings()).rejection is EventKind.FRAME_DISAGREES


def test_the_gate_and_the_kernel_are_those_of_chi_square_and_huber() -> None:
    at = chi2.ppf(0.99, 3)
    gated = gate_observations(np.array([0.0, 0.999 * at, 1.001 * at]), measured(None), JointSettings(gate=0.99))
    assert gated.accepted.tolist() == [True, True, False]
    assert gated.rejection is EventKind.OUTSIDE_GATE
    assert gate_observations(np.array([0.0, 0.999 * at]), measured(None), JointSettings(gate=0.99)).rejection is None
    weighted = gate_observations(
        np.array([0.0, 4.0, 16.0, 400.0]), measured(HuberKernel(2.0)), JointSettings(gate=None)
    )
    assert weighted.weight.tolist() == [1.0, 1.0, 0.5, 0.1]
    both = gate_observations(np.array([16.0, 0.0, 400.0, 4.0]), measured(HuberKernel(2.0)), JointSettings(gate=0.9999))
    assert both.order.tolist() == [1, 3, 0, 2]  # weight 1, less, rejected
    full = gate_observations(np.array([0.0, 4.0]), measured(HuberKernel(2.0)), JointSettings())
    assert full.accepted.all()
    assert (full.weight == 1.0).all()


def test_a_covariance_that_becomes_indefinite_is_an_event_with_its_frame() -> None:
    problem = plain_problem(SCENE)
    noise = problem.increment_covariance.copy()
    noise[4] = -np.eye(6)
    estimate = ekf.joint_ekf(replace(problem, increment_covariance=noise))
    assert estimate.events[0] == data.Event(5, EventKind.COVARIANCE_LOST, "12 of 12 observations rejected")
    assert not estimate.used[SCENE.observations.frame == 5].any()
    assert estimate.used[SCENE.observations.frame < 5].all()


def test_deferred_landmarks_are_counted_in_every_frame_and_reported_at_their_last() -> None:
    estimate = ekf.joint_ekf(plain_problem(at_infinity(0.0)), settings=JointSettings.textbook())
    said = (f"2 of {2 if k else 12} observations rejected" for k in range(10))
    put_off = [data.Event(k, EventKind.INITIALIZATION_DEFERRED, text) for k, text in enumerate(said)]
    never = [data.Event(9, EventKind.LANDMARK_NEVER_DETERMINED, "no accepted frame observed it", j) for j in (0, 1)]
    assert list(estimate.events) == [*put_off, *never]


def test_a_negative_variance_is_reported_in_every_frame_that_has_one() -> None:
    estimate = ekf.joint_ekf(replace(plain_problem(SCENE), initial_covariance=-np.eye(6)))
    said = "P - W^T W has a negative variance after the update"
    assert list(estimate.events) == [data.Event(k, EventKind.COVARIANCE_LOST, said) for k in range(1, 10)]
    assert estimate.reason == (
        "at 9 of 10 frames, first at frame 1, the joint covariance was no longer positive definite"
    )


def test_events_of_several_kinds_are_reported_in_turn() -> None:
    problem, _ = garbled(0.9, range(50, 51))
    estimate = ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=10))
    full = [event for event in estimate.events if event.kind == "state full"]
    waited = sum(int(event.reason.split(" of ")[0]) for event in full)
    assert estimate.reason == (
        "at 1 of 100 frames, first at frame 50, most observations disagreed with the prediction, and the frame was "
        "rejected; "
        f"at {len(full)} of 100 frames, first at frame 0, the state was full: {waited} observations were not used"
    )
