"""Poses are paired by time: each once, none across another, and what is left over is counted."""

from dataclasses import replace

import numpy as np
import pytest
from evo.core import sync
from evo.core.sync_method import SyncMethod
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from fgbaseline import compare
from fgbaseline.compare import Association
from fgbaseline.compare.trajectory.association import nearest_pairs
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, InputError, se3

from ..builders.evo_metrics import evo_path


def path(t: FloatArray | list[float], name: str = "path") -> Trajectory:
    """A smooth curve with turns, seen at these times (s)."""
    t = np.asarray(t, dtype=float)
    poses = se3.exp(np.stack([t, 0 * t, 0 * t, 0.1 * np.sin(t), 0.2 * t, np.cos(t)], axis=1))
    poses[:, :3, 3] = np.stack([10 * np.sin(t), 5 * np.cos(0.7 * t), t], axis=1)
    return Trajectory(t, poses, name, f"{name}.tum")


def closest_first(a: list[float], b: list[float], tolerance: float) -> list[tuple[int, int]]:
    """The definition, one pair after another; a and b may not have two equal gaps."""
    gaps = sorted((abs(x - y), i, j) for i, x in enumerate(a) for j, y in enumerate(b) if abs(x - y) <= tolerance)
    pairs: list[tuple[int, int]] = []
    for _, i, j in gaps:
        if all(i != k and j != m and (i < k) == (j < m) for k, m in pairs):
            pairs.append((i, j))
    return sorted(pairs)


STAMPS = st.lists(st.floats(0, 10), min_size=1, max_size=12, unique=True).map(sorted)


@given(a=STAMPS, b=STAMPS, tolerance=st.floats(0, 5))
def test_pairs_are_the_closest_first_without_crossing(a: list[float], b: list[float], tolerance: float) -> None:
    gaps = [abs(x - y) for x in a for y in b]
    i, j = nearest_pairs(np.array(a), np.array(b), tolerance)
    if len(set(gaps)) == len(gaps):
        assert list(zip(i.tolist(), j.tolist(), strict=True)) == closest_first(a, b, tolerance)
    assert (np.diff(i) > 0).all()
    assert (np.diff(j) > 0).all()
    assert (np.abs(np.array(a)[i] - np.array(b)[j]) <= tolerance).all()
    left = {x for k, x in enumerate(a) if k not in i}, {y for k, y in enumerate(b) if k not in j}
    for x in left[0]:  # nothing that could still be paired is left
        for y in left[1]:
            between = np.searchsorted(np.array(a)[i], x) == np.searchsorted(np.array(b)[j], y)
            assert abs(x - y) > tolerance or not between


def test_a_shift_of_half_an_interval_pairs_neighbors() -> None:
    t = np.arange(50.0)
    i, j = nearest_pairs(t, t + 0.5, 0.5)
    np.testing.assert_array_equal(i, np.arange(50))
    np.testing.assert_array_equal(j, np.arange(50))
    i, j = nearest_pairs(t + 0.5, t, 0.5)  # the other way round the ends have no partner
    np.testing.assert_array_equal(i, np.arange(49))
    np.testing.assert_array_equal(j, np.arange(1, 50))


def test_as_evo_where_each_pose_has_one_partner() -> None:
    random = np.random.default_rng(0)
    long = path(np.arange(400) * 0.1 + random.uniform(-0.02, 0.02, 400))
    short = path(np.sort(random.choice(400, 150, replace=False)) * 0.1 + random.uniform(-0.02, 0.02, 150))
    for reference, estimate in ((long, short), (short, long)):
        ours = compare.associate(reference, estimate, tolerance=0.03, offset=0.001)
        evos = sync.associate_trajectories(evo_path(reference), evo_path(estimate), max_diff=0.03, offset_2=0.001)
        np.testing.assert_array_equal(ours.reference.t, evos[0].timestamps)
        np.testing.assert_allclose(ours.estimate.t, evos[1].timestamps + 0.001, rtol=1e-15)
        np.testing.assert_allclose(ours.estimate.world_T_body, np.array(evos[1].poses_se3), atol=1e-12)
        assert ours.left_out_reference == len(reference) - len(ours)
        assert ours.left_out_estimate == len(estimate) - len(ours)


def test_unlike_evo_no_pose_is_paired_twice() -> None:
    reference, estimate = path([0.0, 1.0], "truth"), path([0.9, 1.05], "ours")
    evos = sync.associate_trajectories(evo_path(reference), evo_path(estimate), max_diff=0.2)
    assert evos[0].timestamps.tolist() == [1.0, 1.0]
    ours = compare.associate(reference, estimate, tolerance=0.2)
    assert ours.reference.t.tolist() == [1.0]
    assert ours.estimate.t.tolist() == [1.05]
    assert (ours.left_out_reference, ours.left_out_estimate) == (1, 1)
    assert ours.caption.startswith("1 pose paired (within 0.2 s; left out: 1 of the reference, 1 of the estimate)")


