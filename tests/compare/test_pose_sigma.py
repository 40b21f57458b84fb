"""The 1-sigma of a pose is that of samples drawn from its covariance, in any frame."""

from dataclasses import replace

import numpy as np
import pytest

from fgbaseline import compare
from fgbaseline.data import Estimate
from fgbaseline.geometry import se3


def with_covariances(P: np.ndarray) -> Estimate:
    rng = np.random.default_rng(4)
    poses = se3.exp(rng.normal(size=(len(P), 6)))
    return Estimate("mine", poses, used=np.zeros(0, dtype=bool), covariance=P)


def test_sigma_is_the_root_mean_square_of_sampled_position_and_rotation_errors() -> None:
    rng = np.random.default_rng(5)
    root = rng.normal(size=(6, 6)) * 1e-3
    estimate = with_covariances(np.array([root @ root.T]))
    errors = root @ rng.normal(size=(6, 100_000))
    poses = estimate.world_T_imu[0] @ se3.exp(errors.T)
    distance = np.linalg.norm(poses[:, :3, 3] - estimate.world_T_imu[0, :3, 3], axis=1)
    sigma = compare.pose_sigma(estimate)
    assert sigma.position_final == pytest.approx(np.sqrt(np.mean(distance**2)), rel=0.02)
    angle = np.linalg.norm(se3.log(se3.inverse(estimate.world_T_imu[0]) @ poses)[:, 3:], axis=1)
    assert sigma.rotation_final_deg == pytest.approx(np.degrees(np.sqrt(np.mean(angle**2))), rel=0.02)


def test_a_rigid_motion_of_the_world_leaves_sigma_unchanged() -> None:
    P = np.array([np.diag([1.0, 4.0, 4.0, 0.01, 0.02, 0.01]) * k for k in (1.0, 2.0, 3.0)])
    before = compare.pose_sigma(with_covariances(P))
    after = compare.pose_sigma(with_covariances(P).transformed(se3.exp([1.0, 2.0, 3.0, 0.3, 0.2, 0.1])))
    assert np.array_equal(before.position, after.position)
    assert before.position_rmse == pytest.approx(3.0 * np.sqrt(2.0))
    assert before.position_final == pytest.approx(3.0 * np.sqrt(3.0))


def test_a_fixed_pose_has_zero_and_an_invalid_covariance_has_no_sigma() -> None:
    P = np.array([np.zeros((6, 6)), np.eye(6), -np.eye(6)])
    sigma = compare.pose_sigma(with_covariances(P))
    assert sigma.position[0] == 0.0
    assert np.isnan(sigma.position[2])
    assert sigma.position_final == pytest.approx(np.sqrt(3.0))
    none = compare.pose_sigma(replace(with_covariances(P), covariance=None))
    assert np.isnan(none.position_rmse)
    assert np.isnan(none.rotation_final_deg)
