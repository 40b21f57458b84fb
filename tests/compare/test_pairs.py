"""Which poses are a delta apart: the definitions, by brute force."""

import numpy as np
import pytest
from evo.core.filters import filter_pairs_by_path
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import compare
from fgbaseline.compare import Unit
from fgbaseline.compare.trajectory import delta_pairs as pairs_module
from fgbaseline.compare.trajectory.delta_pairs import chained_pairs, nearest_delta_pairs, turned_pairs
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, InputError, se3, so3

RISING = st.lists(st.floats(0.01, 3.0), min_size=1, max_size=30).map(lambda steps: np.cumsum([0.0, *steps]))


@given(along=RISING, delta=st.floats(0.05, 5.0))
def test_consecutive_pairs_end_with_the_first_pose_a_delta_away(along: FloatArray, delta: float) -> None:
    expected, start = [], 0
    for end in range(len(along)):
        if along[end] - along[start] >= delta * (1 - 1e-9):
            expected.append([start, end])
            start = end
    assert chained_pairs(along, delta).tolist() == expected


@given(along=RISING, delta=st.floats(0.05, 5.0), tolerance=st.floats(0.0, 1.0))
def test_all_pairs_are_the_nearest_to_a_delta(along: FloatArray, delta: float, tolerance: float) -> None:
    pairs = nearest_delta_pairs(along, delta, tolerance)
    found = dict(pairs.tolist())
    for start in range(len(along) - 1):
        miss = np.abs(along[start + 1 :] - along[start] - delta)
        if abs(miss.min() - tolerance * delta) < 1e-7:
            continue
        assert (start in found) == (miss.min() < tolerance * delta)
        if start in found:
            assert miss[found[start] - start - 1] == pytest.approx(miss.min(), abs=1e-8 * delta)


@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(1e-3, np.pi), tolerance=st.floats(0.0, 0.5))
def test_turned_pairs_are_all_of_them(seed: int, angle: float, tolerance: float) -> None:
    rotations = so3.exp_so3(np.random.default_rng(seed).normal(size=(12, 3)))
    rotations[5] = rotations[2]
    apart = so3.rotation_angle(np.swapaxes(rotations[:, None], -1, -2) @ rotations)
    i, j = np.nonzero(np.triu(np.abs(apart - angle) <= tolerance + 1e-9 * angle, 1))
    assert turned_pairs(rotations, angle, tolerance).tolist() == np.stack([i, j], axis=1).tolist()


def test_angles_near_zero_and_pi_lose_no_digits() -> None:
    for angle in (1e-7, 1e-3, np.pi - 1e-7):
        rotations = so3.exp_so3(np.array([[0, 0, 0], [0, 0, angle], [0, 0, angle * (1 - 1e-3)]]))
        assert [0, 1] in turned_pairs(rotations, angle, 0.0).tolist()
        assert [0, 2] not in turned_pairs(rotations, angle, 1e-4 * angle).tolist()


def straight(steps: FloatArray) -> FloatArray:
    poses = np.tile(np.eye(4), (len(steps) + 1, 1, 1))
    poses[1:, 0, 3] = np.cumsum(steps)
    return poses


def test_unlike_in_evo_rounding_does_not_decide_where_steps_sum_to_a_delta() -> None:
    poses = straight(np.full(100, 0.1))
    evos = filter_pairs_by_path(list(poses), 1.0)
    assert [end - start for start, end in evos] != [10] * 10  # ten times 0.1 is a little less than 1
    ours = compare.pose_pairs(poses, np.arange(101.0), 1.0, Unit.METERS)
    assert (ours[:, 1] - ours[:, 0]).tolist() == [10] * 10


def test_seconds_are_those_of_the_stamps_also_of_large_ones() -> None:
    t = 1.3e9 + 0.1 * np.arange(50)
    poses = straight(np.ones(49))
    np.testing.assert_array_equal(np.diff(compare.pose_pairs(poses, t, 0.5, "s"), axis=1), 5)
    pairs = compare.pose_pairs(poses, t, 0.5, "s", all_pairs=True)
    assert pairs.tolist() == [[i, i + 5] for i in range(45)]
    late = t.copy()
    late[20:] += 7.0  # a gap is in no pair of half a second
    gap = compare.pose_pairs(poses, late, 0.5, "s", all_pairs=True)
    assert not ((gap[:, 0] < 20) & (gap[:, 1] >= 20)).any()


