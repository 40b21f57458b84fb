"""A trajectory is what it was given, exactly, or an error that says which pose is wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, InputError, se3, so3


def poses(n: int = 5) -> FloatArray:
    return se3.exp(np.random.default_rng(1).normal(size=(n, 6)))


def spoiled(i: int, row: int, column: int, value: float) -> FloatArray:
    wrong = poses()
    wrong[i, row, column] = value
    return wrong


@pytest.mark.parametrize(
    ("t", "path", "sentence"),
    [
        ([0, 1, 1, 2, 3], poses(), r"a.tum: line 12: its time stamp 1.0 repeats that of line 11; sort"),
        ([0, 1, 0.5, 2, 3], poses(), r"a.tum: line 12: its time stamp 0.5 is before 1.0 of line 11; sort"),
        ([0, 1, np.nan, 2, 3], poses(), r"a.tum: line 12: its time stamp is nan"),
        ([0, 1, 2, 3, np.inf], poses(), r"a.tum: line 14: its time stamp is inf"),
        (range(5), spoiled(3, 0, 3, np.nan), r"a.tum: line 13: it is not finite"),
        (range(5), spoiled(3, 1, 3, -2e12), r"a.tum: line 13: its position .*-2000000000000.0.* is beyond 1e[+]12 m"),
        (range(5), spoiled(3, 1, 1, 2.0), r"a.tum: line 13: its upper left 3x3 is not a rotation"),
        (range(5), spoiled(3, 1, 1, 1e300), r"a.tum: line 13: its upper left 3x3 is not a rotation"),
        (range(5), spoiled(4, 3, 0, 1.0), r"a.tum: line 14: .* or its last row not 0 0 0 1"),
        (range(5), poses() * np.array([1, 1, -1, 1.0]), r"a.tum: line 10: its upper left 3x3 is not a rotation"),
        (range(4), poses(), r"a.tum: expected stamps \(T,\) and poses \(T, 4, 4\), got \(4,\) and \(5, 4, 4\)"),
        ([], poses(0), r"a.tum: a trajectory needs at least one pose"),
    ],
)
def test_a_fault_is_reported_with_its_line(t: list[float], path: FloatArray, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        Trajectory(np.array(t, dtype=float), path, source="a.tum", line=np.arange(10, 15))


def test_without_lines_a_pose_is_named_by_its_index() -> None:
    with pytest.raises(InputError, match=r"ours: pose 3: it is not finite"):
        Trajectory(np.arange(5.0), spoiled(3, 0, 3, np.nan), name="ours")


def test_it_is_a_copy_that_cannot_be_written_to() -> None:
    t, given_poses = np.arange(5.0), poses()
    path = Trajectory(t, given_poses)
    np.testing.assert_array_equal(path.world_T_body, given_poses)
    given_poses[:] = 0.0
    t[:] = 0.0
    assert path.t[4] == 4.0
    assert path.world_T_body[0, 3, 3] == 1.0
    for array in (path.t, path.world_T_body, path.position, path.rotation):
        assert not array.flags.writeable


@given(seed=st.integers(0, 2**32 - 1), size=st.floats(1e-11, 1e-7))
def test_rotations_that_are_nearly_so_are_made_exact(seed: int, size: float) -> None:
    random = np.random.default_rng(seed)
    off = poses()
    off[:, :3, :3] += size * random.normal(size=(5, 3, 3))
    path = Trajectory(np.arange(5.0), off)
    U, _, Vt = np.linalg.svd(off[:, :3, :3])
    np.testing.assert_allclose(path.rotation, U @ Vt, rtol=0, atol=2e-12)
    assert so3.orthogonality_error(path.rotation).max() < 2e-12
    np.testing.assert_array_equal(path.position, off[:, :3, 3])


def test_frames_without_a_pose_are_left_out_and_half_known_ones_are_wrong() -> None:
    path = poses()
    path[[1, 4]] = np.nan
    found = Trajectory.of_frames(np.arange(5.0), path, "filter")
    assert found.t.tolist() == [0.0, 2.0, 3.0]
    np.testing.assert_array_equal(found.world_T_body, path[[0, 2, 3]])
    path[2, 0, 0] = np.nan
    with pytest.raises(InputError, match="not finite"):
        Trajectory.of_frames(np.arange(5.0), path, "filter")


def test_parts_and_shifts_keep_their_poses_and_lines() -> None:
    path = Trajectory(np.arange(5.0), poses(), "a", "a.tum", np.arange(10, 15))
    part = path.at(np.array([0, 3])).later(0.5)
    assert (part.t.tolist(), part.name, part.source) == ([0.5, 3.5], "a", "a.tum")
    np.testing.assert_array_equal(part.world_T_body, path.world_T_body[[0, 3]])
    assert part.line is not None
    assert part.line.tolist() == [10, 13]
    with pytest.raises(InputError, match="at least one pose"):
        path.at(np.empty(0, np.int64))
