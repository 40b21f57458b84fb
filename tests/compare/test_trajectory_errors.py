"""Errors are those of evo, alignment is the best rigid motion, and along, across and up are what they say."""

from dataclasses import replace

import numpy as np
import pytest
from evo.core.metrics import APE, PoseRelation
from evo.core.trajectory import PosePath3D
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import compare, ekf
from fgbaseline.compare.trajectory.along_track_frame import along_track_frame
from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FgbaselineError, FloatArray, se3, so3

from ..builders.synthetic import Scene, drive, matched

STATISTICS = ("rmse", "mean", "median", "max")
Z_UP = (0.0, 0.0, 1.0)


def wandering(frames: int, seed: int, step: float = 1.0) -> FloatArray:
    """Poses of a random walk over SE(3)."""
    random = np.random.default_rng(seed)
    return se3.compose(se3.exp(step * random.normal(size=(frames - 1, 6)) * np.repeat([1.0, 0.2], 3)))


def disturbed(poses: FloatArray, seed: int, size: float = 0.3) -> FloatArray:
    """The poses, each with a random error, and all of them moved elsewhere."""
    random = np.random.default_rng(seed)
    return se3.exp(random.normal(size=6)) @ poses @ se3.exp(size * random.normal(size=(len(poses), 6)))


def estimated(poses: FloatArray) -> Estimate:
    return Estimate("filter", poses, np.zeros(0, dtype=np.bool_))


def evo_statistics(
    estimate: FloatArray, truth: FloatArray, relation: PoseRelation, *, aligned: bool
) -> dict[str, float]:
    reference, path = PosePath3D(poses_se3=list(truth)), PosePath3D(poses_se3=list(estimate.copy()))
    if aligned:
        path.align(reference, correct_scale=False)
    ape = APE(relation)
    ape.process_data((reference, path))
    statistics: dict[str, float] = ape.get_all_statistics()
    return statistics


@pytest.mark.parametrize("aligned", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_errors_of_random_paths_are_those_of_evo(seed: int, aligned: bool) -> None:
    truth = wandering(60, seed)
    estimate = disturbed(truth, seed + 100)
    table = compare.truth_errors(estimated(estimate), Truth(truth), aligned=aligned)
    position = evo_statistics(estimate, truth, PoseRelation.translation_part, aligned=aligned)
    rotation = evo_statistics(estimate, truth, PoseRelation.rotation_angle_deg, aligned=aligned)
    for name in STATISTICS:
        assert compare.summarized(table["position"])[name] == pytest.approx(position[name], abs=1e-9, rel=1e-9)
        assert compare.summarized(table["rotation_deg"])[name] == pytest.approx(rotation[name], abs=1e-6)


@pytest.mark.parametrize("path", ["town", "loop", "handheld"])
def test_errors_of_simulated_drives_are_those_of_evo(path: str) -> None:
    sequence = drive(path)  # type: ignore[arg-type]
    estimate = ekf.dead_reckoning(matched(sequence))
    assert sequence.truth is not None
    for aligned in (False, True):
        table = compare.truth_errors(estimate, sequence.truth, sequence.up, aligned=aligned)
        expected = evo_statistics(
            estimate.world_T_imu, sequence.truth.world_T_imu, PoseRelation.translation_part, aligned=aligned
        )
        for name in STATISTICS:
            assert compare.summarized(table["position"])[name] == pytest.approx(expected[name], abs=1e-9, rel=1e-9)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 40), spread=st.floats(1e-3, 1e3))
