"""Covariances go where their poses go: the NEES knows neither the world nor the body that the files are written in."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline import compare as figures
from fgbaseline import data
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.reports.comparison import compare

from ..conftest import RECORDINGS

T = 120
SIGMA = np.array([0.02, 0.02, 0.05, 0.004, 0.004, 0.008])
TWISTS = st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6).map(np.array)


def dead_reckoned(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Truth and estimate (T, 4, 4) that drifts from the first pose on, and the covariance (T, 6, 6) of that drift."""
    random = np.random.default_rng(seed)
    steps = se3.exp(np.tile([0.8, 0.0, 0.01, 0.002, 0.0, 0.012], (T - 1, 1)))
    truth = se3.compose(steps)
    noisy = steps @ se3.exp(SIGMA * random.normal(size=(T - 1, 6)))
    covariance = np.zeros((T, 6, 6))
    for k, step in enumerate(noisy):
        A = se3.adjoint(se3.inverse(step))
        covariance[k + 1] = A @ covariance[k] @ A.T + np.diag(SIGMA**2)
    return truth, se3.compose(noisy), covariance


def nees(folder: Path, truth: FloatArray, poses: FloatArray, covariance: FloatArray, **options: object) -> float:
    """The mean NEES that a comparison of two files gives."""
    t = 0.1 * np.arange(len(truth))
    data.write_tum(folder / "truth.tum", t, truth)
    data.write_trajectory_npz(folder / "mine.npz", t, poses, covariance)
    found = compare(folder / "truth.tum", folder / "mine.npz", **options).summary.estimates["mine"].nees
    assert found is not None
    assert found.mean is not None
    return found.mean


@settings(max_examples=15)
@given(TWISTS, st.sampled_from(["se3", "first-pose"]), st.integers(0, 99))
def test_nees_is_invariant_to_a_rigid_motion_that_the_alignment_undoes(
    tmp_path_factory: pytest.TempPathFactory, twist: FloatArray, kind: str, seed: int
) -> None:
    folder = tmp_path_factory.mktemp("world")
    truth, poses, covariance = dead_reckoned(seed)
    expected = nees(folder, truth, poses, covariance, align="none")
    assert 0.3 < expected < 30.0  # errors of one path are correlated: its mean scatters as a single pose's
    assert nees(folder, truth, se3.exp(twist) @ poses, covariance, align=kind) == pytest.approx(expected, rel=1e-6)


@settings(max_examples=15)
@given(TWISTS, st.sampled_from(["none", "se3"]), st.integers(0, 99))
def test_nees_is_invariant_to_a_common_body_frame(
    tmp_path_factory: pytest.TempPathFactory, twist: FloatArray, kind: str, seed: int
) -> None:
    folder = tmp_path_factory.mktemp("body")
    truth, poses, covariance = dead_reckoned(seed)
    expected = nees(folder, truth, poses, covariance, align=kind)
    imu_T_cam = se3.exp(twist)
    data.write_kitti(folder / "extrinsic.txt", imu_T_cam[None])
    of_camera = figures.covariance_of_body(covariance, imu_T_cam)
    given_as = {"reference_body": "camera", "estimate_body": "camera", "extrinsic": folder / "extrinsic.txt"}
    found = nees(folder, truth @ imu_T_cam, poses @ imu_T_cam, of_camera, align=kind, **given_as)
    assert found == pytest.approx(expected, rel=1e-6)


def test_the_adjoint_carries_a_perturbation_to_another_body() -> None:
    random = np.random.default_rng(0)
    body_T_other, pose, e = se3.exp(random.normal(size=6)), se3.exp(random.normal(size=6)), 1e-4 * random.normal(size=6)
    moved = se3.log(se3.inverse(pose @ body_T_other) @ (pose @ se3.exp(e)) @ body_T_other)
    np.testing.assert_allclose(
        figures.covariance_of_body(np.outer(e, e)[None], body_T_other)[0], np.outer(moved, moved), atol=1e-14
    )


@pytest.mark.parametrize("scale", [0.01, 3.0])
def test_a_scale_is_carried_with_the_positions(scale: float, tmp_path: Path) -> None:
    truth, poses, covariance = dead_reckoned(3)
    expected = nees(tmp_path, truth, poses, covariance, align="sim3")
    smaller = poses.copy()
    smaller[:, :3, 3] *= scale
    found = nees(tmp_path, truth, smaller, figures.scaled_covariance(covariance, scale), align="sim3")
    assert found == pytest.approx(expected, rel=1e-6)


def test_an_uncertain_start_is_taken_out_of_what_grows_from_it(tmp_path: Path) -> None:
    truth, poses, covariance = dead_reckoned(4)
    expected = nees(tmp_path, truth, poses, covariance, align="first-pose")
    start = np.diag([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    A = se3.adjoint(se3.inverse(poses) @ poses[0])
    uncertain = covariance + A @ start @ np.swapaxes(A, 1, 2)
    assert nees(tmp_path, truth, poses, uncertain, align="se3") == pytest.approx(expected, rel=1e-6)


def test_covariances_of_absolute_poses_are_held_beside_the_aligned_errors(tmp_path: Path) -> None:
    truth, _, _ = dead_reckoned(5)
    sigma = np.repeat([0.1, 0.01], 3)
    poses = truth @ se3.exp(sigma * np.random.default_rng(5).normal(size=(T, 6)))
    covariance = np.tile(np.diag(sigma**2), (T, 1, 1))
    assert figures.covariance_since_first(poses, covariance) is None
    moved = nees(tmp_path, truth, se3.exp([9.0, 1.0, -3.0, 0.1, 0.2, 2.0]) @ poses, covariance, align="se3")
    assert moved == pytest.approx(6.0, abs=1.0)


@pytest.mark.parametrize("kind", [None, "none", "yaw", "se3", "first-pose"])
def test_case_30_covariances_under_an_alignment(kind: str | None) -> None:
    folder = RECORDINGS / "cases" / "30-nees"
    if not folder.is_dir():
        pytest.skip(f"cases/30-nees is not in {RECORDINGS} (set FGBASELINE_RECORDINGS)")
    result = compare(folder / "truth.npz", folder / "right_order.npz", align=kind)
    found = result.summary.estimates["right_order"].nees
    assert found is not None
    assert found.mean == pytest.approx(5.44, abs=0.01)
    assert any("(NEES 5.44 over 399 poses" in sentence for sentence in result.verdict)