def test_a_delta_below_rounding_still_ends() -> None:
    poses = straight(np.full(5, 1e11))
    assert compare.pose_pairs(poses, np.arange(6.0), 1e-9, "m").tolist() == [[i, i + 1] for i in range(5)]


def test_all_pairs_by_frames_are_exact_to_the_end() -> None:
    poses = straight(np.ones(19))
    assert compare.pose_pairs(poses, np.arange(20.0), 15, "frames", all_pairs=True).tolist() == [
        [i, i + 15] for i in range(5)
    ]


@pytest.mark.parametrize(
    ("delta", "unit", "sentence"),
    [
        (0, "m", "delta: expected a number above 0 of m, got 0"),
        (-1.0, "s", "delta: expected a number above 0 of s"),
        (float("nan"), "deg", "delta: expected a number above 0 of deg"),
        (1.5, "frames", "delta: expected a whole number above 0 of frames, got 1.5"),
        (181.0, "deg", "no two orientations are 181.0 degrees apart"),
        (1e6, "m", "no two of the 20 poses are 1e[+]06 m apart; give a smaller delta"),
        (90.0, "deg", "no two of the 20 poses are 90 deg apart"),
    ],
)
@pytest.mark.parametrize("all_pairs", [False, True])
def test_deltas_that_make_no_pairs_are_errors(delta: float, unit: str, sentence: str, all_pairs: bool) -> None:
    with pytest.raises(InputError, match=sentence):
        compare.pose_pairs(straight(np.ones(19)), np.arange(20.0), delta, unit, all_pairs=all_pairs)


@pytest.mark.parametrize("n", [0, 1])
@pytest.mark.parametrize("unit", [*Unit])
@pytest.mark.parametrize("all_pairs", [False, True])
def test_fewer_than_two_poses_make_no_pairs(n: int, unit: Unit, all_pairs: bool) -> None:
    with pytest.raises(InputError, match=f"delta: {n} poses have no pair"):
        compare.pose_pairs(straight(np.ones(1))[:n], np.arange(float(n)), 1.0, unit, all_pairs=all_pairs)


def test_errors_of_motions_are_in_the_body_and_of_poses_in_the_world() -> None:
    """A step of 2 m instead of 1 m after a wrong turn of 90 degrees: worked out by hand."""
    reference = straight(np.ones(2))
    estimate = se3.compose(se3.exp(np.array([[1.0, 0, 0, 0, 0, 0], [2.0, 0, 0, 0, 0, 0]])))
    estimate[1] = estimate[1] @ se3.exp([0, 0, 0, 0, 0, np.pi / 2])
    estimate[2, :3, 3] = [1.0, 2.0, 0.0]
    pairs = np.array([[1, 2]])
    assert compare.relative_pose_error(estimate, reference, pairs, "translation") == pytest.approx([1.0])
    assert compare.relative_pose_error(estimate, reference, pairs, "rotation_deg") == pytest.approx([90.0])
    assert compare.relative_pose_error(estimate, reference, pairs, "distance_percent") == pytest.approx([100.0])
    assert compare.absolute_pose_error(estimate, reference, "translation")[2] == pytest.approx(np.sqrt(5.0))
    assert compare.absolute_pose_error(estimate, reference, "rotation_chord")[1] == pytest.approx(2.0)
    for of_motions in ("distance", "distance_percent"):
        with pytest.raises(
            InputError, match=f"{of_motions}: defined for motions .RPE. only; for poses choose translation, "
        ):
            compare.absolute_pose_error(estimate, reference, of_motions)


