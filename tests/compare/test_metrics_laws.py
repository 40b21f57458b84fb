"""What must hold of every metric whatever the trajectories: frames, swaps, straight lines and standing still."""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline import compare
from fgbaseline.compare import Align, MatchedTrajectories
from fgbaseline.compare.trajectory.wahba import solve_wahba
from fgbaseline.data import Trajectory
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FgbaselineError, FloatArray, InputError, se3, so3

SEEDS = st.integers(0, 2**32 - 1)
UP = np.array([0.0, 0.0, 1.0])
FITS = (Align.YAW, Align.SE3, Align.SIM3)

PATHS: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "winding": lambda random: random.normal(size=(15, 3)).cumsum(axis=0),
    "flat": lambda random: random.normal(size=(15, 3)).cumsum(axis=0) * [1.0, 1.0, 0.0],
    "straight": lambda random: np.arange(15.0)[:, None] * random.normal(size=3),
    "straight up": lambda _: np.arange(15.0)[:, None] * UP,
    "standing": lambda random: np.tile(random.normal(size=3), (15, 1)),
    "two poses": lambda random: random.normal(size=(2, 3)),
    "one pose": lambda random: random.normal(size=(1, 3)),
}


def path(name: str, seed: int) -> FloatArray:
    """Poses along a path of that kind, with orientations that turn by about 20 degrees around some mean."""
    random = np.random.default_rng(seed)
    positions = PATHS[name](random)
    poses = se3.exp(np.tile(random.normal(size=6), (len(positions), 1)))
    poses = poses @ se3.exp(random.normal(size=(len(positions), 6)) * [0, 0, 0, 0.2, 0.2, 0.2])
    poses[:, :3, 3] = positions
    return poses


def disturbed(poses: FloatArray, seed: int, position: float = 0.1) -> FloatArray:
    """The poses with errors of 3 degrees, and of `position` (m) along the path's own directions only."""
    random = np.random.default_rng(seed)
    wrong = poses @ se3.exp(random.normal(size=(len(poses), 6)) * np.repeat([0.0, 0.05], 3))
    centered = poses[:, :3, 3] - poses[:, :3, 3].mean(axis=0)
    weights = random.normal(size=(len(poses), len(poses))) / len(poses)
    wrong[:, :3, 3] += position * weights @ centered
    return wrong


def matched(reference: FloatArray, estimate: FloatArray) -> MatchedTrajectories:
    t = 0.5 * np.arange(len(reference))
    return compare.associate(Trajectory(t, reference, "reference"), Trajectory(t, estimate, "estimate"))


def motion(seed: int, about_up: bool = False) -> FloatArray:
    random = np.random.default_rng(seed)
    return se3.exp(random.normal(size=6) * ([5, 5, 5, 0, 0, 2] if about_up else [5, 5, 5, 2, 2, 2]))


def all_metrics(pair: MatchedTrajectories, up: FloatArray) -> pd.Series:
    """Every figure there is of a pair, under names."""
    parts = {"absolute": compare.absolute_errors(pair)}
    for unit, delta in (("frames", 3), ("s", 1.6), ("m", 1.7), ("deg", 25.0)):
        for every in (False, True):
            try:
                parts[f"{unit} {every}"] = compare.relative_errors(pair, delta, unit, all_pairs=every)
            except InputError:
                parts[f"{unit} {every}"] = pd.DataFrame()
    growth = compare.divergence_along_path(pair, up)
    parts["growth"], parts["by part"] = growth, compare.divergence_growth(growth, 4)
    parts["segments"] = compare.segment_errors(pair).table
    parts["drift"] = compare.drift(pair, repetitions=20).select_dtypes("number")
    shares = compare.error_decomposition(pair, up)
    parts["shares"] = pd.DataFrame([{name: getattr(shares, name) for name in shares.__slots__}])
    columns = {f"{name}: {c}": table[c].reset_index(drop=True) for name, table in parts.items() for c in table}
    return pd.concat(columns)