@pytest.mark.parametrize("denser", ["reference", "estimate"])
def test_interpolation_is_that_of_evo_and_scipy(denser: str) -> None:
    random = np.random.default_rng(3)
    dense, sparse = path(np.arange(0, 20, 0.05)), path(np.sort(random.uniform(0.1, 19.9, 80)))
    pair = (dense, sparse) if denser == "reference" else (sparse, dense)
    ours = compare.associate(*pair, how="interpolated", tolerance=0.05)
    evos = sync.associate_trajectories(*map(evo_path, pair), sync_method=SyncMethod.interpolation, max_diff=0.05)
    for mine, theirs in zip((ours.reference, ours.estimate), evos, strict=True):
        np.testing.assert_allclose(mine.t, theirs.timestamps)
        np.testing.assert_allclose(mine.world_T_body, np.array(theirs.poses_se3), atol=1e-9)
    drawn = ours.reference if denser == "reference" else ours.estimate
    slerp = Slerp(dense.t, Rotation.from_matrix(dense.rotation))(sparse.t)
    np.testing.assert_allclose(drawn.rotation, slerp.as_matrix(), atol=1e-12)
    for axis in range(3):
        np.testing.assert_allclose(
            drawn.position[:, axis], np.interp(sparse.t, dense.t, dense.position[:, axis]), atol=1e-12
        )
    assert (ours.left_out_reference, ours.left_out_estimate)[denser == "reference"] == 0


def test_interpolation_goes_through_the_poses_and_never_beyond_the_ends() -> None:
    dense = path(np.arange(0.0, 5.0, 0.5), "truth")
    at_poses = compare.interpolated(dense, dense.t)
    assert at_poses.world_T_body.tobytes() == dense.world_T_body.tobytes()
    with pytest.raises(ValueError, match="beyond its ends"):
        compare.interpolated(dense, np.array([0.0, 4.6]))
    estimate = path([-0.2, 0.1, 1.7, 4.4, 4.6], "ours")  # evo holds its ends still and counts these poses in
    ours = compare.associate(dense, estimate, how=Association.INTERPOLATED)
    assert ours.reference.t.tolist() == [0.1, 1.7, 4.4]
    assert ours.left_out_estimate == 2
    assert ours.interpolated == "truth"
    assert "truth interpolated" in ours.caption


def test_a_gap_is_not_bridged() -> None:
    dense = path(np.concatenate([np.arange(0.0, 5.0, 0.1), np.arange(8.0, 12.0, 0.1)]))
    estimate = path(np.arange(0.05, 11.0, 0.25))
    ours = compare.associate(dense, estimate, how="interpolated")
    assert not ((ours.reference.t > 5.2) & (ours.reference.t < 7.8)).any()
    assert ours.left_out_estimate == len(estimate) - len(ours) > 5


@pytest.mark.parametrize("how", Association)
def test_nothing_in_common_names_both_and_their_times(how: Association) -> None:
    with pytest.raises(InputError, match=r"no pose of b.tum is within .* s of one of a.tum: a runs from 0.0 to 1.0 s"):
        compare.associate(path([0, 1], "a"), path([100, 101], "b"), how=how)
    with pytest.raises(InputError, match="tolerance: expected seconds of at least 0"):
        compare.associate(path([0, 1], "a"), path([0, 1], "b"), how=how, tolerance=-1.0)


@pytest.mark.parametrize("offset", [-0.83, 0.0, 0.2471])
@pytest.mark.parametrize("dense", [0.01, 0.1])
def test_an_offset_in_time_is_found(offset: float, dense: float) -> None:
    t = np.arange(0.0, 30.0, dense)
    reference, estimate = path(t), path(np.arange(0.0, 30.0, 0.1) + 0.003)
    found = compare.time_offset(reference, estimate.later(-offset), 2.0)
    assert found.seconds == pytest.approx(offset, abs=1e-3)
    assert found.determined
    assert found.low <= found.seconds <= found.high
    assert found.rmse <= found.rmse_without
    moved = compare.associate(reference, estimate.later(-offset), how="interpolated", offset=found.seconds)
    assert compare.absolute_errors(moved)["translation"].max() < 0.05


