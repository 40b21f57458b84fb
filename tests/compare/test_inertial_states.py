"""Errors and consistency of velocity and biases, and their alignment with the truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import logm
from scipy.optimize import minimize_scalar

from fgbaseline import compare, ekf
from fgbaseline.compare.consistency.anees import average_nees
from fgbaseline.compare.consistency.state_nees import QUANTITIES
from fgbaseline.compare.estimate_comparison import compare_all
from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, se3, so3
from fgbaseline.geometry.strapdown import BLOCKS

from ..builders.inertial import inertial_problem
from ..builders.synthetic import Scene, plain_problem

T = 40
PROBLEM = inertial_problem(3, n_frames=25)


def drawn(seed: int, scale: float = 1.0) -> tuple[Estimate, Truth]:
    """A random estimate with correlated covariances of very different units, and truth drawn from them.

    The error of position and velocity is that of the extended pose: both turn alike with the rotation error.
    """
    rng = np.random.default_rng(seed)
    units = np.repeat([0.3, 0.02, 0.1, 1e-4, 1e-2], 3)
    L = units[:, None] * (np.eye(15) + 0.3 * rng.normal(size=(T, 15, 15)))
    error = scale * (L @ rng.normal(size=(T, 15, 1)))[:, :, 0]
    poses = se3.exp(rng.normal(size=(T, 6)))
    rest = rng.normal(size=(3, T, 3))
    estimate = Estimate(
        "drawn",
        poses,
        np.zeros(0, np.bool_),
        covariance=(L @ np.swapaxes(L, 1, 2))[:, :6, :6],
        velocity=rest[0],
        gyroscope_bias=rest[1],
        accelerometer_bias=rest[2],
        state_covariance=L @ np.swapaxes(L, 1, 2),
    )
    extended = poses.copy()
    extended[:, :3, 3] = rest[0]
    body_velocity = np.einsum("nji,nj->ni", poses[:, :3, :3], error[:, 6:9])
    truth = Truth(
        poses @ se3.exp(error[:, :6]),
        velocity=(extended @ se3.exp(np.hstack([body_velocity, error[:, 3:6]])))[:, :3, 3],
        gyroscope_bias=rest[1] + error[:, 9:12],
        accelerometer_bias=rest[2] + error[:, 12:],
    )
    return estimate, truth


def turned_world(angle: float) -> FloatArray:
    """A rotation about up and a translation (4, 4)."""
    motion = np.eye(4)
    motion[:3, :3] = so3.exp_so3(np.array([0.0, 0.0, angle]))
    motion[:3, 3] = [30.0, -20.0, 4.0]
    return motion


def extended_velocity_error(estimate: Estimate, truth: Truth, k: int) -> FloatArray:
    """Velocity (3,) of the matrix logarithm of the extended poses [[R, v, p], [0, I]] of a frame, in world axes."""
    matrices = []
    for states in (estimate, truth):
        assert states.velocity is not None
        matrix = np.eye(5)
        matrix[:3] = np.column_stack([states.world_T_imu[k, :3, :3], states.velocity[k], states.world_T_imu[k, :3, 3]])
        matrices.append(matrix)
    error: FloatArray = matrices[0][:3, :3] @ logm(np.linalg.solve(*matrices)).real[:3, 3]
    return error


def test_a_tilt_of_the_whole_world_counts_once_however_large_it_is() -> None:
    """The covariance has the tilt alone: its error is N g, with N the unobservable directions at the estimate."""
    estimate, _ = drawn(4)
    sigma, axis = 0.02, np.array([0.6, -0.8, 0.0])
    N = np.zeros((T, 15))
    N[:, :6] = se3.adjoint(se3.inverse(estimate.world_T_imu))[:, :, 3:] @ axis
    N[:, 6:9] = np.cross(axis, estimate.velocity)
    P = sigma**2 * N[:, :, None] * N[:, None, :] + 1e-12 * np.eye(15)
    motion = np.eye(4)
    for times in (0.1, 1.0, 5.0):
        motion[:3, :3] = so3.exp_so3(times * sigma * axis)
        moved = estimate.transformed(motion)
        truth = Truth(moved.world_T_imu, None, "moved", moved.velocity, moved.gyroscope_bias, moved.accelerometer_bias)
        found = compare.state_nees(replace(estimate, state_covariance=P), truth)["state"]
        np.testing.assert_allclose(found, times**2, rtol=1e-3)


def test_the_nees_of_the_state_and_of_each_block_is_the_dense_quadratic_form() -> None:
    estimate, truth = drawn(0)
    table, P = compare.state_nees(estimate, truth), estimate.state_covariance
    assert P is not None
    assert truth.velocity is not None
    assert estimate.velocity is not None
    error = compare.state_error(estimate, truth)
    back = estimate.world_T_imu @ se3.exp(error[:, :6])
    np.testing.assert_allclose(back, truth.world_T_imu, atol=1e-9)
    np.testing.assert_allclose(error[:, 6:9], truth.velocity - estimate.velocity, atol=1e-12)
    error[:, 6:9] = [extended_velocity_error(estimate, truth, k) for k in range(T)]
    for k in range(T):
        assert table["state"][k] == pytest.approx(float(error[k] @ np.linalg.inv(P[k]) @ error[k]), rel=1e-6)
        for name, block in BLOCKS.items():
            expected = error[k, block] @ np.linalg.inv(P[k, block, block]) @ error[k, block]
            assert table[name][k] == pytest.approx(float(expected), rel=1e-6)
    pose = compare.nees_table(estimate, truth)
    np.testing.assert_allclose(table["translation"], pose["position"])
    np.testing.assert_allclose(table["rotation"], pose["rotation"])


def test_errors_drawn_from_the_covariance_have_a_nees_of_their_degrees_of_freedom() -> None:
    tables = [compare.state_nees(*drawn(seed)) for seed in range(50)]
    for name, degrees in {"state": 15, **dict.fromkeys(BLOCKS, 3)}.items():
        frames = average_nees([table[name].to_numpy() for table in tables], degrees)
        inside = ((frames["low"] <= frames["anees"]) & (frames["anees"] <= frames["high"])).mean()
        assert inside >= 0.8, name
        assert frames["anees"].mean() == pytest.approx(degrees, rel=0.08), name
    overconfident = [compare.state_nees(*drawn(seed, scale=2.0))["state"].mean() for seed in range(10)]
    assert np.mean(overconfident) == pytest.approx(60.0, rel=0.1)


def test_a_turned_and_shifted_world_leaves_every_nees() -> None:
    estimate, truth = drawn(1)
    motion = turned_world(1.1)
    there = compare.state_nees(estimate.transformed(motion), truth.transformed(motion))
    np.testing.assert_allclose(there, compare.state_nees(estimate, truth), rtol=1e-6)


def test_yaw_alignment_undoes_the_unobservable_directions_also_for_velocities_with_late_truth_and_gaps() -> None:
    estimate, truth = drawn(2, scale=0.2)
    poses = truth.world_T_imu.copy()
    poses[:5] = np.nan
    poses[12:18] = np.nan
    truth = replace(truth, world_T_imu=poses)
    before = compare.truth_errors(estimate, truth, aligned=compare.Align.YAW)
    assert before["position"].isna().sum() == 11
    turned = estimate.transformed(turned_world(-2.0))
    after = compare.truth_errors(turned, truth, aligned=compare.Align.YAW)
    np.testing.assert_allclose(after["position"], before["position"], atol=1e-9)
    np.testing.assert_allclose(after["rotation_deg"], before["rotation_deg"], atol=1e-6)
    errors = [
        compare.velocity_and_bias_errors(e, truth, compare.truth_alignment(e, truth, compare.Align.YAW).rotation)
        for e in (estimate, turned)
    ]
    np.testing.assert_allclose(errors[1], errors[0], atol=1e-9)


def test_yaw_alignment_is_the_least_squares_solution() -> None:
    estimate, truth = drawn(4)
    here, there = estimate.world_T_imu[:, :3, 3], truth.world_T_imu[:, :3, 3]

    def spread(angle: float) -> float:
        moved = here @ so3.exp_so3(np.array([0.0, 0.0, angle])).T
        return float((((moved - moved.mean(axis=0)) - (there - there.mean(axis=0))) ** 2).sum())

    starts = np.linspace(-np.pi, np.pi, 13)
    lowest = min(minimize_scalar(spread, bracket=(a, a + 0.1)).fun for a in starts)
    position = compare.truth_errors(estimate, truth, aligned=compare.Align.YAW)["position"]
    assert float((position**2).sum()) == pytest.approx(lowest, rel=1e-9)


def test_summaries_have_norms_axes_and_the_share_within_three_sigma() -> None:
    pairs = [drawn(seed) for seed in range(20)]
    for name in QUANTITIES:
        inside = []
        for estimate, truth in pairs:
            table = compare.velocity_and_bias_errors(estimate, truth)
            summary = compare.quantity_summary(table, name)
            error = getattr(estimate, name) - getattr(truth, name)
            assert summary["rmse"] == pytest.approx(np.sqrt((error**2).sum(axis=1).mean()))
            assert [summary[f"rmse_{axis}"] for axis in "xyz"] == pytest.approx(np.sqrt((error**2).mean(axis=0)))
            assert summary["final"] == pytest.approx(np.linalg.norm(error[-1]))
            inside.append(summary["inside_3_sigma"])
        assert np.mean(inside) == pytest.approx(0.9973, abs=0.004)


def test_unknown_values_are_missing_and_not_zero() -> None:
    estimate, truth = drawn(5)
    poses_only = Truth(truth.world_T_imu)
    table = compare.velocity_and_bias_errors(estimate, poses_only)
    assert table["velocity"].isna().all()
    assert np.isnan(compare.quantity_summary(table, "velocity")["rmse"])
    nees = compare.state_nees(estimate, poses_only)
    assert nees["translation"].notna().all()
    assert nees[["state", "velocity"]].isna().all(axis=None)
    without = compare.state_nees(replace(estimate, state_covariance=None), truth)
    assert without.isna().all(axis=None)


def test_a_run_on_raw_inertial_data_has_velocity_and_bias_against_truth_and_reference() -> None:
    truth = PROBLEM.sequence.truth
    assert truth is not None
    estimates = {
        name: solve(PROBLEM) for name, solve in (("joint-ekf", ekf.joint_ekf), ("dead-reckoning", ekf.dead_reckoning))
    }
    run = compare_all(PROBLEM, estimates, {})
    assert run.reference == "joint-ekf"
    joint, dead = run.results["joint-ekf"].inertial, run.results["dead-reckoning"].inertial
    assert joint is not None
    assert dead is not None
    assert joint.divergence is None
    assert dead.divergence is not None
    assert joint.errors is not None
    assert joint.nees is not None
    here, there = estimates["dead-reckoning"].velocity, estimates["joint-ekf"].velocity
    assert here is not None
    assert there is not None
    difference = here[-1] - there[-1]
    assert dead.divergence["velocity"].iloc[-1] == pytest.approx(np.linalg.norm(difference))
    assert joint.nees["state"][1:].notna().all()
    assert np.isnan(joint.nees["state"][0])  # position and heading of frame 0 have no variance
    assert joint.nees["velocity"].notna().all()
    assert 5.0 < joint.nees["state"].mean() < 30.0
    assert compare.quantity_summary(joint.errors, "velocity")["inside_3_sigma"] > 0.9
    aligned = compare.truth_errors(estimates["joint-ekf"], truth, PROBLEM.sequence.up, aligned=compare.Align.YAW)
    np.testing.assert_array_equal(run.results["joint-ekf"].truth_aligned, aligned)


def test_a_run_on_body_velocities_has_neither() -> None:
    problem = plain_problem(Scene(frames=5, n_points=4).sequence())
    run = compare_all(problem, {"dead-reckoning": ekf.dead_reckoning(problem)}, {})
    assert run.results["dead-reckoning"].inertial is None
