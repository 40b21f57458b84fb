"""Filters on raw inertial samples: consistency, unobservable directions, and what refuses them.

`pytest -s tests/ekf/test_inertial.py` prints the mean NEES of the 15 and of each block.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from fgbaseline import ekf
from fgbaseline.data import Estimate, HuberKernel, Problem
from fgbaseline.data.estimators.registry import Estimator
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.ekf import GyroBiasPrior, JointSettings, Linearization
from fgbaseline.geometry import FgbaselineError, FloatArray, se3, so3, strapdown

from ..builders.inertial import inertial_problem, simulated_problem

SEEDS = 50
JOINT = (ekf.joint_ekf, ekf.joint_ekf_ungated, ekf.joint_ekf_textbook, ekf.joint_ekf_first_estimate)


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    with threadpool_limits(limits=1, user_api="blas"):
        yield


def state_errors(estimate: Estimate, problem: Problem) -> FloatArray:
    """(T, 15) errors of the state."""
    truth = problem.sequence.truth
    assert truth is not None
    errors = [se3.log(se3.inverse(estimate.world_T_imu) @ truth.world_T_imu)]
    for name in ("velocity", "gyroscope_bias", "accelerometer_bias"):
        errors.append(getattr(truth, name) - getattr(estimate, name))
    return np.concatenate(errors, axis=1)


def nees(errors: FloatArray, covariance: FloatArray) -> FloatArray:
    """(T - 1,) e^T P^-1 e from frame 1 on: at frame 0 position and heading have no variance."""
    whitened = np.linalg.solve(covariance[1:], errors[1:, :, None])[:, :, 0]
    return np.asarray(np.einsum("ni,ni->n", errors[1:], whitened))


def moved(problem: Problem, motion: FloatArray) -> Problem:
    """The problem in a world moved by a rotation about z and a translation (4, 4)."""
    start = problem.start
    assert start is not None
    turn = np.eye(15)
    turn[strapdown.VELOCITY, strapdown.VELOCITY] = motion[:3, :3]
    start = replace(start, velocity=motion[:3, :3] @ start.velocity, covariance=turn @ start.covariance @ turn.T)
    return replace(problem, initial_pose=motion @ problem.initial_pose, start=start)


def uncertain_world(problem: Problem, sigma: float) -> tuple[Problem, FloatArray]:
    """The problem with an uncertain position and heading of everything, and the directions N (15, 4) at the start."""
    start = problem.start
    assert start is not None
    N = directions(problem.initial_pose, start.velocity)
    return replace(problem, start=replace(start, covariance=start.covariance + sigma**2 * N @ N.T)), N


def directions(pose: FloatArray, velocity: FloatArray) -> FloatArray:
    """N (15, 4): what translations of the world and its rotation about z do to the state."""
    N = np.zeros((15, 4))
    N[:6] = se3.adjoint(se3.inverse(pose))[:, [0, 1, 2, 5]]
    N[strapdown.VELOCITY, 3] = np.cross([0.0, 0.0, 1.0], velocity)
    return N


@pytest.mark.slow
@pytest.mark.parametrize(
    ("motion", "solve"),
    [
        ("waves", ekf.dead_reckoning),
        ("waves", ekf.joint_ekf),
        ("drone", ekf.joint_ekf),
        ("town", ekf.joint_ekf),
    ],
)
def test_dead_reckoning_and_the_joint_filter_are_consistent(motion: str, solve: Estimator) -> None:
    low, high = (float(chi2.ppf(p, 15 * SEEDS)) / SEEDS for p in (0.025, 0.975))
    total, blocks = np.zeros(0), np.zeros(5)
    for seed in range(SEEDS):
        problem = inertial_problem(seed) if motion == "waves" else simulated_problem(cast(PathName, motion), seed)
        estimate = solve(problem, None)
        total = total if len(total) else np.zeros(problem.n_frames - 1)
        errors, P = state_errors(estimate, problem), estimate.state_covariance
        assert P is not None
        total += nees(errors, P) / SEEDS
        blocks += [nees(errors[:, i : i + 3], P[:, i : i + 3, i : i + 3]).mean() / SEEDS for i in range(0, 15, 3)]
    at = total[np.linspace(0, len(total) - 1, 20).astype(int)]
    inside = int(np.count_nonzero((at > low) & (at < high)))
    mean = f"{total.mean():.2f} of 15, blocks of 3 {blocks.round(2)}"
    print(f"\n{motion}, {estimate.name}: {mean}, {inside} of 20 inside")
    assert inside >= 18
    # Frames of one run hang together: each block is a mean of about 50 independent values with 3 degrees.
    assert (blocks > 2.0).all()
    assert (blocks < 4.1).all()


@pytest.mark.parametrize("linearization", [Linearization.INVARIANT, Linearization.FIRST_ESTIMATE])
def test_position_and_heading_are_unobservable(linearization: Linearization) -> None:
    problem, settings = inertial_problem(1, n_frames=25), JointSettings(linearization=linearization)
    sigma = 0.05
    known, unknown = (ekf.joint_ekf(p, settings=settings) for p in (problem, uncertain_world(problem, sigma)[0]))
    assert known.velocity is not None
    assert known.state_covariance is not None
    assert unknown.state_covariance is not None
    np.testing.assert_allclose(unknown.world_T_imu, known.world_T_imu, atol=1e-9)
    for k in range(problem.n_frames):
        if linearization is Linearization.INVARIANT:
            N = directions(known.world_T_imu[k], known.velocity[k])
            gained = unknown.state_covariance[k] - known.state_covariance[k]
            np.testing.assert_allclose(gained, sigma**2 * N @ N.T, atol=1e-10)


def test_the_textbook_filter_gains_information_on_the_heading() -> None:
    problem, sigma, settings = inertial_problem(1, n_frames=25), 0.05, JointSettings.textbook()
    known, unknown = (ekf.joint_ekf(p, settings=settings) for p in (problem, uncertain_world(problem, sigma)[0]))
    assert known.state_covariance is not None
    assert unknown.state_covariance is not None
    R = known.world_T_imu[-1, :3, :3]
    gained = R @ (unknown.state_covariance - known.state_covariance)[-1, 3:6, 3:6] @ R.T
    assert gained[2, 2] < 0.9 * sigma**2


@pytest.mark.parametrize("solve", [ekf.dead_reckoning, ekf.ekf, *JOINT])
def test_a_turned_and_shifted_world_gives_the_turned_and_shifted_answer(solve: Estimator) -> None:
    problem = inertial_problem(2, n_frames=20)
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = so3.exp_so3([0.0, 0.0, 2.0]), [3.0, -8.0, 5.0]
    there, expected = solve(moved(problem, motion), None), solve(problem, None).transformed(motion)
    np.testing.assert_allclose(there.world_T_imu, expected.world_T_imu, atol=1e-8)
    for name in ("velocity", "gyroscope_bias", "accelerometer_bias", "state_covariance"):
        np.testing.assert_allclose(getattr(there, name), getattr(expected, name), atol=1e-8, err_msg=name)
    np.testing.assert_array_equal(there.used, expected.used)


@pytest.mark.parametrize("solve", JOINT)
def test_the_joint_filter_and_its_variants_correct_dead_reckoning(solve: Estimator) -> None:
    problem = inertial_problem(4)
    alone, estimate = ekf.dead_reckoning(problem), solve(problem, None)
    assert estimate.status == "ok"
    error, without = (np.linalg.norm(state_errors(e, problem)[-1, :3]) for e in (estimate, alone))
    assert error < 0.1 * without
    assert estimate.innovations is not None
    nis = estimate.innovations.nis / estimate.innovations.degrees
    assert 0.7 < np.nanmean(nis) < 1.3


def test_biases_are_found() -> None:
    problem = inertial_problem(5)
    estimate = ekf.joint_ekf(problem)
    P = estimate.state_covariance
    assert P is not None
    start, end = (np.sqrt(np.diag(P[k])) for k in (0, -1))
    errors = state_errors(estimate, problem)[-1]
    assert (end[9:12] < 0.5 * start[9:12]).all()
    assert (end[12:] < 0.9 * start[12:]).all()
    assert (np.abs(errors) < 4.0 * end).all()


def test_a_second_bias_is_refused_by_name() -> None:
    problem = inertial_problem(0, n_frames=5)
    for solve in (ekf.joint_ekf_bias, lambda p: ekf.joint_ekf(p, settings=JointSettings(gyro_bias=GyroBiasPrior()))):
        with pytest.raises(FgbaselineError, match="joint-ekf-bias takes body velocities only"):
            solve(problem)


def test_frames_without_observations_are_predicted() -> None:
    problem = inertial_problem(6, n_frames=12)
    o = problem.sequence.observations
    blind = replace(problem, excluded=np.where((o.frame > 4) & (o.frame < 8), 1, problem.excluded).astype(np.uint8))
    for solve in (ekf.ekf, ekf.joint_ekf):
        estimate = solve(blind)
        assert estimate.status == "ok"
        assert estimate.state_covariance is not None
        position = np.trace(estimate.state_covariance[:, :3, :3], axis1=1, axis2=2)
        assert (np.diff(position[4:8]) > 0.0).all()


def test_a_tighter_kernel_gives_a_larger_covariance() -> None:
    problem = inertial_problem(7, n_frames=10)
    loose, tight = (ekf.joint_ekf(replace(problem, kernel=HuberKernel(k))) for k in (50.0, 0.5))
    assert loose.covariance is not None
    assert tight.covariance is not None
    assert np.trace(tight.covariance[-1]) > np.trace(loose.covariance[-1])
