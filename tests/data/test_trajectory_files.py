"""Trajectory files: the form is detected from the content, written files are read back, errors name their line."""

from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline.data import write_npz
from fgbaseline.data.formats import (
    read_pose_covariances,
    read_times,
    read_trajectory,
    read_trajectory_file,
    write_euroc,
    write_kitti,
    write_trajectory_npz,
    write_tum,
)
from fgbaseline.geometry import FloatArray, InputError, se3

from ..builders.refusals import refused
from ..builders.synthetic import drive

FORMS = ("tum", "kitti", "euroc", "npz")


def path_of(seed: int, n: int) -> tuple[FloatArray, FloatArray]:
    """Stamps in whole nanoseconds, as recorders have them, and poses."""
    random = np.random.default_rng(seed)
    start = int(random.choice([0, 10**9, 1_403_636_579_758_555_392]))
    nanoseconds = start + np.cumsum(random.integers(1, 10**9, n) * (512 if start > 10**10 else 1))
    t = np.array([int(ns) / 10**9 for ns in nanoseconds])
    return t, se3.compose(se3.exp(random.normal(size=(n - 1, 6)) * 3.0), se3.exp(100.0 * random.normal(size=6)))


def write(form: str, path: Path, t: FloatArray, poses: FloatArray) -> Path:
    if form == "kitti":
        write_kitti(path, poses)
    else:
        {"tum": write_tum, "euroc": write_euroc, "npz": write_trajectory_npz}[form](path, t, poses)
    return path


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(FORMS), st.integers(0, 2**32 - 1), st.integers(2, 20))
def test_written_files_are_read_back_and_written_again_to_the_byte(tmp_path_factory, form, seed, n):
    folder = tmp_path_factory.mktemp("forms")
    t, poses = path_of(seed, n)
    back = read_trajectory(write(form, folder / "a", t, poses))
    assert back.t.tobytes() == (np.arange(float(n)) if form == "kitti" else t).tobytes()
    assert back.stamped == (form != "kitti")
    assert back.position.tobytes() == poses[:, :3, 3].tobytes()
    np.testing.assert_allclose(back.rotation, poses[:, :3, :3], rtol=0, atol=1e-14)
    again = read_trajectory(write(form, folder / "b", back.t, back.world_T_body))
    assert again.t.tobytes() == back.t.tobytes()
    np.testing.assert_allclose(again.world_T_body, back.world_T_body, rtol=0, atol=1e-15)
    if form == "npz":
        assert (folder / "a").read_bytes() == (folder / "b").read_bytes()


@pytest.mark.parametrize("form", FORMS)
def test_insisting_on_the_right_form_changes_nothing_and_on_another_is_refused(tmp_path, form):
    path = write(form, tmp_path / "a", *path_of(3, 5))
    expected = read_trajectory(path)
    np.testing.assert_array_equal(read_trajectory(path, form).world_T_body, expected.world_T_body)
    for other in set(FORMS) - {form}:
        with refused("a: ", path):
            read_trajectory(path, other)


def test_evo_reads_the_same_from_what_we_write(tmp_path):
    t, poses = path_of(5, 30)
    tum = file_interface.read_tum_trajectory_file(write("tum", tmp_path / "a.tum", t, poses))
    euroc = file_interface.read_euroc_csv_trajectory(write("euroc", tmp_path / "a.csv", t, poses))
    kitti = file_interface.read_kitti_poses_file(write("kitti", tmp_path / "a.txt", t, poses))
    for theirs in (tum, euroc, kitti):
        np.testing.assert_allclose(np.array(theirs.poses_se3), poses, atol=1e-9)
    np.testing.assert_allclose(tum.timestamps, t, rtol=0, atol=0)
    np.testing.assert_allclose(euroc.timestamps, t, rtol=1e-15)


def test_a_euroc_state_file_reads_as_in_evo(tmp_path):
    rows = ["#timestamp, p_RS_R_x [m], and so on"]
    for k in range(4):
        rows.append(f"140363658083855539{k},4.6,-1.7,{0.5 + k},0.5,-0.5,0.5,-0.5" + ",0.1" * 9)
    (tmp_path / "data.csv").write_text("\n".join(rows))
    with pytest.raises(InputError, match=r"data\.csv: line 3: its time stamp .* repeats"):
        read_trajectory(tmp_path / "data.csv")  # stamps a nanosecond apart are one double
    (tmp_path / "data.csv").write_text("\n".join(rows[:1] + [rows[k + 1].replace("6580", f"658{k}") for k in range(4)]))
    ours = read_trajectory(tmp_path / "data.csv")
    theirs = file_interface.read_euroc_csv_trajectory(tmp_path / "data.csv")
    np.testing.assert_allclose(ours.world_T_body, np.array(theirs.poses_se3), atol=1e-12)
    np.testing.assert_allclose(ours.t, theirs.timestamps, rtol=1e-15)
    assert ours.line is not None
    assert ours.line.tolist() == [2, 3, 4, 5]


