"""Ground truth from files of its own: the same path whichever body, world or format it was written in."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.data.formats import attach_truth, read, write_tum
from fgbaseline.data.formats.recordings.ground_truth import match_stamps
from fgbaseline.geometry import InputError, se3

from ..builders.inertial_paths import inertial_recording, turn
from ..builders.synthetic import drive
from ..builders.trajectory_writers import Path3D, tum


@pytest.fixture
def recorded(tmp_path, course_arrays):
    """A recording of 6 frames and where its IMU truly was, world and frame 0 being one."""
    np.savez(tmp_path / "a.npz", **course_arrays)
    sequence = read(tmp_path / "a.npz")
    return sequence, se3.compose(se3.exp(np.random.default_rng(0).normal(size=(5, 6))))


def write_kitti(path, poses):
    np.savetxt(path, poses[:, :3].reshape(-1, 12), fmt="%.17g")
    return path


@pytest.mark.parametrize("body", ["camera", "imu"])
@pytest.mark.parametrize("form", ["kitti", "tum"])
def test_every_way_of_writing_the_same_truth(tmp_path, recorded, body, form):
    sequence, world_T_imu = recorded
    elsewhere = se3.exp([40.0, -5, 6, 1.0, 0.2, -2.0])
    poses = elsewhere @ world_T_imu
    if body == "camera":
        poses = poses @ sequence.imu_T_cam
    path = tmp_path / "truth"
    if form == "kitti":
        write_kitti(path, poses)
    else:
        write_tum(path, sequence.t, poses)
    truth = attach_truth(sequence, path, body).truth
    assert truth is not None
    np.testing.assert_allclose(truth.world_T_imu, world_T_imu, atol=1e-12)
    again = read(tmp_path / "a.npz", path, body)
    assert again.truth is not None
    np.testing.assert_array_equal(again.truth.world_T_imu, truth.world_T_imu)
    assert (again.truth.source, again.remarks) == (str(path), ())


@pytest.mark.parametrize("body", ["camera", "imu"])
def test_the_up_that_a_truth_file_states_is_that_of_the_recording(tmp_path, recorded, body):
    sequence, world_T_imu = recorded
    elsewhere, up = se3.exp([40.0, -5, 6, 1.0, 0.2, -2.0]), np.array([0.6, 0.0, 0.8])
    poses = world_T_imu if body == "imu" else world_T_imu @ sequence.imu_T_cam
    write_tum(tmp_path / "truth", sequence.t, elsewhere @ poses, elsewhere[:3, :3] @ up)
    np.testing.assert_allclose(attach_truth(sequence, tmp_path / "truth", body).up, up, atol=1e-12)


def test_the_up_that_a_truth_file_states_is_that_of_its_world_with_raw_samples(tmp_path):
    sequence = inertial_recording(turn, n_frames=12)
    up = np.array([0.6, 0.0, 0.8])
    write_tum(tmp_path / "truth", sequence.t, sequence.truth.world_T_imu, up)
    write_tum(tmp_path / "bare", sequence.t, sequence.truth.world_T_imu)
    np.testing.assert_array_equal(attach_truth(sequence, tmp_path / "truth", "imu").truth.up, up)
    assert attach_truth(sequence, tmp_path / "bare", "imu").truth.up is None


def test_frames_beyond_the_end_of_a_kitti_file_are_counted(tmp_path, recorded):
    sequence, poses = recorded
    sequence = replace(sequence, linear_velocity=10.0 * sequence.linear_velocity)
    path = write_kitti(tmp_path / "truth", poses[:4])
    attached = attach_truth(sequence, path, "imu")
    assert attached.truth is not None
    assert attached.truth.known.tolist() == [True] * 4 + [False] * 2
    assert attached.remarks == (f"2 of 6 frames have no ground truth in {path}.",)
    with pytest.raises(InputError, match=r"truth2: it has 7 lines, but line k is frame k .* only 6 frames"):
        attach_truth(sequence, write_kitti(tmp_path / "truth2", np.concatenate([poses, poses[:1]])), "imu")


def test_tum_poses_are_matched_by_time_and_used_once(tmp_path, recorded):
    sequence, poses = recorded
    t = sequence.t.copy()
    t[1] += 0.02  # a little late
    t[3] += 0.051  # nearer to frame 4, which has its own
    t[5] += 0.06  # too far from everything
    write_tum(tmp_path / "truth", t, poses)
    attached = attach_truth(sequence, tmp_path / "truth", "imu")
    assert attached.truth is not None
    assert attached.truth.known.tolist() == [True, True, True, False, True, False]
    assert "up to 20 ms apart" in attached.remarks[0]
    assert attached.remarks[1].startswith("2 of 6 frames have no ground truth")


def test_truth_that_does_not_belong_to_the_recording(tmp_path, recorded):
    sequence, poses = recorded
    write_tum(tmp_path / "truth", sequence.t + 100.0, poses)
    with pytest.raises(InputError, match=r"truth: none of its time stamps \(1300000100.0 to"):
        attach_truth(sequence, tmp_path / "truth", "imu")
    write_tum(tmp_path / "truth", sequence.t[1:], poses[1:])
    with pytest.raises(InputError, match=r"truth\) has no pose for frame 0"):
        attach_truth(sequence, tmp_path / "truth", "imu")
    (tmp_path / "truth").write_text("1 2 3\n")
    with pytest.raises(InputError, match=r"line 1: it has 3 fields"):
        attach_truth(sequence, tmp_path / "truth", "imu")
    with pytest.raises(InputError, match="there is no such file"):
        attach_truth(sequence, tmp_path / "missing", "imu")


@pytest.mark.parametrize("body", ["camera", "imu"])
@pytest.mark.parametrize("order", ["xyzw", "wxyz"])
@pytest.mark.parametrize("unit", ["s", "ms", "ns"])
def test_truth_in_any_unit_and_order_of_quaternions_is_that_of_the_recording(tmp_path, body, order, unit):
    sequence = drive(seconds=12.0)
    assert sequence.truth is not None
    poses = sequence.truth.world_T_imu if body == "imu" else sequence.truth.world_T_imu @ sequence.imu_T_cam
    path = Path3D(tuple(round(1e9 * t) for t in sequence.t.tolist()), poses)
    (tmp_path / "truth.txt").write_text(tum(path, unit, order))
    attached = attach_truth(sequence, tmp_path / "truth.txt", body)
    assert attached.truth is not None
    np.testing.assert_allclose(attached.truth.world_T_imu, sequence.truth.world_T_imu, atol=1e-9)
    assert any("quaternions" in remark for remark in attached.remarks) == (order == "wxyz")
    assert any("divided by" in remark for remark in attached.remarks) == (unit != "s")


def test_positions_and_every_tenth_pose_are_no_truth_of_a_run(tmp_path):
    sequence = drive(seconds=12.0)
    assert sequence.truth is not None
    poses = sequence.truth.world_T_imu
    rows = np.concatenate([sequence.t[:, None], poses[:, :3, 3]], axis=1)
    np.savetxt(tmp_path / "prism.txt", rows, fmt="%.9f")
    with pytest.raises(InputError, match=r"prism\.txt: it has positions without orientations"):
        attach_truth(sequence, tmp_path / "prism.txt", "imu")
    with pytest.raises(InputError, match=r"keys\.txt: it has \d+ poses for \d+ frames, .* line k is not frame k"):
        attach_truth(sequence, write_kitti(tmp_path / "keys.txt", poses[::10]), "imu")
    numbered = np.concatenate([np.arange(len(poses))[::10, None], poses[::10, :3].reshape(-1, 12)], axis=1)
    np.savetxt(tmp_path / "numbered.txt", numbered, fmt="%.17g")
    attached = attach_truth(sequence, tmp_path / "numbered.txt", "imu").truth
    assert attached is not None
    assert np.flatnonzero(attached.known).tolist() == list(range(0, len(poses), 10))


@pytest.mark.parametrize("body", [None, "body"])
def test_the_body_must_be_specified(tmp_path, recorded, body):
    sequence, poses = recorded
    write_kitti(tmp_path / "truth", poses)
    with pytest.raises(InputError, match=f"the truth frame is {body!r}; say whether .* 'camera' or the 'imu'"):
        attach_truth(sequence, tmp_path / "truth", body)
    with pytest.raises(InputError, match="the truth frame is None"):
        read(tmp_path / "a.npz", tmp_path / "truth")


def test_attaching_replaces_the_truth_of_the_recording(tmp_path, recorded):
    sequence, poses = recorded
    write_kitti(tmp_path / "truth", poses)
    own = replace(sequence, truth=attach_truth(sequence, tmp_path / "truth", "imu").truth)
    other = attach_truth(own, tmp_path / "truth", "camera")
    assert own.truth is not None
    assert other.truth is not None
    assert np.abs(own.truth.world_T_imu - other.truth.world_T_imu).max() > 0.1


STAMPS = st.lists(st.integers(0, 400), min_size=1, max_size=30, unique=True).map(lambda x: np.sort(x) / 8.0)


@given(STAMPS.filter(lambda t: len(t) > 1), STAMPS)
def test_matches_are_mutual_near_and_one_to_one(t, recorded):
    frames, chosen = match_stamps(t, recorded)
    limit = 0.5 * np.median(np.diff(t))
    assert len(set(chosen.tolist())) == len(chosen)
    assert np.all(np.diff(frames) > 0)
    distance = np.abs(t[:, None] - recorded[None, :])
    for frame, stamp in zip(frames, chosen, strict=True):
        assert distance[frame, stamp] <= limit
        assert distance[frame, stamp] == distance[frame].min()
    for stamp in set(range(len(recorded))) - set(chosen.tolist()):
        contested = np.flatnonzero((distance.argmin(axis=1) == stamp) & (distance[:, stamp] <= limit))
        # unmatched only where every frame it could serve has another stamp as near
        assert all((distance[frame] == distance[frame].min()).sum() > 1 for frame in contested)