def test_the_range_of_an_offset_ends_where_the_error_is_a_twentieth_larger() -> None:
    reference, exact = path(np.arange(0.0, 30.0, 0.05)), path(np.arange(0.0, 30.0, 0.1))
    poses = np.array(exact.world_T_body)
    poses[:, :3, 3] += 0.3 * np.random.default_rng(0).normal(size=(len(exact), 3))
    estimate = exact.with_poses(poses).later(0.05)
    found = compare.time_offset(reference, estimate, 1.0)
    assert found.determined
    assert found.low < found.seconds < found.high
    both = (estimate.t - 1.0 >= reference.t[0]) & (estimate.t + 1.0 <= reference.t[-1])
    inner = estimate.at(np.flatnonzero(both))
    for end in (found.low, found.high):
        moved = compare.associate(reference, inner, how="interpolated", offset=end, tolerance=1.0)
        assert len(moved) == len(inner)
        rmse = compare.absolute_errors(moved.aligned("se3"))["translation"]
        assert np.sqrt(np.mean(rmse**2)) == pytest.approx(1.05 * found.rmse, rel=1e-4)


def test_a_time_offset_that_the_path_does_not_determine_is_reported_as_undetermined() -> None:
    t = np.arange(0.0, 30.0, 0.1)
    steady = Trajectory(t, se3.compose(np.tile(se3.exp([1.0, 0, 0, 0, 0, 0]), (len(t) - 1, 1, 1))))
    assert not compare.time_offset(steady, steady.later(0.3), 2.0).determined
    assert not compare.time_offset(path(t), path(t).later(-0.6), 0.5).determined
    with pytest.raises(InputError, match="give a width that is smaller than their overlap"):
        compare.time_offset(path(t), path(t), 20.0)
    with pytest.raises(InputError, match="needs a width above 0 s, got 0"):
        compare.time_offset(path(t), path(t), 0.0)
    with pytest.raises(InputError, match="it has one pose only"):
        compare.time_offset(path(t), path([1.0]), 1.0)
    with pytest.raises(InputError, match="it has no time stamps, so no offset"):
        compare.time_offset(path(t), replace(path(t), stamped=False), 1.0)


def test_frame_numbers_are_not_taken_for_seconds() -> None:
    t = np.arange(5.0)
    bare = replace(path(t, "bare"), stamped=False)
    assert len(compare.associate(bare, replace(path(t), stamped=False))) == 5
    for pair in ((bare, path(t)), (path(t), bare)):
        with pytest.raises(InputError, match=r"bare.tum: it has no time stamps, but path.tum has; give it the times"):
            compare.associate(*pair)


def test_absolute_errors_are_those_of_each_pose_at_its_time() -> None:
    t, poses = np.array([1.0, 2.0, 4.0]), np.tile(np.eye(4), (3, 1, 1))
    wrong = poses.copy()
    wrong[1, :3, 3] = [3.0, 4.0, 0.0]
    wrong[2] = se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.deg2rad(30.0)])
    pair = compare.associate(Trajectory(t, poses, "truth"), Trajectory(t, wrong, "estimate"))
    table = compare.absolute_errors(pair)
    assert table.index.name == "pose_index"
    assert table.columns.tolist() == ["t", "translation", "rotation_deg", "rotation_chord", "pose"]
    assert table["t"].tolist() == [1.0, 2.0, 4.0]
    assert table["translation"].tolist() == [0.0, 5.0, 0.0]
    assert table["rotation_deg"].tolist() == pytest.approx([0.0, 0.0, 30.0])


def steady(t: FloatArray | list[float], speed: float, late: float = 0.0, name: str = "path") -> Trajectory:
    """Straight ahead at `speed` m/s, with stamps that are `late` by so many seconds."""
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, 0, 3] = speed * np.asarray(t)
    return Trajectory(np.asarray(t) + late, poses, name)


def test_three_common_poses_are_enough_for_an_offset_and_two_are_not() -> None:
    reference = path(np.arange(0.0, 4.0625, 0.0625))
    found = compare.time_offset(reference, path([1.0, 2.0, 3.0]), 1.0)  # the ends of the search reach those of the path
    assert found.seconds == pytest.approx(0.0, abs=1e-3)
    assert compare.time_offset(path([1.0, 2.0, 3.0]), reference, 1.0).seconds == pytest.approx(0.0, abs=1e-3)
    with pytest.raises(InputError, match="2 poses of short overlap with path at each of them, 3 are needed"):
        compare.time_offset(reference, path([1.0, 3.0], "short"), 1.0)
    assert compare.time_offset(path(np.arange(0.0, 4.0, 0.0625)), path([1.0, 2.0, 2.5]), 1.0).determined
    with pytest.raises(InputError, match="2 poses"):  # at 3 + 1 s the reference has ended
        compare.time_offset(path(np.arange(0.0, 4.0, 0.0625)), path([1.0, 2.0, 3.0]), 1.0)