@settings(max_examples=30)
@given(seed=SEEDS, kind=st.sampled_from(Align))
def test_a_rigid_motion_of_both_changes_nothing(seed: int, kind: Align) -> None:
    reference = path("winding", seed)
    estimate = disturbed(reference, seed + 1)
    moved = motion(seed + 2, about_up=kind is Align.YAW)
    up = moved[:3, :3] @ UP
    before = all_metrics(matched(reference, estimate).aligned(kind, up=UP), UP)
    after = all_metrics(matched(moved @ reference, moved @ estimate).aligned(kind, up=up), up)
    pd.testing.assert_series_equal(before, after, rtol=1e-6, atol=1e-8)


@given(seed=SEEDS, kind=st.sampled_from([Align.FIRST_POSE, *FITS]), name=st.sampled_from(sorted(PATHS)))
def test_moving_one_changes_no_aligned_error(seed: int, kind: Align, name: str) -> None:
    reference = path(name, seed)
    estimate = disturbed(reference, seed + 1)
    moved = motion(seed + 2, about_up=kind is Align.YAW)
    before = compare.absolute_errors(matched(reference, estimate).aligned(kind))
    after = compare.absolute_errors(matched(reference, moved @ estimate).aligned(kind))
    pd.testing.assert_frame_equal(before, after, rtol=1e-6, atol=1e-7)


@given(seed=SEEDS, kind=st.sampled_from([Align.FIRST_POSE, Align.YAW, Align.SE3]), name=st.sampled_from(sorted(PATHS)))
def test_swapping_reference_and_estimate_inverts_a_rigid_alignment(seed: int, kind: Align, name: str) -> None:
    reference = path(name, seed)
    estimate = motion(seed + 2, about_up=kind is Align.YAW) @ disturbed(reference, seed + 1)
    there = compare.align(estimate, reference, kind)
    back = compare.align(reference, estimate, kind)
    np.testing.assert_allclose(there.matrix @ back.matrix, np.eye(4), atol=1e-7)
    assert [f.split(" (")[0] for f in there.free] == [f.split(" (")[0] for f in back.free]


@given(seed=SEEDS, kind=st.sampled_from(FITS), name=st.sampled_from(sorted(PATHS)))
def test_no_other_motion_of_its_kind_fits_better(seed: int, kind: Align, name: str) -> None:
    reference = path(name, seed)
    estimate = motion(seed + 2) @ disturbed(reference, seed + 1, position=0.5)
    best = compare.align(estimate, reference, kind)
    assert so3.orthogonality_error(best.rotation) < 1e-12
    random = np.random.default_rng(seed + 3)
    x, y = estimate[:, :3, 3], reference[:, :3, 3]
    lowest = np.sum((best.apply(estimate)[:, :3, 3] - y) ** 2)
    for size in (1e-4, 0.01, 0.3, 3.0):
        twist = size * random.normal(size=6) * ([1, 1, 1, 0, 0, 1] if kind is Align.YAW else 1.0)
        other = se3.exp(twist)
        scale = best.scale * (np.exp(0.1 * size * random.normal()) if kind is Align.SIM3 else 1.0)
        R, p = other[:3, :3] @ best.rotation, other[:3, :3] @ best.translation + other[:3, 3]
        assert np.sum((scale * x @ R.T + p - y) ** 2) >= lowest * (1 - 1e-9) - 1e-12


@given(seed=SEEDS, name=st.sampled_from(sorted(PATHS)), kind=st.sampled_from([Align.FIRST_POSE, *FITS]))
def test_a_moved_copy_is_brought_back_onto_the_reference_orientations_included(
    seed: int, name: str, kind: Align
) -> None:
    reference = path(name, seed)
    moved = motion(seed + 2, about_up=kind is Align.YAW) @ reference
    errors = compare.absolute_errors(matched(reference, moved).aligned(kind))
    assert errors[["translation", "rotation_deg"]].to_numpy().max() < 1e-6


