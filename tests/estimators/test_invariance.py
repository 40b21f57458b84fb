"""Neither where the world's origin is nor the unit of length decides what is estimated or measured."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline import compare, data, diagnosis
from fgbaseline.data import Estimate, LandmarkPrior, Problem, Sequence, Truth
from fgbaseline.geometry import FloatArray, se3, so3

from ..builders.synthetic import drive, first_frames

ESTIMATORS = (
    "dead-reckoning",
    "landmark-mapping",
    "ekf",
    "joint-ekf",
    "joint-ekf-textbook",
    "joint-ekf-first-estimate",
    "isam2",
    "fixed-lag",
    "batch",
)
"""each with its by-products: isam2-online is one of isam2"""
REAL = "utias/2011_09_26_drive_0036_sync_KLT.mat"
FRAMES = 60
"""of the real recording, 10 per second: longer than the window of `fixed-lag`"""
MOTIONS = st.tuples(st.integers(0, 2**32 - 1), st.floats(0.0, 4.0))
"""a direction and a turn, and the logarithm of the distance in m"""


def recorded(source: str) -> Sequence:
    """A simulated drive, or the first frames of a real one."""
    return (
        drive(seconds=4.0, features_per_frame=15.0, wrong=0.03)
        if source == "drive"
        else first_frames(data.read(source), FRAMES)
    )


@cache
def posed(source: str) -> Problem:
    return diagnosis.calibrated(recorded(source))


def answers(name: str, problem: Problem) -> tuple[Estimate, ...]:
    """Answer of an estimator, and its by-products."""
    estimate = data.find_estimator(name)(problem)
    return estimate, *estimate.by_products.values()


@cache
def solved(name: str, source: str) -> tuple[Estimate, ...]:
    return answers(name, posed(source))


def moved(problem: Problem, motion: FloatArray) -> Problem:
    """The problem in another world: first pose, prior and truth, `motion` being new_T_old."""
    prior, truth, R = problem.landmark_prior, problem.sequence.truth, motion[:3, :3]
    if prior is not None:
        prior = LandmarkPrior(se3.transform(motion, prior.mean), R @ prior.covariance @ R.T)
    sequence = problem.sequence
    if truth is not None:
        landmarks = None if truth.landmarks is None else se3.transform(motion, truth.landmarks)
        sequence = sequence.with_truth(Truth(motion @ truth.world_T_imu, landmarks))
    return replace(problem, initial_pose=motion @ problem.initial_pose, landmark_prior=prior, sequence=sequence)


def scaled(sequence: Sequence, factor: float) -> Sequence:
    """The recording with lengths in another unit: velocities, baseline, extrinsic and truth."""
    extrinsic, truth = sequence.imu_T_cam.copy(), sequence.truth
    extrinsic[:3, 3] *= factor
    if truth is not None:
        poses = truth.world_T_imu.copy()
        poses[:, :3, 3] *= factor
        truth = Truth(poses, None if truth.landmarks is None else factor * truth.landmarks)
    camera = replace(sequence.camera, baseline=factor * sequence.camera.baseline)
    return replace(
        sequence,
        linear_velocity=factor * sequence.linear_velocity,
        camera=camera,
        imu_T_cam=extrinsic,
        truth=truth,
    )


def random_motion(seed: int, distance: float) -> FloatArray:
    random = np.random.default_rng(seed)
    direction, axis = random.normal(size=(2, 3))
    motion = np.eye(4)
    motion[:3, :3] = so3.exp_so3(axis)
    motion[:3, 3] = distance * direction / np.linalg.norm(direction)
    return motion


def assert_moved_alike(name: str, source: str, motion: FloatArray, tolerance: float) -> None:
    """In another world the answers of an estimator are moved, and nothing else changes."""
    there = answers(name, moved(posed(source), motion))
    for estimate, original in zip(there, solved(name, source), strict=True):
        assert_is_moved(estimate, original, motion, tolerance)


def assert_is_moved(estimate: Estimate, original: Estimate, motion: FloatArray, tolerance: float) -> None:
    """`tolerance` in m on poses, and on landmarks as a share of their distance from the path besides."""
    back = estimate.transformed(se3.inverse(motion))
    path = original.world_T_imu[:, :3, 3]
    assert np.abs(back.world_T_imu[:, :3, 3] - path).max() < tolerance
    np.testing.assert_allclose(back.world_T_imu[:, :3, :3], original.world_T_imu[:, :3, :3], atol=1e-6)
    np.testing.assert_array_equal(back.used, original.used)
    np.testing.assert_array_equal(back.landmarks.index, original.landmarks.index)
    distance = np.linalg.norm(original.landmarks.position - path.mean(axis=0), axis=1)
    apart = np.linalg.norm(back.landmarks.position - original.landmarks.position, axis=1)
    assert (apart < tolerance + 1e-6 * distance).all()
    if original.covariance is not None:
        size = np.abs(original.covariance).max(axis=(1, 2), keepdims=True)
        assert (np.abs(np.asarray(back.covariance) - original.covariance) <= 1e-4 * size).all()


@pytest.mark.parametrize("name", ESTIMATORS)
@settings(max_examples=3)
@given(MOTIONS)
def test_a_world_moved_by_a_rigid_motion_moves_the_estimate_and_nothing_else(
    name: str, motion: tuple[int, float]
) -> None:
    path = solved(name, "drive")[0].world_T_imu[:, :3, 3]
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    assert_moved_alike(name, "drive", random_motion(motion[0], 10.0 ** motion[1]), 1e-6 * length)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_thousand_kilometers_from_the_origin_cost_no_millimeter(name: str) -> None:
    assert_moved_alike(name, "drive", random_motion(7, 1e6), 1e-3)


@pytest.mark.parametrize("name", ["dead-reckoning", "ekf", "joint-ekf", "isam2", "fixed-lag"])
def test_a_real_recording_is_the_same_wherever_its_world_begins(name: str, recordings: Callable[[str], Path]) -> None:
    assert_moved_alike(name, str(recordings(REAL)), random_motion(3, 1e4), 1e-4)


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_metrics_do_not_depend_on_the_world(seed: int) -> None:
    problem, motion = posed("drive"), random_motion(seed, 1e4)
    truth, up = problem.sequence.truth, problem.sequence.up
    assert truth is not None
    ekf, reference = (solved(name, "drive")[0] for name in ("joint-ekf", "isam2"))
    far = moved(problem, motion).sequence.truth
    assert far is not None

    def metrics(e: Estimate, r: Estimate, t: Truth, upward: FloatArray) -> FloatArray:
        table = compare.truth_errors(e, t, upward, aligned=True)
        return np.concatenate(
            [
                compare.divergence(e, r, upward).to_numpy().ravel(),
                table.to_numpy().ravel(),
                compare.nees(e, t)[1:],
                compare.map_difference(problem.sequence, e, r)["distance"].to_numpy(),
            ]
        )

    here = metrics(ekf, reference, truth, up)
    there = metrics(ekf.transformed(motion), reference.transformed(motion), far, motion[:3, :3] @ up)
    np.testing.assert_allclose(there, here, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(("source", "factor"), [("drive", 2.0), (REAL, 0.01)])
def test_in_another_unit_of_length_everything_is_the_same_but_for_the_unit(
    source: str, factor: float, recordings: Callable[[str], Path]
) -> None:
    source = source if source == "drive" else str(recordings(source))
    problem = posed(source)
    # The recording as read: what is repaired and masked, and how large the noise is, follows from it.
    other = diagnosis.calibrated(scaled(recorded(source), factor))
    unit = np.repeat([factor, 1.0], 3)
    np.testing.assert_array_equal(other.excluded, problem.excluded)
    np.testing.assert_allclose(other.increment / unit, problem.increment, rtol=1e-6, atol=1e-9)
    assert other.pixel_variance == pytest.approx(problem.pixel_variance, rel=1e-6)
    np.testing.assert_allclose(
        other.increment_covariance / (unit[:, None] * unit), problem.increment_covariance, rtol=1e-6, atol=1e-12
    )
    assert [finding.code for finding in other.findings] == [finding.code for finding in problem.findings]
    pairs = [pair for name in ESTIMATORS for pair in zip(solved(name, source), answers(name, other), strict=True)]
    for here, there in pairs:
        name = here.name
        np.testing.assert_array_equal(there.used, here.used)
        path = here.world_T_imu[:, :3, 3]
        length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        assert np.abs(there.world_T_imu[:, :3, 3] / factor - path).max() < 1e-6 * length, name
        if here.covariance is not None:
            P = np.asarray(there.covariance) / (unit[:, None] * unit)
            size = np.abs(here.covariance).max(axis=(1, 2), keepdims=True)
            assert (np.abs(P - here.covariance) <= 1e-4 * size).all(), name