def test_alignment_undoes_a_rigid_motion_and_inverts_when_swapped(seed: int, n: int, spread: float) -> None:
    random = np.random.default_rng(seed)
    there = spread * random.normal(size=(n, 3))
    motion = se3.exp(random.normal(size=6) * 2.0)
    here = se3.transform(motion, there)
    forth, back = compare.align_se3(there, here), compare.align_se3(here, there)
    np.testing.assert_allclose(se3.transform(forth, there), here, atol=1e-9 * max(1.0, spread))
    np.testing.assert_allclose(se3.transform(back, here), there, atol=1e-9 * max(1.0, spread))
    if n > 3:
        np.testing.assert_allclose(forth, motion, atol=1e-8 * max(1.0, spread))
        np.testing.assert_allclose(forth @ back, np.eye(4), atol=1e-8 * max(1.0, spread))


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(4, 40))
def test_no_small_motion_fits_better_and_swapping_the_paths_inverts_the_alignment(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    there, here = 3.0 * random.normal(size=(n, 3)), 3.0 * random.normal(size=(n, 3))
    best = compare.align_se3(there, here)
    assert so3.orthogonality_error(best[:3, :3]) < 1e-9
    lowest = np.sum((se3.transform(best, there) - here) ** 2)
    for _ in range(10):
        other = best @ se3.exp(0.1 * random.normal(size=6))
        assert np.sum((se3.transform(other, there) - here) ** 2) >= lowest * (1 - 1e-12)


DEGENERATE = {
    "one pose": np.array([[4.0, -2.0, 1.0]]),
    "two poses": np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]),
    "standing": np.tile([3.0, 1.0, -2.0], (20, 1)),
    "straight line": np.arange(20.0)[:, None] * [2.0, -1.0, 0.5],
    "flat": np.column_stack([np.arange(20.0), np.arange(20.0) ** 2, np.zeros(20)]),
    "mirror image wanted": np.random.default_rng(4).normal(size=(20, 3)),
}


@pytest.mark.parametrize("name", DEGENERATE)
@pytest.mark.parametrize("target", ["itself", "turned", "reflected", "standing", "line"])
def test_degenerate_paths_get_a_finite_proper_rotation(name: str, target: str) -> None:
    path = DEGENERATE[name]
    reference = {
        "itself": path,
        "turned": se3.transform(se3.exp([1.0, 2.0, 3.0, 0.3, -2.0, 1.0]), path),
        "reflected": path * [1.0, 1.0, -1.0],
        "standing": np.zeros_like(path),
        "line": np.arange(float(len(path)))[:, None] * [0.0, 1.0, 0.0],
    }[target]
    T = compare.align_se3(path, reference)
    assert np.isfinite(T).all()
    assert so3.orthogonality_error(T[:3, :3]) < 1e-9
    if target in ("itself", "turned"):
        np.testing.assert_allclose(se3.transform(T, path), reference, atol=1e-9)


@pytest.mark.parametrize(
    ("positions", "reference"),
    [(np.empty((0, 3)), np.empty((0, 3))), (np.zeros((2, 3)), np.zeros((3, 3))), (np.full((2, 3), np.nan),) * 2],
)
def test_alignment_of_nothing_is_refused(positions: FloatArray, reference: FloatArray) -> None:
    with pytest.raises(FgbaselineError, match="alignment needs"):
        compare.align_se3(positions, reference)


def test_no_comparison_changes_or_needs_to_write_its_arguments() -> None:
    sequence = drive()
    problem = matched(sequence)
    estimate, other = ekf.ekf(problem), ekf.dead_reckoning(problem)
    assert sequence.truth is not None
    arrays = [
        sequence.truth.world_T_imu,
        *(a for e in (estimate, other) for a in (e.world_T_imu, e.covariance, e.used, e.landmarks.position)),
    ]
    before = [np.copy(a) for a in arrays if a is not None]
    for a in arrays:
        assert a is not None
        a.flags.writeable = False
    compare.align_se3(estimate.world_T_imu[:, :3, 3], other.world_T_imu[:, :3, 3])
    compare.divergence(estimate, other, sequence.up)
    compare.truth_errors(estimate, sequence.truth, sequence.up, aligned=True)
    table = compare.reprojection(sequence, estimate)
    copy = table.copy()
    compare.reprojection_summary(table)
    compare.component_summary(table)
    compare.reprojection_by(table, "frame")
    assert table.equals(copy)
    compare.used_by_all([estimate, other])
    compare.nees(estimate, sequence.truth)
    compare.trust(problem, estimate)
    for a, b in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(a, b)


def turning_left(frames: int = 40) -> FloatArray:
    """Poses of a car at 10 m/s on level ground (z up), along a circle of radius 50 m that bends to the left."""
    return se3.compose(se3.exp(np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.02], (frames - 1, 1))))


