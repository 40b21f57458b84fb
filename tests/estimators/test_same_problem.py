"""One measurement model: every estimator and every judge sees the same residual, Jacobian, noise and robust weight."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline.compare.residuals.cost import cost, pixel_squares
from fgbaseline.data import Estimate, HuberKernel, Landmarks, Problem
from fgbaseline.diagnosis.window_adjustment.residuals import WindowData, concatenate_windows, pixel_terms
from fgbaseline.ekf.joint.gating import gate_observations
from fgbaseline.ekf.joint.settings import JointSettings
from fgbaseline.ekf.joint.update import Innovation, StackedJacobian
from fgbaseline.ekf.pose_update import pose_innovation
from fgbaseline.geometry import se3
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.measurement_model import mahalanobis_squared, three_rows
from fgbaseline.geometry.stereo_camera import PIXEL_ROWS
from fgbaseline.geometry.triangulation import triangulate_tracks
from fgbaseline.smoother.batch.full_graph import full_graph
from fgbaseline.smoother.graph.factors import FactorBuilder
from fgbaseline.smoother.graph.gtsam_conversions import values_from_state
from fgbaseline.smoother.graph.keys import landmark_key, pose_key

from ..builders.synthetic import Scene, plain_problem, with_pixels

SEEDS = st.integers(0, 2**32 - 1)
V = 0.25
"""px^2, as in `plain_problem`"""


def disagreeing(seed: int, kernel: HuberKernel | None = None) -> Problem:
    """A scene whose vL and vR differ by some 6 px, twelve sigmas, so that four rows and three have other norms."""
    sequence = Scene(frames=4, n_points=10, seed=seed % 1000).sequence()
    random = np.random.default_rng(seed)
    pixel = sequence.observations.pixel + 3.0 * random.normal(size=(40, 1)) * [0.0, 1.0, 0.0, -1.0]
    return plain_problem(with_pixels(sequence, pixel), kernel)


def disturbed(problem: Problem, seed: int) -> Estimate:
    """The truth, moved by some millimeters and milliradians."""
    truth, random = problem.sequence.truth, np.random.default_rng(seed)
    assert truth is not None
    assert truth.landmarks is not None
    poses = truth.world_T_imu @ se3.exp(0.002 * random.normal(size=(4, 6)))
    points = truth.landmarks + 0.05 * random.normal(size=truth.landmarks.shape)
    landmarks = Landmarks(np.arange(len(points)), points)
    return Estimate(name="some", world_T_imu=poses, covariance=None, landmarks=landmarks, used=problem.mask)


@settings(max_examples=20)
@given(SEEDS)
def test_one_state_and_one_observation_have_one_residual_and_one_jacobian_everywhere(seed: int) -> None:
    problem = disagreeing(seed, HuberKernel())
    estimate, model, k = disturbed(problem, seed), problem.measurement, 2
    s, o = problem.sequence, problem.observations()
    pose, cam_T_imu, points = estimate.world_T_imu[k], se3.inverse(s.imu_T_cam), estimate.landmarks.position
    seen = list(o.by_frame(4))[k]
    points, pixel = points[o.landmark[seen]], o.pixel[seen]
    documented = pose_innovation(model, cam_T_imu, pose, points, pixel)
    predicted = predict(s.camera, cam_T_imu, pose, points)
    residual, pose_jacobian = three_rows(pixel) - predicted.pixel, predicted.pose_jacobian()
    by_point = predicted.point_jacobian()[:, :, :3]
    np.testing.assert_array_equal(documented.residual, residual)
    np.testing.assert_array_equal(documented.jacobian, pose_jacobian)
    # The judges: residuals of the comparison, and those of the reprojection in four rows.
    four = pixel - s.camera.project(se3.transform(cam_T_imu @ se3.inverse(pose), points))
    np.testing.assert_allclose(three_rows(four), residual, atol=1e-9)
    white = residual / np.sqrt(model.row_variance)
    np.testing.assert_allclose(pixel_squares(problem, four), (white**2).sum(axis=1), rtol=1e-8)
    # The diagnosis: its rows are whitened, its point moves against the pose.
    frames = np.zeros(len(points), dtype=np.int64)
    still = np.zeros((1, 6))
    data = WindowData(frames, np.arange(len(points)), three_rows(pixel), still, np.ones(1), still)
    one = concatenate_windows([(data, np.stack([pose, pose]), points)])
    window = pixel_terms(model, s.imu_T_cam, one, np.stack([pose, pose]), points, np.zeros((1, 8)))
    np.testing.assert_allclose(window.residual.T, white, rtol=1e-7, atol=1e-9)
    in_white = by_point / np.sqrt(model.row_variance)[:, None]
    np.testing.assert_allclose(np.moveaxis(window.J_point, 2, 0), in_white, rtol=1e-7, atol=1e-9)
    # The graph.
    values, factors = (
        values_from_state(estimate.world_T_imu, estimate.landmarks),
        FactorBuilder(replace(problem, kernel=None)),
    )
    turned = np.r_[3:6, 0:3]
    for i, j in enumerate(o.landmark[seen]):
        factor = factors.observation(k, landmark_key(int(j)), three_rows(pixel[i]))
        np.testing.assert_allclose(-np.asarray(factor.unwhitenedError(values)), residual[i], atol=1e-8)
        A, b = factor.linearize(values).jacobian()
        np.testing.assert_allclose(b, white[i], rtol=1e-7, atol=1e-8)
        scale = np.sqrt(model.row_variance)[:, None]
        expected = {pose_key(k): pose_jacobian[i][:, turned], landmark_key(int(j)): by_point[i]}
        blocks = np.concatenate([expected[key] for key in factor.keys()], axis=1)  # noqa: SIM118
        np.testing.assert_allclose(A * scale, blocks, rtol=1e-6, atol=1e-6)


@settings(max_examples=20)
@given(SEEDS, st.floats(0.5, 4.0))
def test_one_observation_has_one_robust_weight_where_the_state_is_known(seed: int, threshold: float) -> None:
    problem = disagreeing(seed, HuberKernel(threshold))
    estimate, model = disturbed(problem, seed), problem.measurement
    s, o = problem.sequence, problem.observations()
    seen, cam_T_imu, pose = list(o.by_frame(4))[1], se3.inverse(s.imu_T_cam), estimate.world_T_imu[1]
    points, pixel = estimate.landmarks.position[o.landmark[seen]], o.pixel[seen]
    predicted = predict(s.camera, cam_T_imu, pose, points)
    residual = three_rows(pixel) - predicted.pixel
    norm = np.sqrt((residual**2 / (V * np.array([1.0, 1.0, 0.5]))).sum(axis=1))
    expected = np.minimum(1.0, threshold / norm)
    # The documented filter and the joint one, with Sigma = 0.
    ekf = model.weight(pose_innovation(model, cam_T_imu, pose, points, pixel).nis_per_observation(np.zeros((6, 6))))
    np.testing.assert_allclose(ekf, expected, rtol=1e-9)
    n = len(points)
    H = StackedJacobian(np.arange(n), predicted.pose_jacobian(), predicted.point_jacobian()[:, :, :3])
    innovation = Innovation.of(H, residual, np.zeros((6 + 3 * n, 6 + 3 * n)))
    joint = gate_observations(innovation.nis_per_observation(model.row_variance), model, JointSettings()).weight
    np.testing.assert_allclose(joint, expected, rtol=1e-9)
    # The diagnosis.
    still = np.zeros((1, 6))
    data = WindowData(np.zeros(n, dtype=np.int64), np.arange(n), three_rows(pixel), still, np.ones(1), still)
    two = np.stack([pose, pose])
    terms = pixel_terms(model, s.imu_T_cam, concatenate_windows([(data, two, points)]), two, points, np.zeros((1, 8)))
    np.testing.assert_allclose(terms.weight, expected, rtol=1e-9)
    # The graph: GTSAM multiplies residual and Jacobian by the root of the weight.
    values = values_from_state(estimate.world_T_imu, estimate.landmarks)
    robust, plain = FactorBuilder(problem), FactorBuilder(replace(problem, kernel=None))
    for i, j in enumerate(o.landmark[seen]):
        weighted, full = (
            factors.observation(1, landmark_key(int(j)), three_rows(pixel[i])).linearize(values).jacobian()[1]
            for factors in (robust, plain)
        )
        assert weighted @ weighted == pytest.approx(expected[i] * (full @ full), rel=1e-7)


@settings(max_examples=20)
@given(SEEDS)
def test_three_rows_and_the_printed_four_weigh_a_residual_alike_but_for_what_no_state_changes(seed: int) -> None:
    # r^T (H Sigma H^T + V)^-1 r of four rows is that of three plus (vL - vR)^2 / (2 V).
    random = np.random.default_rng(seed)
    H, residual, half = random.normal(size=(5, 3, 6)), random.normal(size=(5, 4)), random.normal(size=(6, 6))
    sigma, four = half @ half.T, H[:, list(PIXEL_ROWS)]
    S = four @ sigma @ np.swapaxes(four, 1, 2) + V * np.eye(4)
    whole = np.einsum("ni,ni->n", residual, np.linalg.solve(S, residual[:, :, None])[:, :, 0])
    three = H @ sigma @ np.swapaxes(H, 1, 2) + np.diag(V * np.array([1.0, 1.0, 0.5]))
    apart = (residual[:, 1] - residual[:, 3]) ** 2 / (2.0 * V)
    np.testing.assert_allclose(mahalanobis_squared(three_rows(residual), three) + apart, whole, rtol=1e-9)


@pytest.mark.parametrize("kernel", [None, HuberKernel(1.0), HuberKernel()])
@settings(max_examples=20)
@given(SEEDS)
def test_one_state_has_one_cost_in_the_graph_the_comparison_and_the_triangulation(
    kernel: HuberKernel | None, seed: int
) -> None:
    problem = disagreeing(seed, kernel)
    first, second = disturbed(problem, seed), disturbed(problem, seed + 1)
    first, second = (replace(e, world_T_imu=first.world_T_imu) for e in (first, second))
    graph = full_graph(problem)
    by_graph = [graph.error(values_from_state(e.world_T_imu, e.landmarks)) for e in (first, second)]
    by_numpy = [cost(problem, e, problem.mask) for e in (first, second)]
    o, model = problem.observations(), problem.measurement
    poses = first.world_T_imu[o.frame] @ problem.sequence.imu_T_cam

    def by_model(estimate: Estimate) -> float:
        q = se3.transform(se3.inverse(poses), estimate.landmarks.position[o.landmark])
        white = model.whitened(o.pixel - problem.sequence.camera.project(q))
        return 0.5 * float(model.loss((white**2).sum(axis=1)).sum())

    difference = by_graph[1] - by_graph[0]
    assert by_numpy[1] - by_numpy[0] == pytest.approx(difference, rel=1e-9, abs=1e-7)
    assert by_model(second) - by_model(first) == pytest.approx(difference, rel=1e-9, abs=1e-7)
    # Nothing near the triangulated points has a lower cost.
    found = triangulate_tracks(model, poses, o.landmark, o.pixel, 10)
    best = by_model(replace(first, landmarks=Landmarks(np.arange(10), found.position)))
    for step in 1e-2 * np.eye(3):
        for sign in (1.0, -1.0):
            moved = replace(first, landmarks=Landmarks(np.arange(10), found.position + sign * step))
            assert by_model(moved) >= best * (1.0 - 1e-9)
