"""KITTI's segment errors are those of its devkit, recomputed here from the formula it publishes, frame by frame."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, data
from fgbaseline.compare.trajectory.segments import fitted_lengths
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, InputError, se3

LENGTHS = (100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0)


def devkit(truth: FloatArray, result: FloatArray, lengths: tuple[float, ...], step: int) -> list[tuple[float, ...]]:
    """evaluate_odometry.cpp's calcSequenceErrors: (first frame, length, t_err, cosine of the angle) of each segment."""
    distance = [0.0]
    for i in range(1, len(truth)):
        dx, dy, dz = truth[i, :3, 3] - truth[i - 1, :3, 3]
        distance.append(distance[i - 1] + float(np.sqrt(dx * dx + dy * dy + dz * dz)))
    errors = []
    for first in range(0, len(truth), step):
        for length in lengths:
            last = next((i for i in range(first, len(truth)) if distance[i] > distance[first] + length), -1)
            if last == -1:
                continue
            pose_delta_gt = np.linalg.inv(truth[first]) @ truth[last]
            pose_delta_result = np.linalg.inv(result[first]) @ result[last]
            error = np.linalg.inv(pose_delta_result) @ pose_delta_gt
            cosine = 0.5 * (error[0, 0] + error[1, 1] + error[2, 2] - 1.0)
            errors.append((first, length, float(np.linalg.norm(error[:3, 3])) / length, float(cosine)))
    return errors


def assert_as_devkit(truth: FloatArray, result: FloatArray, found: compare.SegmentErrors) -> None:
    expected = np.array(devkit(truth, result, found.lengths, found.step))
    table = found.table
    assert len(table) == len(expected) > 0
    np.testing.assert_array_equal(table["start"], expected[:, 0])
    np.testing.assert_array_equal(table["length"], expected[:, 1])
    np.testing.assert_allclose(table["translation_percent"], 100.0 * expected[:, 2], rtol=1e-9, atol=1e-9)
    angle = np.deg2rad(table["rotation_deg_per_m"] * table["length"])
    np.testing.assert_allclose(np.cos(angle), np.clip(expected[:, 3], -1, 1), rtol=0, atol=1e-12)
    # The devkit's arc cosine loses half of the digits near zero, where it has 1e-8 left.
    np.testing.assert_allclose(angle, np.arccos(np.clip(expected[:, 3], -1, 1)), rtol=0, atol=1e-7)
    assert found.translation_percent == pytest.approx(100.0 * expected[:, 2].mean(), rel=1e-9)
    for length, row in found.by_length.iterrows():
        of_length = expected[expected[:, 1] == length]
        assert row["translation_percent"] == pytest.approx(100.0 * of_length[:, 2].mean(), rel=1e-9)
        assert row["n"] == len(of_length)


def matched(t: FloatArray, truth: FloatArray, result: FloatArray) -> compare.MatchedTrajectories:
    return compare.associate(Trajectory(t, truth, "truth"), Trajectory(t, result, "result"))


def dead_reckoned(sequence: data.Sequence) -> FloatArray:
    u = np.concatenate([sequence.linear_velocity, sequence.angular_velocity], axis=1)
    return se3.compose(se3.exp(u[:-1] * sequence.dt[:, None]))


def test_on_kittis_ground_truth(recordings: Callable[[str], Path]) -> None:
    truth = data.read_kitti(recordings("ground_truth/kitti_odometry_07.txt"))
    sequence = data.read(recordings("ece276a_2020/0027.npz"))
    sequence = data.attach_truth(sequence, recordings("ground_truth/kitti_odometry_07.txt"), "camera")
    camera = np.linalg.inv(sequence.imu_T_cam) @ dead_reckoned(sequence)[: len(truth)] @ sequence.imu_T_cam
    pair = matched(sequence.t[: len(truth)], truth, camera)
    found = compare.segment_errors(pair)
    assert found.official
    assert found.caption.endswith("of 100 to 800 m (KITTI's lengths), one begun every 10 poses")
    assert found.by_length.index.tolist() == [100.0, 200.0, 300.0, 400.0, 500.0, 600.0]  # the path has 695 m
    # The trajectory's poses, whose rotations are exact: the recorded extrinsic is a rotation to 1e-8 only.
    assert_as_devkit(pair.reference.world_T_body, pair.estimate.world_T_body, found)


UTIAS = ["09_26_drive_0001", "09_26_drive_0005", "09_26_drive_0009", "09_26_drive_0036", "09_30_drive_0027"]


@pytest.mark.parametrize("drive", UTIAS)
def test_on_the_truth_of_other_drives(recordings: Callable[[str], Path], drive: str) -> None:
    sequence = data.read(recordings(f"utias/2011_{drive}_sync_KLT.mat"))
    assert sequence.truth is not None
    pair = matched(sequence.t, sequence.truth.world_T_imu, dead_reckoned(sequence))
    found = compare.segment_errors(pair)
    length = float(compare.divergence_along_path(pair)["traveled"].iloc[-1])
    assert found.official == (length > 100.0)
    assert_as_devkit(pair.reference.world_T_body, pair.estimate.world_T_body, found)