@pytest.mark.parametrize(
    ("offset", "component"),
    [((0.7, 0.0, 0.0), "along"), ((0.0, 0.7, 0.0), "across"), ((0.0, 0.0, 0.7), "up")],
)
@pytest.mark.parametrize("down", [False, True], ids=["z up", "z down"])
def test_a_car_turning_left_is_ahead_left_or_above(
    offset: tuple[float, float, float], component: str, down: bool
) -> None:
    # The body is x forward, y left, z up; in the other world the same drive is described with y right, z down.
    flip = np.diag([1.0, -1.0, -1.0, 1.0]) if down else np.eye(4)
    reference = turning_left()
    beside = np.eye(4)
    beside[:3, 3] = offset
    estimate = reference @ beside
    table = compare.pose_errors(flip @ estimate @ flip, flip @ reference @ flip, flip[:3, :3] @ Z_UP)
    inner = table.iloc[1:-1]  # the direction of travel is that of the chord, which at the ends has one side only
    for name in ("along", "across", "up"):
        expected = 0.7 if name == component else 0.0
        np.testing.assert_allclose(inner[name], expected, atol=1e-3 if name != "up" else 1e-12)
    np.testing.assert_allclose(table["position"], 0.7)
    np.testing.assert_allclose(table["rotation_deg"], 0.0, atol=1e-6)
    np.testing.assert_allclose(table["traveled"], np.arange(40) * 2 * 50 * np.sin(0.01), rtol=1e-12)
    assert table.index.name == "frame"


@given(seed=st.integers(0, 2**32 - 1))
def test_along_across_and_up_are_the_parts_of_the_difference(seed: int) -> None:
    truth = wandering(12, seed)
    up = np.random.default_rng(seed).normal(size=3)
    table = compare.pose_errors(disturbed(truth, seed + 1), truth, up)
    parts = np.linalg.norm(table[["along", "across", "up"]].to_numpy(), axis=1)
    np.testing.assert_allclose(parts, table["position"], rtol=1e-9)


def test_a_standing_start_has_the_direction_it_will_leave_in_and_a_stop_the_last_one() -> None:
    x = np.concatenate([np.zeros(5), np.arange(1, 11), np.full(5, 10.0)])
    reference = np.tile(np.eye(4), (len(x), 1, 1))
    reference[:, 1, 3] = x  # to +y, so that left is -x
    estimate = reference.copy()
    estimate[:, 0, 3] -= 0.5
    table = compare.pose_errors(estimate, reference, Z_UP)
    np.testing.assert_allclose(table["across"], 0.5)
    np.testing.assert_allclose(table["along"], 0.0, atol=1e-12)
    np.testing.assert_allclose(table["traveled"], x)


def test_a_path_that_only_stands_still_has_finite_parts() -> None:
    reference = np.tile(np.eye(4), (4, 1, 1))
    estimate = reference.copy()
    estimate[:, :3, 3] = [0.1, 0.2, 0.3]
    table = compare.pose_errors(estimate, reference, Z_UP)
    np.testing.assert_allclose(table["position"], np.sqrt(0.14))
    np.testing.assert_allclose(np.hypot(table["along"], table["across"]), np.hypot(0.1, 0.2))
    np.testing.assert_allclose(table["up"], 0.3)


@given(angle=st.floats(0.0, np.pi), axis=st.integers(0, 2))
def test_the_rotation_is_the_angle_between_the_two(angle: float, axis: int) -> None:
    reference = wandering(5, 3)
    turn = se3.exp(np.concatenate([np.zeros(3), angle * np.eye(3)[axis]]))
    table = compare.pose_errors(reference @ turn, reference, Z_UP)
    np.testing.assert_allclose(table["rotation_deg"], np.rad2deg(angle), atol=1e-6)
    np.testing.assert_allclose(table["position"], 0.0, atol=1e-12)


def test_frames_without_a_pose_are_nan_and_cost_nothing_else() -> None:
    reference = turning_left(20)
    estimate = disturbed(reference, 5)
    whole = compare.pose_errors(estimate, reference, Z_UP)
    known = estimate.copy()
    known[12:] = np.nan
    table = compare.pose_errors(known, reference, Z_UP)
    parts = ["position", "along", "across", "up", "rotation_deg"]
    assert table.loc[12:, parts].isna().all(axis=None)
    np.testing.assert_array_equal(table.loc[:11], whole.loc[:11])
    np.testing.assert_array_equal(table["traveled"], whole["traveled"])
    summary = compare.divergence_summary(table)
    assert summary["rmse"] == pytest.approx(np.sqrt(np.mean(whole.loc[:11, "position"] ** 2)))
    assert np.isnan(summary["final"])
    assert np.isnan(summary["rotation_final_deg"])