def test_kitti_poses_take_the_times_that_are_given(tmp_path):
    t, poses = path_of(1, 4)
    path = write("kitti", tmp_path / "00.txt", t, poses)
    (tmp_path / "times.txt").write_text("\n".join(map(repr, [*t.tolist(), float(t[-1]) + 1.0])))
    read = read_trajectory(path, times=read_times(tmp_path / "times.txt"), name="mine")
    assert read.stamped
    assert read.name == "mine"
    assert read.t.tobytes() == t.tobytes()
    with pytest.raises(InputError, match=r"00\.txt: it has 4 poses but there are 3 time stamps"):
        read_trajectory(path, times=t[:3])
    (tmp_path / "times.txt").write_text("0.0\n0.1\n0.1\n")
    with pytest.raises(InputError, match=r"times\.txt: line 3: the time stamp 0.1 is not after 0.1"):
        read_times(tmp_path / "times.txt")


def test_an_npz_carries_covariances_and_leaves_out_unknown_poses(tmp_path):
    t, poses = path_of(2, 6)
    covariance = np.tile(np.eye(6), (6, 1, 1)) * np.arange(1.0, 7.0)[:, None, None]
    poses[2] = np.nan
    write_trajectory_npz(tmp_path / "a.npz", t, poses, covariance)
    assert read_trajectory(tmp_path / "a.npz").t.tolist() == t[[0, 1, 3, 4, 5]].tolist()
    back = read_pose_covariances(tmp_path / "a.npz")
    assert back is not None
    assert back[:, 0, 0].tolist() == [1.0, 2.0, 4.0, 5.0, 6.0]
    np.savez(tmp_path / "b.npz", t=t, world_T_body=poses)  # as a user's own script writes it
    assert read_pose_covariances(tmp_path / "b.npz") is None
    assert len(read_trajectory(tmp_path / "b.npz")) == 5
    write_tum(tmp_path / "a.tum", t, poses)
    assert read_pose_covariances(tmp_path / "a.tum") is None


def test_a_recording_is_the_trajectory_of_its_truth(tmp_path):
    sequence = drive()
    assert sequence.truth is not None
    write_npz(sequence, tmp_path / "drive.npz")
    read = read_trajectory(tmp_path / "drive.npz")
    assert read.t.tobytes() == sequence.t.tobytes()
    np.testing.assert_allclose(read.world_T_body, sequence.truth.world_T_imu, atol=1e-14)


GOOD = "1000000000,0,0,0,1,0,0,0"
BAD_TEXT = {
    "seven fields": ("1 2 3 4 5 6 7\n", "line 1: it has 7 fields"),
    "three between commas": ("1,2,3\n", "line 1: it has 3 fields"),
    "word": (f"#h\n{GOOD}\n2000000000,0,0,x,1,0,0,0\n", "line 3: 'x' is not a finite number"),
    "NaN stamp": (f"#h\n{GOOD}\nnan,0,0,1,1,0,0,0\n", "line 3: the time stamp is NaN"),
    "infinite": (f"#h\n{GOOD}\n2000000000,0,0,inf,1,0,0,0\n", "line 3: 'inf' is not a finite number"),
    "missing": (f"{GOOD}\n2000000000,0,0,1,0,0,0\n", "line 2: expected 8 numbers, got 7"),
    "empty stamp": (f"{GOOD}\n,0,0,0,1,0,0,0\n", "line 2: the time stamp is NaN"),
    "half a nanosecond": (
        "#t [ns],x,y,z,qw,qx,qy,qz\n1.5,0,0,0,1,0,0,0\n",
        "line 2: the time stamp 1.5 is not a whole n",
    ),
    "long quaternion": (f"{GOOD}\n2000000000,0,0,0,1,0.1,0,0\n", r"line 2: the quaternion \[0.1, 0.0, 0.0, 1.0\] has"),
    "unsorted": (
        f"{GOOD}\n500000000,0,0,0,1,0,0,0\n",
        r"line 2: the time stamp 500000000 is not after 10{9} \(line 1\)",
    ),
    "digits lost": (f"{GOOD}\n{GOOD.replace('0,0,0,1', '1,0,0,1')}\n", "its time stamps have lost digits"),
    "nothing": ("# only words\n", "the file has no poses"),
}


def test_any_line_ends_are_line_ends(tmp_path):
    lines = ["# stamps", *(f"{k} {k} 0 0 0 0 0 1" for k in range(6))]
    (tmp_path / "a.tum").write_bytes(
        "\ufeff".encode()
        + "\r\n".join(lines[:3]).encode()
        + b"\r"
        + "\r".join(lines[3:5]).encode()
        + b"\n"
        + "\n".join(lines[5:]).encode()
    )
    read = read_trajectory(tmp_path / "a.tum")
    assert read.position[:, 0].tolist() == [0, 1, 2, 3, 4, 5]
    assert read.line is not None
    assert read.line.tolist() == [2, 3, 4, 5, 6, 7]