def test_a_table_of_motions_has_first_frame_and_span_of_each() -> None:
    t = np.array([0.0, 0.5, 1.5, 2.0, 4.0, 4.5])
    true, drifting = straight(np.array([1.0, 2.0, 1.0, 4.0, 1.0])), straight(np.array([1.5, 2.0, 1.0, 3.0, 1.0]))
    matched = compare.associate(Trajectory(t, true, "truth"), Trajectory(t, drifting, "estimate"))
    table = compare.relative_errors(matched, 2, Unit.FRAMES)
    assert table["start"].tolist() == [0, 2]
    assert table["end"].tolist() == [2, 4]
    assert table["t"].tolist() == [0.0, 1.5]
    assert table["seconds"].tolist() == [1.5, 2.5]
    assert table["meters"].tolist() == [3.0, 5.0]
    assert table["translation"].tolist() == pytest.approx([0.5, 1.0])
    assert table["distance"].tolist() == pytest.approx([0.5, 1.0])
    assert table["distance_percent"].tolist() == pytest.approx([100.0 / 6.0, 20.0])
    assert table["rotation_deg"].tolist() == [0.0, 0.0]
    every = compare.relative_errors(matched, 2, Unit.FRAMES, all_pairs=True)
    assert every["start"].tolist() == [0, 1, 2, 3]
    near = compare.relative_errors(matched, 3.0, Unit.METERS, all_pairs=True, tolerance=0.0)
    wide = compare.relative_errors(matched, 3.0, Unit.METERS, all_pairs=True, tolerance=0.34)
    assert near["start"].tolist() == [0, 1]
    assert wide["start"].tolist() == [0, 1, 3]
    own = compare.relative_errors(matched, 3.5, Unit.METERS, all_pairs=True, from_reference=False, tolerance=0.01)
    assert list(zip(own["start"], own["end"], strict=True)) == [(0, 2)]


def test_half_a_turn_is_the_largest_delta_there_is() -> None:
    poses = se3.exp(np.array([[0.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, np.pi / 2], [0, 0, 0, 0, 0, np.pi]]))
    for every in (False, True):
        assert compare.pose_pairs(poses, np.arange(3.0), 180, "deg", all_pairs=every).tolist() == [[0, 2]]


@pytest.mark.parametrize("at_once", [1, 30, 100_000])
def test_however_many_pairs_are_looked_at_together_they_are_the_same(
    at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rotations = so3.exp_so3(np.random.default_rng(0).normal(size=(10, 3)))
    apart = so3.rotation_angle(np.swapaxes(rotations[:, None], -1, -2) @ rotations)
    expected = np.argwhere(np.triu(np.abs(apart - 1.5) <= 0.7, 1))
    assert len(expected) > 5
    monkeypatch.setattr(pairs_module, "AT_ONCE", at_once)
    assert turned_pairs(rotations, 1.5, 0.7).tolist() == expected.tolist()


def test_the_table_of_motions_is_named() -> None:
    poses = straight(np.ones(4))
    pair = compare.associate(Trajectory(np.arange(5.0), poses), Trajectory(np.arange(5.0), poses))
    table = compare.relative_errors(pair, 1, "frames")
    assert table.columns.tolist() == [
        "start", "end", "t", "seconds", "meters",
        "translation", "rotation_deg", "rotation_chord", "pose", "distance", "distance_percent",
    ]  # fmt: skip


def test_every_difference_of_a_pose_is_its_definition() -> None:
    """2 m and a quarter turn: worked out by hand."""
    wrong = se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2])[None]
    wrong[0, :3, 3] = [0.0, 2.0, 0.0]
    expected = {"translation": 2.0, "rotation": np.pi / 2, "rotation_deg": 90.0, "rotation_chord": 2.0, "pose": 8**0.5}
    both, reference = np.concatenate([np.eye(4)[None], wrong]), np.tile(np.eye(4), (2, 1, 1))
    for what, value in expected.items():
        assert compare.absolute_pose_error(wrong, np.eye(4)[None], what) == pytest.approx([value])
        assert compare.relative_pose_error(both, reference, np.array([[0, 1]]), what) == pytest.approx([value])
    assert compare.relative_pose_error(both, reference, np.array([[0, 1]]), "distance") == pytest.approx([2.0])
    assert np.isnan(compare.relative_pose_error(both, reference, np.array([[0, 1]]), "distance_percent")).all()