@pytest.mark.parametrize(
    ("name", "kind", "free"),
    [
        ("winding", Align.SE3, ()),
        ("flat", Align.SIM3, ()),
        ("straight", Align.SE3, ("the rotation about",)),
        ("two poses", Align.SIM3, ("the rotation about",)),
        ("standing", Align.SE3, ("every rotation",)),
        ("one pose", Align.SIM3, ("every rotation", "scale")),
        ("straight", Align.YAW, ()),
        ("straight up", Align.YAW, ("yaw",)),
        ("standing", Align.YAW, ("yaw",)),
    ],
)
@pytest.mark.parametrize("far", [0.0, 1e6])
def test_degrees_of_freedom_that_a_path_leaves_open_are_reported(
    name: str, kind: Align, free: tuple[str, ...], far: float
) -> None:
    reference = path(name, 4)
    reference[:, :3, 3] += far
    done = compare.align(motion(9, about_up=True) @ reference, reference, kind)
    assert len(done.free) == len(free)
    assert all(said.startswith(wanted) for said, wanted in zip(done.free, free, strict=True))
    assert ("not determined" in done.caption) == bool(free)


def test_a_straight_path_is_turned_about_itself_as_its_orientations_say() -> None:
    reference = path("straight", 1)
    axis = reference[1, :3, 3] - reference[0, :3, 3]
    rolled = np.eye(4)
    rolled[:3, :3] = so3.exp_so3(0.7 * axis / np.linalg.norm(axis))
    done = compare.align(rolled @ reference, reference, Align.SE3)
    np.testing.assert_allclose(done.rotation, rolled[:3, :3].T, atol=1e-9)
    without = compare.align_se3((rolled @ reference)[:, :3, 3], reference[:, :3, 3])
    np.testing.assert_allclose(without[:3, :3], np.eye(3), atol=1e-9)  # positions alone: the smallest rotation


@given(seed=SEEDS)
def test_a_mirror_image_gets_a_rotation_and_no_reflection(seed: int) -> None:
    reference = path("winding", seed)
    mirrored = reference.copy()
    mirrored[:, 0, 3] *= -1.0
    for kind in FITS:
        assert np.linalg.det(compare.align(mirrored, reference, kind).rotation) == pytest.approx(1.0)
        assert compare.align(mirrored, reference, kind).scale > 0


@given(seed=SEEDS, n=st.integers(1, 14))
def test_the_first_n_pairs_alone_decide(seed: int, n: int) -> None:
    reference = path("winding", seed)
    estimate = motion(seed) @ disturbed(reference, seed + 1)
    whole = compare.align(estimate, reference, Align.SE3, first=n)
    part = compare.align(estimate[:n], reference[:n], Align.SE3)
    np.testing.assert_array_equal(whole.matrix, part.matrix)
    assert f"over the first {plural(n, 'pose') if n > 1 else 'pose'}" in whole.caption
    if n == 1:
        first = compare.align(estimate, reference, Align.FIRST_POSE)
        np.testing.assert_allclose(whole.matrix, first.matrix, atol=1e-9)


def test_a_degenerate_alignment_is_refused_with_its_reason() -> None:
    pair = matched(path("winding", 0), path("winding", 1))
    with pytest.raises(
        InputError, match=r"'se4' is not a kind of alignment; choose one of none, first-pose, yaw, se3, sim3"
    ):
        pair.aligned("se4")
    with pytest.raises(InputError, match="the first 16 pose pairs: expected a number from 1 to 15"):
        pair.aligned("se3", first=16)
    with pytest.raises(InputError, match="it is aligned already"):
        pair.aligned("se3").aligned("se3")
    with pytest.raises(FgbaselineError, match="alignment needs paired poses"):
        compare.align(np.empty((0, 4, 4)), np.empty((0, 4, 4)), "se3")


def test_no_metric_changes_its_arguments() -> None:
    reference, estimate = path("winding", 0), path("winding", 1)
    before = reference.copy(), estimate.copy()
    for kind in Align:
        compare.align(estimate, reference, kind)
    pair = matched(reference, estimate)
    aligned = pair.aligned("sim3")
    all_metrics(aligned, UP)
    np.testing.assert_array_equal(pair.estimate.world_T_body, before[1])
    np.testing.assert_array_equal(reference, before[0])
    np.testing.assert_array_equal(estimate, before[1])
    assert pair.caption.endswith("; not aligned")
    assert "Sim(3)-aligned over all 15 poses (scale" in aligned.caption