def test_frames_without_truth_are_excluded_from_the_alignment() -> None:
    truth = wandering(30, 1)
    estimate = disturbed(truth, 2)
    partly = truth.copy()
    partly[20:] = np.nan
    table = compare.truth_errors(estimated(estimate), Truth(partly), aligned=True)
    expected = evo_statistics(estimate[:20], truth[:20], PoseRelation.translation_part, aligned=True)
    assert compare.summarized(table["position"])["rmse"] == pytest.approx(expected["rmse"], rel=1e-12)
    assert table["position"].notna().sum() == 20


def test_without_a_common_frame_every_error_is_nan() -> None:
    poses = np.full((5, 4, 4), np.nan)
    table = compare.truth_errors(estimated(poses), Truth(wandering(5, 0)), aligned=True)
    assert table["position"].isna().all()
    summary = compare.divergence_summary(table)
    assert summary.pop("missing") == 5
    assert all(np.isnan(value) for value in summary.values())


def test_trajectories_of_different_length_are_refused() -> None:
    with pytest.raises(FgbaselineError, match="5 and 4 poses"):
        compare.pose_errors(wandering(5, 0), wandering(4, 0), Z_UP)


def test_divergence_of_an_estimate_from_itself_is_nothing() -> None:
    scene = Scene().sequence()
    assert scene.truth is not None
    estimate = estimated(scene.truth.world_T_imu)
    table = compare.divergence(estimate, replace(estimate, name="again"), scene.up)
    np.testing.assert_array_equal(table[["position", "along", "across", "up"]], 0.0)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50))
def test_the_summary_of_errors_is_that_of_numpy(errors: list[float]) -> None:
    summary = compare.summarized([*errors, np.nan])
    assert summary["rmse"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert summary["mean"] == pytest.approx(np.mean(errors))
    assert summary["median"] == pytest.approx(np.median(errors))
    assert summary["p95"] == pytest.approx(np.percentile(errors, 95))
    assert summary["max"] == max(map(abs, errors))


def test_the_summary_of_no_errors_is_nan_throughout() -> None:
    summary = compare.summarized([])
    assert summary.pop("missing") == 0
    assert all(np.isnan(value) for value in summary.values())


def test_the_divergence_summary_of_a_known_case() -> None:
    reference = turning_left(3)
    estimate = reference.copy()
    estimate[1] = estimate[1] @ se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.deg2rad(3.0)])
    estimate[2] = estimate[2] @ se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.deg2rad(-4.0)])
    estimate[1:, 2, 3] += [3.0, 4.0]
    summary = compare.divergence_summary(compare.pose_errors(estimate, reference, Z_UP))
    assert summary == pytest.approx(
        {
            "rmse": (25 / 3) ** 0.5,
            "mean": 7 / 3,
            "median": 3.0,
            "p95": 3.9,
            "max": 4.0,
            "final": 4.0,
            "rotation_rmse_deg": (25 / 3) ** 0.5,
            "rotation_final_deg": 4.0,
            "missing": 0,
        }
    )
    assert compare.pose_errors(estimate, reference, Z_UP)["heading_deg"].tolist() == pytest.approx([0.0, 3.0, -4.0])


def test_a_step_below_a_tenth_of_the_brisk_ones_has_no_direction_of_its_own() -> None:
    """Driving to +x, the path creeps sideways and drives on to +y."""
    x = [0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0]
    for creep, forward in ((0.05, [1.0, 0.0, 0.0]), (0.2, [0.0, 1.0, 0.0])):
        y = [0.0, 0.0, 0.0, 0.0, 0.0, creep, 2 * creep, 3 * creep, 4 * creep, 4 * creep + 1.0]
        directions, left, upward = along_track_frame(np.column_stack([x, y, np.zeros(10)]), np.array([0.0, 0.0, 2.0]))
        np.testing.assert_allclose(directions[6], forward, atol=0.06)
        np.testing.assert_allclose(left[6], np.cross([0.0, 0.0, 1.0], directions[6]), atol=1e-12)
        np.testing.assert_allclose(upward, [0.0, 0.0, 1.0])
