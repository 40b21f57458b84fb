"""TUM and KITTI files: what is written comes back, and what is wrong is found by its line."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline.data.formats import read_kitti, read_tum, write_tum
from fgbaseline.geometry import InputError, se3, so3

from ..builders.refusals import refused

FINITE = st.floats(-1e12, 1e12)


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.floats(-1e12, 1e12), min_size=1, max_size=5, unique=True).map(sorted),
    st.lists(st.tuples(FINITE, FINITE, FINITE), min_size=5, max_size=5),
    st.lists(st.tuples(*[st.floats(-4.0, 4.0)] * 3), min_size=5, max_size=5),
)
def test_tum_comes_back(tmp_path_factory, stamps, positions, rotations):
    n = len(stamps)
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3] = positions[:n]
    poses[:, :3, :3] = so3.exp_so3(rotations[:n])
    path = tmp_path_factory.mktemp("tum") / "a.tum"
    write_tum(path, np.array(stamps), poses)
    t, back = read_tum(path)
    assert t.tobytes() == np.array(stamps).tobytes()
    assert back[:, :3, 3].tobytes() == poses[:, :3, 3].tobytes()
    np.testing.assert_allclose(back[:, :3, :3], poses[:, :3, :3], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(back[:, 3], poses[:, 3])


def test_unknown_poses_are_left_out(tmp_path):
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[1] = np.nan
    write_tum(tmp_path / "a.tum", np.arange(4.0), poses)
    t, back = read_tum(tmp_path / "a.tum")
    assert t.tolist() == [0.0, 2.0, 3.0]
    assert back.shape == (3, 4, 4)


@pytest.mark.parametrize(
    ("t", "spoil", "sentence"),
    [
        ([0.0, 0.0], (0, 3, 1.0), "must be finite and rise"),
        ([0.0, np.nan], (0, 3, 1.0), "must be finite and rise"),
        ([0.0, 1.0], (0, 0, 2.0), r"pose 1 \(at 1.0 s\) is not a rigid motion"),
        ([0.0, 1.0], (0, 3, np.nan), r"pose 1 \(at 1.0 s\) is not a rigid motion"),
        ([0.0, 1.0, 2.0], (0, 3, 1.0), r"stamps \(n,\) and poses \(n, 4, 4\)"),
    ],
)
def test_no_bad_trajectory_is_written(tmp_path, t, spoil, sentence):
    poses = np.tile(np.eye(4), (2, 1, 1))
    row, column, value = spoil
    poses[1, row, column] = value
    with pytest.raises(InputError, match=sentence):
        write_tum(tmp_path / "a.tum", np.array(t), poses)
    assert not list(tmp_path.iterdir())


def test_comments_blank_lines_and_foreign_line_ends(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf# t x y z\r\n\r\n1.5 1 2 3 0 0 0 1 # here\r\n\t2.5  1 2 4 0 0 0.6 0.8\r\n")
    t, poses = read_tum(path)
    assert t.tolist() == [1.5, 2.5]
    np.testing.assert_allclose(poses[1, :2, :2], [[0.28, -0.96], [0.96, 0.28]], atol=1e-15)


GOOD = "1 0 0 0 0 0 0 1"
BAD_TUM = {
    "word": ([GOOD, "2 0 x 0 0 0 0 1"], "line 2: 'x' is not a finite number"),
    "underscore": ([GOOD, "2 0 1_0 0 0 0 0 1"], "line 2: '1_0' is not a finite number"),
    "other digits": ([GOOD, "2 0 ١ 0 0 0 0 1"], "line 2: '١' is not a finite number"),
    "NaN stamp": ([GOOD, "# between", "nan 0 0 0 0 0 0 1"], "line 3: the time stamp is NaN"),
    "infinite": ([GOOD, "inf 0 0 0 0 0 0 1"], "line 2: 'inf' is not a finite number"),
    "overflow": ([GOOD, "2 1e999 0 0 0 0 0 1"], "line 2: '1e999' is not a finite number"),
    "short": ([GOOD, "", "2 0 0 0 0 0 1"], "line 3: expected 8 numbers, got 7: '2 0 0 0 0 0 1'"),
    "short from the start": (["1 2 3"], "line 1: it has 3 fields"),
    "long quaternion": ([GOOD, "2 0 0 0 0 0 0 1.002"], r"line 2: the quaternion .* has length 1.002"),
    "no quaternion": ([GOOD, "2 0 0 0 0 0 0 0"], "line 2: the quaternion .* has length 0"),
    "huge quaternion": ([GOOD, "2 0 0 0 1e300 1e300 0 0"], "line 2: the quaternion .* has length"),
    "unsorted": (["2 0 0 0 0 0 0 1", GOOD], r"line 2: the time stamp 1 is not after 2 \(line 1\)"),
    "later unsorted": (["2.5 0 0 0 0 0 0 1", GOOD], r"line 2: the time stamp 1.0 is not after 2.5 \(line 1\)"),
    "nothing": (["# only words", ""], "the file has no poses"),
    "commas": (["1,2,3,4,5,6,7,8"], "line 1: expected a TUM line"),
}


@pytest.mark.parametrize("case", BAD_TUM)
def test_a_bad_tum_file_is_refused_with_its_line(tmp_path, case):
    lines, sentence = BAD_TUM[case]
    path = tmp_path / "a.tum"
    path.write_text("\n".join(lines), encoding="utf-8")
    with refused(sentence, path):
        read_tum(path)


def test_bytes_that_are_no_text(tmp_path):
    path = tmp_path / "a.tum"
    path.write_bytes(GOOD.encode() + b"\n\xff\xfe\x00")
    with pytest.raises(InputError, match=r"a\.tum: line 2: it is not text \(byte 0xff\)"):
        read_tum(path)
    with pytest.raises(InputError, match="there is no such file"):
        read_kitti(tmp_path / "missing.txt")


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=200) | st.text(alphabet="0123456789.e- \n#x", max_size=300).map(str.encode))
def test_arbitrary_bytes_are_poses_or_an_input_error(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("text") / "a"
    path.write_bytes(content)
    for read in (read_tum, read_kitti):
        with pytest.raises(InputError):
            read(path)


def test_kitti_rotations_are_made_exact(tmp_path):
    poses = se3.compose(se3.exp(np.random.default_rng(0).normal(size=(20, 6))))
    np.savetxt(tmp_path / "a.txt", poses[:, :3].reshape(-1, 12), fmt="%.5f")
    back = read_kitti(tmp_path / "a.txt")
    np.testing.assert_allclose(back, poses, atol=2e-5)
    assert so3.orthogonality_error(back[:, :3, :3]).max() < 1e-14


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("1 0 0 5 0 1 0 5 0 0 -1 5", "line 2: the first three columns are not a rotation"),
        ("1.01 0 0 5 0 1 0 5 0 0 1 5", r"line 2: .* \(off by 0.0201, allowed 0.001\)"),
        ("1e200 0 0 5 0 1 0 5 0 0 1 5", "line 2: the first three columns are not a rotation"),
        ("1 0 0 5 0 1 0 5 0 0 1 inf", "line 2: 'inf' is not a finite number"),
        ("1 0 0 5 0 1 0 5 0 0 1", "line 2: expected 12 numbers, got 11"),
    ],
)
def test_a_bad_kitti_file_is_refused_with_its_line(tmp_path, line, sentence):
    (tmp_path / "a.txt").write_text(f"1 0 0 5 0 1 0 5 0 0 1 5\n{line}\n")
    with pytest.raises(InputError, match=sentence):
        read_kitti(tmp_path / "a.txt")


def test_a_hundred_thousand_lines_take_no_time(tmp_path):
    n = 100_000
    poses = se3.exp(np.random.default_rng(0).normal(size=(n, 6)))
    began = time.process_time()
    write_tum(tmp_path / "a.tum", np.arange(n) / 100.0, poses)
    t, _ = read_tum(tmp_path / "a.tum")
    assert len(t) == n
    assert time.process_time() - began < 10.0  # about 1 s; of the processor
    with (tmp_path / "a.tum").open("a") as file:
        file.write("1e9 0 0 oops 0 0 0 1\n")
    with pytest.raises(InputError, match="line 100002: 'oops'"):
        read_tum(tmp_path / "a.tum")