def test_an_undetermined_rotation_is_not_aligned() -> None:
    """Standing still, with orientations that are half turns about all three axes: their sum is zero."""
    half_turns = np.stack([np.diag([1.0, a, b, 1.0]) for a, b in ((1, 1), (-1, -1), (1, -1), (-1, 1))])
    half_turns[2:, 0, 0] = -1.0
    standing = np.tile(np.eye(4), (4, 1, 1))
    done = compare.align(standing, half_turns, Align.SE3)
    np.testing.assert_array_equal(done.matrix, np.eye(4))
    assert done.free == ("every rotation",)
    turned = compare.align(standing, half_turns, Align.YAW)
    np.testing.assert_array_equal(turned.matrix, np.eye(4))
    assert turned.free == ("yaw",)


def test_no_vectors_at_all_leave_the_whole_rotation_to_the_tie() -> None:
    turn = so3.exp_so3(np.array([0.1, -0.4, 0.3]))
    R, axis = solve_wahba(np.zeros((3, 3)), lambda: turn, 0.0)
    np.testing.assert_allclose(R, turn, atol=1e-12)
    assert axis is not None
    np.testing.assert_array_equal(axis, np.zeros(3))


@pytest.mark.parametrize("length", [0.25, 7.0])
def test_up_is_a_direction_of_any_length(length: float) -> None:
    reference = path("winding", 3)
    pair = matched(reference, motion(4) @ disturbed(reference, 5))
    unit = all_metrics(pair.aligned("yaw", up=UP), UP)
    other = all_metrics(pair.aligned("yaw", up=length * UP), length * UP)
    pd.testing.assert_series_equal(unit, other, rtol=1e-9, atol=1e-9)
    pd.testing.assert_frame_equal(
        compare.decomposition_intervals(pair, UP, repetitions=5),
        compare.decomposition_intervals(pair, length * UP, repetitions=5),
    )


def test_the_scale_of_one_camera_is_estimated_and_reported() -> None:
    reference = path("winding", 6)
    half = motion(7) @ reference
    half[:, :3, 3] *= 0.5
    done = compare.align(half, reference, "sim3")
    assert done.scale == pytest.approx(2.0)
    np.testing.assert_allclose(done.apply(half), reference, atol=1e-9)
    np.testing.assert_allclose(done.matrix[:3, :3], 2.0 * done.rotation)
    assert (done.n, done.available, done.free) == (15, 15, ())


@pytest.mark.parametrize(
    ("kind", "first", "n", "caption"),
    [
        ("none", None, 0, "not aligned"),
        ("first-pose", None, 1, "aligned at the first pose"),
        ("yaw", None, 15, "yaw and position aligned over all 15 poses"),
        ("se3", 15, 15, "SE(3)-aligned over all 15 poses"),
        ("se3", 1, 1, "SE(3)-aligned over the first pose; not determined by the positions: every rotation"),
        ("sim3", 4, 4, "Sim(3)-aligned over the first 4 poses (scale 1)"),
    ],
)
def test_the_caption_states_the_alignment(kind: str, first: int | None, n: int, caption: str) -> None:
    done = compare.align(path("winding", 0), path("winding", 0), kind, first=first)
    assert done.caption == caption
    assert (done.n, done.available) == (n, 15)


def test_the_axis_that_is_left_open_is_named() -> None:
    reference = path("straight up", 0)
    done = compare.align(reference, reference, "sim3")
    assert done.free == ("the rotation about (0.000, 0.000, 1.000)",)
    with pytest.raises(InputError, match="the first 0 pose pairs"):
        compare.align(reference, reference, "se3", first=0)


def test_yaw_is_about_up_wherever_that_points_and_as_the_first_poses_say() -> None:
    reference = path("winding", 8)
    up = np.array([0.0, -0.6, 0.8])
    turn = np.eye(4)
    turn[:3, :3] = so3.exp_so3(0.7 * up)
    pair = matched(reference, turn @ reference).aligned("yaw", up=2.0 * up)
    assert compare.absolute_errors(pair)["translation"].max() < 1e-9
    np.testing.assert_allclose(pair.alignment.rotation, turn[:3, :3].T, atol=1e-9)
    assert pair.alignment.free == ()
    later = turn @ reference
    later[:4] = reference[:4]
    first = matched(reference, later).aligned("se3", first=4)
    np.testing.assert_allclose(first.alignment.matrix, np.eye(4), atol=1e-9)