def drive(n: int, seed: int = 0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, poses at 1 m steps with turns, and poses with a 1 % larger scale and some noise."""
    random = np.random.default_rng(seed)
    steps = np.tile([1.0, 0, 0, 0, 0, 0.02], (n - 1, 1))
    wrong = steps * [1.01, 1, 1, 1, 1, 1] + 0.001 * random.normal(size=steps.shape)
    return 0.1 * np.arange(n), se3.compose(se3.exp(steps)), se3.compose(se3.exp(wrong))


def test_a_long_simulated_drive_has_every_official_length() -> None:
    t, truth, result = drive(1200)
    found = compare.segment_errors(matched(t, truth, result))
    assert found.by_length.index.tolist() == list(LENGTHS)
    assert_as_devkit(truth, result, found)
    # The chord of a step of 1 m is a little shorter; the first pose beyond ends a segment, as in the devkit.
    np.testing.assert_allclose(found.table["speed"], 10.0, rtol=0.02)


def test_without_stamps_a_segment_has_no_speed() -> None:
    _, truth, result = drive(61)
    frames = np.arange(61.0)
    unstamped = (Trajectory(frames, poses, name, stamped=False) for poses, name in ((truth, "truth"), (result, "it")))
    assert compare.segment_errors(compare.associate(*unstamped)).table["speed"].isna().all()


def test_a_short_path_has_fitted_segment_lengths_and_reports_them() -> None:
    t, truth, result = drive(61)
    found = compare.segment_errors(matched(t, truth, result))
    assert not found.official
    assert found.lengths == (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
    assert "5 to 40 m (lengths fitted to the trajectory, not KITTI's), one begun every pose" in found.caption
    assert_as_devkit(truth, result, found)


@pytest.mark.parametrize("path", [0.003, 0.9, 1.0, 12.0, 99.0, 5e4])
def test_fitted_lengths_are_round_and_fill_the_path(path: float) -> None:
    lengths = fitted_lengths(path)
    assert len(lengths) == 8
    assert 0.4 * path < lengths[-1] <= 0.9 * path * (1 + 1e-9)
    assert float(f"{lengths[0]:.2g}") == pytest.approx(lengths[0], rel=1e-12)
    np.testing.assert_allclose(np.array(lengths) / lengths[0], np.arange(1, 9))


def test_lengths_that_do_not_fit_and_standing_still_are_errors() -> None:
    t, truth, result = drive(61)
    with pytest.raises(InputError, match=r"no segment of 100 m or more fits into its path of 60 m; give shorter"):
        compare.segment_errors(matched(t, truth, result), lengths=LENGTHS)
    still = np.tile(np.eye(4), (61, 1, 1))
    with pytest.raises(InputError, match="stands still"):
        compare.segment_errors(matched(t, still, result))


def test_a_segment_ends_with_the_first_pose_that_is_further_than_its_length() -> None:
    """One meter a step, straight ahead and 10 % too far: worked out by hand."""
    truth, result = (np.tile(np.eye(4), (10, 1, 1)) for _ in range(2))
    truth[:, 0, 3] = np.arange(10.0)
    result[:, 0, 3] = 1.1 * np.arange(10.0)
    found = compare.segment_errors(matched(0.5 * np.arange(10.0), truth, result), lengths=(3, 6), step=2)
    assert found.table.columns.tolist() == [
        "start", "end", "length", "translation_percent", "rotation_deg_per_m", "speed"
    ]  # fmt: skip
    assert found.table[["start", "end", "length"]].to_numpy().tolist() == [
        [0, 4, 3], [0, 7, 6], [2, 6, 3], [2, 9, 6], [4, 8, 3]
    ]  # fmt: skip
    np.testing.assert_allclose(found.table["translation_percent"], 10.0 * np.array([4 / 3, 7 / 6, 4 / 3, 7 / 6, 4 / 3]))
    np.testing.assert_allclose(found.table["speed"], [3 / 2.0, 6 / 3.5, 3 / 2.0, 6 / 3.5, 3 / 2.0])
    assert (
        found.caption
        == "5 segments of 3 to 6 m (lengths fitted to the trajectory, not KITTI's), one begun every 2 poses"
    )
    assert found.by_length.index.name == "length"
    assert found.by_length.columns.tolist() == ["translation_percent", "rotation_deg_per_m", "n"]
    assert found.by_length["n"].tolist() == [3, 2]


def test_a_path_of_just_100_m_is_too_short_for_kittis_lengths() -> None:
    for n, official in ((101, False), (102, True)):
        straight = np.tile(np.eye(4), (n, 1, 1))
        straight[:, 0, 3] = np.arange(float(n))
        found = compare.segment_errors(matched(0.1 * np.arange(n), straight, straight))
        assert (found.official, found.step) == (official, 10 if official else 1)


def test_lengths_are_kittis_own_only_with_kittis_step() -> None:
    pair = matched(*drive(300))
    assert compare.segment_errors(pair, lengths=LENGTHS).official
    assert compare.segment_errors(pair, lengths=LENGTHS).step == 10
    assert compare.segment_errors(pair, step=10).official
    assert not compare.segment_errors(pair, step=5).official
    assert not compare.segment_errors(pair, lengths=LENGTHS[:7]).official


def test_the_means_of_the_segments_have_intervals() -> None:
    found = compare.segment_errors(matched(*drive(300)), step=2)
    table = found.intervals()
    assert table.index.tolist() == ["translation_percent", "rotation_deg_per_m"]
    assert table.columns.tolist() == ["value", "low", "high"]
    assert table["value"].tolist() == pytest.approx([found.translation_percent, found.rotation_deg_per_m])
    assert (table["low"] < table["value"]).all()
    assert (table["value"] < table["high"]).all()
    assert found.intervals(seed=0).equals(table)
    assert not found.intervals(seed=1).equals(table)
