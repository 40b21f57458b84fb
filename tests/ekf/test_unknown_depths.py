"""Landmarks of unknown depth: no false information about the scale, and unobservable directions that stay so."""

import numpy as np
import pytest

from fgbaseline import ekf, smoother
from fgbaseline.data import Estimate, Problem
from fgbaseline.ekf.joint.filter import JointFilter
from fgbaseline.ekf.joint.gating import GatedObservations
from fgbaseline.ekf.joint.monocular.unknown_depths import observed_depths
from fgbaseline.ekf.joint.settings import JointSettings
from fgbaseline.ekf.joint.state import JointState
from fgbaseline.geometry import FloatArray, se3, so3, strapdown

from ..builders.inertial import simulated_problem

FRAMES = (2, 3, 5, 8)
"""in which depths and scale are found"""


def run_until(problem: Problem, k: int) -> JointFilter:
    run = JointFilter(problem, JointSettings.of(problem))
    for frame, seen in enumerate(list(problem.observations().by_frame(problem.n_frames))[:k]):
        run.process_frame(frame, seen)
    return run


def scale_sigma(estimate: Estimate, problem: Problem) -> FloatArray:
    """(4,) sigma of the distance from the start, as a share of it, at `FRAMES`."""
    truth, at = problem.sequence.truth, list(FRAMES)
    assert truth is not None
    assert estimate.covariance is not None
    apart = truth.world_T_imu[at, :3, 3] - truth.world_T_imu[0, :3, 3]
    slope = np.einsum("nji,nj->ni", estimate.world_T_imu[at, :3, :3], apart) / np.sum(apart**2, axis=1)[:, None]
    return np.sqrt(np.einsum("ni,nij,nj->n", slope, estimate.covariance[at, :3, :3], slope))


@pytest.mark.parametrize("seed", [3, 5, 6, 11])
def test_the_filter_claims_no_more_about_the_scale_than_the_smoother(seed: int) -> None:
    problem = simulated_problem("drone", seed, seconds=2.0, cameras="left")
    online = smoother.isam2(problem).by_products["isam2-online"]
    assert (scale_sigma(ekf.joint_ekf(problem), problem) > 0.8 * scale_sigma(online, problem)).all()


def unobservable(state: JointState) -> FloatArray:
    """N (size, 6) of rigid motions of the world, as `unobservable_directions` has it; anchors are landmarks too."""
    N = np.zeros((state.size, 6))
    N[:6] = se3.adjoint(se3.inverse(state.pose))
    N[strapdown.VELOCITY, 3:] = -so3.hat3(state.body.additive[:3])
    N[state.n_body :] = state._motion_jacobian[: state.count].reshape(-1, 6)
    return N


def test_a_correction_takes_unobservable_directions_to_themselves() -> None:
    run = run_until(simulated_problem("drone", 3, seconds=2.0, cameras="left"), 4)
    state = run.state
    assert run.depths is not None
    assert len(run.depths.anchored(state).slot) >= 5
    sigma = np.sqrt(np.diagonal(state.P))
    N = unobservable(state)
    state.P[:] = N @ N.T
    run._apply_correction(np.random.default_rng(1).normal(size=state.size) * np.minimum(sigma, 0.05))
    N = unobservable(state)
    np.testing.assert_allclose(state.P, N @ N.T, atol=1e-9 * np.abs(N @ N.T).max())


def test_the_error_of_an_anchor_is_that_of_the_camera_by_which_it_was_set() -> None:
    problem = simulated_problem("drone", 3, seconds=2.0, cameras="left")
    lever = problem.sequence.imu_T_cam[:3, 3]
    assert np.linalg.norm(lever) > 0.01
    run = JointFilter(problem, JointSettings.of(problem))
    for k, seen in enumerate(problem.observations().by_frame(problem.n_frames)):
        run.process_frame(k, seen)
        if k > 0 and run.state.slot_of[run.state.n_features + k] >= 0:  # landmarks began in this frame
            break
    state, slot = run.state, int(run.state.slot_of[run.state.n_features + k])
    assert slot >= 0

    def camera(delta: FloatArray) -> FloatArray:
        return np.asarray((state.pose @ se3.exp(delta))[:3, :3] @ lever + (state.pose @ se3.exp(delta))[:3, 3])

    step = 1e-6 * np.eye(6)
    J = np.stack([(camera(d) - camera(-d)) / 2e-6 for d in step], axis=1)
    own = slice(state.n_body + 3 * slot, state.n_body + 3 * slot + 3)
    np.testing.assert_allclose(state.xi[slot], camera(np.zeros(6)))
    scale = np.sqrt(np.diagonal(state.P))
    np.testing.assert_allclose(state.P[own, :6], J @ state.P[:6, :6], atol=1e-6 * scale[:6].max() * scale[own].max())
    np.testing.assert_allclose(state.P[own, own], J @ state.P[:6, :6] @ J.T, atol=1e-6 * scale[own].max() ** 2)


def test_a_rejected_update_leaves_the_prior() -> None:
    problem = simulated_problem("drone", 3, seconds=2.0, cameras="left")
    run = run_until(problem, 1)
    (*_, seen) = list(problem.observations().by_frame(problem.n_frames))[:2]
    run._predict(1)
    index = np.arange(seen.start, seen.stop)
    linearized = run._linearize(index[run.state.slot_of[run.feature[index]] >= 0])
    variance = run._variance(linearized)
    accepted = np.ones(len(linearized.observed), dtype=np.bool_)
    xi, P = run.state.xi.copy(), run.state.P.copy()
    assert run.depths is not None
    run._at_observed_depths(run.depths, linearized, variance, GatedObservations(accepted, np.ones(len(accepted))))
    assert np.count_nonzero(run.state.xi[:, 2] != xi[:, 2]) > 10
    run._restore_landmarks(xi)
    np.testing.assert_allclose(run.state.xi, xi, rtol=1e-12)
    np.testing.assert_allclose(run.state.P, P, rtol=1e-6, atol=1e-12)


def test_an_observed_depth_does_not_depend_on_the_one_before_the_less_the_prior_says() -> None:
    problem = simulated_problem("drone", 3, seconds=2.0, cameras="left")
    run = run_until(problem, 3)
    (*_, seen) = list(problem.observations().by_frame(problem.n_frames))[:4]
    run._predict(3)
    state = run.state
    index = np.arange(seen.start, seen.stop)
    index = index[state.slot_of[run.feature[index]] >= 0]
    slot = state.slot_of[run.feature[index]]
    P = state.pose_and_landmark(slot)
    P[:, :6, 6:] = P[:, 6:, :6] = 0.0
    variance = np.broadcast_to(run.row_variance, (len(index), 2))
    found = []
    for factor in (0.5, 2.0):
        xi = state.xi[slot] * [1.0, 1.0, factor]
        P[:, 8], P[:, :, 8] = 0.0, 0.0
        P[:, 8, 8] = (30.0 * xi[:, 2]) ** 2
        answer = observed_depths(
            run.camera, run.cam_T_imu, state.body, state.charts[slot], xi, P, run.measured[index], variance
        )
        assert answer.in_front.all()
        found.append(answer.xi[:, 2])
    seen_well = np.sqrt(answer.covariance[:, 8, 8]) < 0.2 * answer.xi[:, 2]
    assert np.count_nonzero(seen_well) > 10
    np.testing.assert_allclose(found[0][seen_well], found[1][seen_well], rtol=1e-2)