@pytest.mark.parametrize("case", BAD_TEXT)
def test_a_bad_text_file_is_refused_with_its_line(tmp_path, case):
    text, sentence = BAD_TEXT[case]
    (tmp_path / "a.csv").write_text(text)
    with refused(sentence, tmp_path / "a.csv"):
        read_trajectory(tmp_path / "a.csv")


def reflect(arrays):
    arrays["world_T_body"][2, 0] *= -1.0


def half_nan(arrays):
    arrays["world_T_body"][1, 0, 3] = np.nan


def projective(arrays):
    arrays["world_T_body"][1, 3, 0] = 0.1


def fall(arrays):
    arrays["t"][2] = arrays["t"][0]


def shorten(arrays):
    arrays["world_T_body"] = arrays["world_T_body"][:-1]


def lose_all(arrays):
    arrays["world_T_body"][:] = np.nan


def rename(arrays):
    arrays["poses"] = arrays.pop("world_T_body")


def misshape(arrays):
    arrays["covariance"] = np.eye(6)


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (reflect, "world_T_body: the pose 2 is not a rigid motion"),
        (half_nan, "world_T_body: the pose 1 is not a rigid motion"),
        (projective, "world_T_body: the pose 1 is not a rigid motion"),
        (fall, "t: stamps must rise, but frame 2"),
        (shorten, r"world_T_body: expected shape \(4, 4, 4\)"),
        (lose_all, "world_T_body: every pose is NaN"),
        (rename, "world_T_body is missing; the file has 'poses', 't'"),
        (misshape, r"covariance: expected shape \(4, 6, 6\)"),
    ],
)
def test_a_bad_npz_is_refused_with_its_key(tmp_path, spoil, sentence):
    t, poses = path_of(4, 4)
    arrays = {"t": t, "world_T_body": poses}
    spoil(arrays)
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InputError, match=sentence):
        read_trajectory(tmp_path / "a.npz")


def test_data_that_a_format_cannot_hold_are_not_written(tmp_path):
    t, poses = path_of(6, 3)
    with pytest.raises(InputError, match="negative"):
        write_euroc(tmp_path / "a", t - t[0] - 1.0, poses)
    with pytest.raises(InputError, match="same nanosecond"):
        write_euroc(tmp_path / "a", np.array([0.0, 1e-10, 1.0]), poses)
    missing = poses.copy()
    missing[1] = np.nan
    with pytest.raises(InputError, match="pose 1 is missing, but line k"):
        write_kitti(tmp_path / "a", missing)
    missing[1:] = np.nan
    with pytest.raises(InputError, match="at least 2 poses"):
        write_trajectory_npz(tmp_path / "a", t, missing)
    with pytest.raises(InputError, match="there is no 'rosbag'"):
        read_trajectory(tmp_path / "a", "rosbag")
    assert not list(tmp_path.iterdir())


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=200) | st.text(alphabet="0123456789.e-, \n#x", max_size=300).map(str.encode))
def test_arbitrary_bytes_are_finite_poses_or_an_input_error(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("bytes") / "a"
    path.write_bytes(content)
    try:
        numbers = read_trajectory(path)  # such as b"0 0 0 0": one position
    except InputError:
        return
    assert np.isfinite(numbers.world_T_body).all()


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_stamps_of_an_npz_that_lost_their_digits_are_refused_by_their_cause(tmp_path: Path, kind: type) -> None:
    t, poses = 1.4e9 + 0.05 * np.arange(60), path_of(1, 60)[1]
    np.savez(tmp_path / "a.npz", t=t.astype(kind), world_T_body=poses)
    if kind is np.float64:
        assert read_trajectory(tmp_path / "a.npz").t.tobytes() == t.tobytes()
        return
    with pytest.raises(InputError, match=r"a\.npz: t: 59 of 60 stamps repeat .* a float32, which has steps of 128"):
        read_trajectory(tmp_path / "a.npz")


def test_a_repeated_stamp_of_an_npz_is_counted_and_its_first_pose_kept(tmp_path: Path) -> None:
    t, poses = 0.05 * np.arange(60), path_of(1, 60)[1]
    t[31] = t[30]
    covariance = np.tile(np.eye(6), (60, 1, 1)) * np.arange(1.0, 61.0)[:, None, None]
    np.savez(tmp_path / "a.npz", t=t, world_T_body=poses, covariance=covariance)
    read = read_trajectory_file(tmp_path / "a.npz")
    assert read.remarks == (
        "t: 1 frame has the stamp of the frame before (31): of each such pair the first frame is kept",
    )
    others = np.delete(np.arange(60), 31)
    assert read.trajectory().t.tobytes() == t[others].tobytes()
    assert read.position.tobytes() == poses[others, :3, 3].tobytes()
    np.testing.assert_array_equal(read.covariance(), covariance[others])