def test_without_alignment_the_error_is_speed_times_offset() -> None:
    found = compare.time_offset(
        steady(np.arange(0.0, 20.0, 0.1), 2.0), steady(np.arange(0.0, 20.0, 0.5), 2.0, late=0.3), 1.0, "none"
    )
    assert found.seconds == pytest.approx(-0.3, abs=1e-5)
    assert found.rmse == pytest.approx(0.0, abs=1e-5)
    assert found.rmse_without == pytest.approx(0.6, abs=1e-9)
    assert (found.low, found.high) == pytest.approx((-0.3, -0.3), abs=1e-4)
    assert found.determined


def test_a_gap_that_is_the_tolerance_is_within_it() -> None:
    pair = compare.associate(path([0.0, 1.0]), path([0.25, 1.25]), tolerance=0.25)
    assert (len(pair), pair.tolerance) == (2, 0.25)
    drawn = compare.associate(path([0.0, 1.0, 2.0]), path([0.0, 0.5, 2.0]), how="interpolated", tolerance=0.5)
    assert drawn.reference.t.tolist() == [0.0, 0.5, 2.0]  # the ends are inside
    assert compare.associate(path([1.0]), path([1.0]), tolerance=0.0).caption.startswith("1 pose paired (within 0 s;")


def test_stamps_of_five_meters_of_driving_apart_are_not_paired_by_default() -> None:
    assert compare.associate(path([0.0, 1.0]), path([0.0099, 1.0101])).estimate.t.tolist() == [0.0099]


def test_of_two_equally_dense_paths_the_reference_is_interpolated() -> None:
    reference, estimate = path([0.0, 1.0, 2.0, 3.0, 4.0], "truth"), path([0.5, 1.5, 2.5], "ours")
    pair = compare.associate(reference, estimate, how="interpolated")
    assert pair.interpolated == "truth"
    assert pair.estimate.world_T_body.tobytes() == estimate.world_T_body.tobytes()
    assert pair.tolerance == 1.0  # one interval
    # Poses beyond the ends of what is paired are left out; those between were drawn upon.
    assert (pair.left_out_reference, pair.left_out_estimate) == (3, 0)
    other = compare.associate(
        path([1.0, 2.5, 4.5], "truth"), path([0.0, 1.0, 2.0, 3.0, 4.0], "ours"), how="interpolated"
    )
    assert other.interpolated == "ours"
    assert other.reference.t.tolist() == [1.0, 2.5]
    assert (other.left_out_reference, other.left_out_estimate) == (1, 3)


def test_one_pose_is_compared_with_what_is_interpolated_for_it() -> None:
    many, one = path([0.0, 1.0, 2.0], "many"), path([0.5], "one")
    for pair in (compare.associate(many, one, how="interpolated"), compare.associate(one, many, how="interpolated")):
        assert (len(pair), pair.interpolated) == (1, "many")
    with pytest.raises(InputError, match=r"one\.tum: it has one pose only, which cannot be interpolated"):
        compare.associate(one, one, how="interpolated")


def test_the_caption_states_how_poses_were_paired() -> None:
    pair = compare.associate(
        path([0.0, 1.0, 2.0], "truth"), path([0.25, 1.25], "ours"), how="interpolated", offset=0.25, tolerance=0.5
    )
    assert pair.estimate.t.tolist() == [0.5, 1.5]
    assert pair.caption == (
        "2 poses paired (truth interpolated, stamps within 0.5 s, ours +0.25 s; "
        "left out: 2 of the reference, 0 of the estimate); not aligned"
    )


@pytest.mark.parametrize("sparse", ["reference", "estimate"])
def test_the_error_with_an_offset_is_in_meters_of_the_reference_also_where_the_scale_is_fitted(sparse: str) -> None:
    dense, few = path(np.arange(0.0, 20.0, 0.05)), path(np.arange(0.0, 20.0, 0.25))
    reference, estimate = (few, dense) if sparse == "reference" else (dense, few)
    errors = 0.1 * np.random.default_rng(1).normal(size=estimate.position.shape)

    def offset(scale: float) -> compare.TimeOffset:
        poses = np.array(estimate.world_T_body)
        poses[:, :3, 3] = scale * (poses[:, :3, 3] + errors)
        return compare.time_offset(reference, estimate.with_poses(poses), 1.0, "sim3")

    assert offset(0.01).rmse == pytest.approx(offset(1.0).rmse, rel=1e-6)
