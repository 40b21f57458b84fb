"""A trajectory gives the same metrics whatever program wrote it, or a refusal that names the cause."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fgbaseline.data.formats import read_trajectory, write_kitti, write_trajectory_npz
from fgbaseline.geometry import InputError, se3, so3
from fgbaseline.reports.comparison import ComparisonReport, compare

from ..builders.refusals import refused
from ..builders.trajectory_writers import VARIANTS, Path3D, frames, kitti, rows, tum

EVERY = settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
RATES = (5, 10, 20, 200)
"""Hz"""
STARTS = (0, 17 * 10**9, 55_631 * 10**9, 1_403_636_579 * 10**9)
"""ns: the clock of a recorder, of a computer that runs since then, and since 1970"""


def flight(seed: int, n: int = 60, rate: int = 10, start: int = 0) -> Path3D:
    """A body that turns about all axes as it flies."""
    random = np.random.default_rng(seed)
    steps = np.concatenate([[1.0, 0.0, 0.0], np.zeros(3)]) * 2.0 / rate + random.normal(size=(n - 1, 6)) * 0.05
    steps[:, 3:] += 0.3 * np.sin(np.arange(n - 1)[:, None] / 7.0 + random.uniform(0.0, 6.0, 3))
    poses = se3.compose(se3.exp(steps), se3.exp(random.normal(size=6)))
    return Path3D(tuple(start + k * 10**9 // rate for k in range(n)), poses)


def astray(path: Path3D, seed: int) -> Path3D:
    """The path in another world, with errors that grow."""
    random = np.random.default_rng(seed + 1)
    drift = np.cumsum(random.normal(size=(len(path.ns), 6)) * np.repeat([0.01, 0.002], 3), axis=0)
    return Path3D(path.ns, se3.exp(random.normal(size=6)) @ path.poses @ se3.exp(drift))


def figures(comparison: ComparisonReport, *, oriented: bool = True) -> dict[str, float]:
    """The metrics, those of positions only where the file has no more."""
    table = comparison.metrics.set_index("metric")["value"]
    kept = ("translation.rmse", "translation.max", "pairing.pairs", "shares.heading")
    more = ("rotation_deg.rmse", "relative.1 s.translation.rmse", "drift.translation", "drift.rotation per second")
    chosen = {
        name: float(table[name]) for name in table.index if name.startswith(kept if not oriented else kept + more)
    }
    assert len(chosen) >= 3
    return chosen


def compared(*files: Path | str, **options: Any) -> ComparisonReport | str:
    """The comparison, or why there is none."""
    try:
        return compare(*files, **options)
    except InputError as error:
        return str(error)


@EVERY
@given(
    variant=st.sampled_from(sorted(VARIANTS)),
    seed=st.integers(0, 2**20),
    rate=st.sampled_from(RATES),
    start=st.sampled_from(STARTS),
    of_reference=st.booleans(),
)
def test_every_variant_gives_the_same_metrics_or_names_what_is_in_doubt(
    tmp_path: Path, variant: str, seed: int, rate: int, start: int, of_reference: bool
) -> None:
    made = VARIANTS[variant]
    truth = flight(seed, rate=rate, start=start)
    estimate = astray(truth, seed)
    plain = [tmp_path / "a.tum", tmp_path / "b.tum"]
    for file, path in zip(plain, (truth, estimate), strict=True):
        file.write_text("# timestamp [s] tx ty tz qx qy qz qw\n" + tum(path))
    other = tmp_path / f"other{made.suffix}"
    other.write_bytes(made.write(truth if of_reference else estimate))
    given_files = (other, plain[1]) if of_reference else (plain[0], other)
    expected = figures(compare(plain[0], f"it={plain[1]}"), oriented=made.oriented)
    result = compare(given_files[0], f"it={given_files[1]}", **made.options)
    assert figures(result, oriented=made.oriented) == pytest.approx(expected, rel=1e-5, abs=1e-7)
    if not made.oriented:
        assert "rotation_deg" in result.results["it"].notes
        assert not result.results["it"].relative
        assert any("need orientations and are left out" in sentence for sentence in result.verdict)
        record = result.summary
        both = (record.reference, record.estimates["it"])
        assert sum(any("orientations" in remark for remark in each.remarks) for each in both) == 1
        assert [len(figure.axes) for name, figure in result.figures().items() if name != "paths"] == [4, 1]


@EVERY
@given(
    unit=st.sampled_from(["ms", "us", "ns"]),
    seed=st.integers(0, 2**20),
    rate=st.sampled_from(RATES),
    start=st.sampled_from(STARTS),
    asked=st.booleans(),
)
def test_two_files_in_one_unit_give_the_same_metrics_or_the_unit_is_asked_for(
    tmp_path: Path, unit: str, seed: int, rate: int, start: int, asked: bool
) -> None:
    truth = flight(seed, rate=rate, start=start)
    estimate = astray(truth, seed)
    for name, path in (("a", truth), ("b", estimate)):
        (tmp_path / f"{name}.s.tum").write_text("# timestamp [s] tx ty tz qx qy qz qw\n" + tum(path))
        (tmp_path / f"{name}.tum").write_text(tum(path, unit))
    expected = figures(compare(tmp_path / "a.s.tum", f"it={tmp_path / 'b.s.tum'}"))
    files = (tmp_path / "a.tum", f"it={tmp_path / 'b.tum'}")
    result = compared(*files, time_unit=unit if asked else None)
    if isinstance(result, str):
        assert not asked
        assert "give --time-unit" in result
        return
    assert figures(result) == pytest.approx(expected, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("seconds", [7, 10, 60])
def test_slow_keyframes_beside_a_fast_truth_are_in_seconds(tmp_path: Path, seconds: int) -> None:
    truth = flight(1, n=1201, rate=1)
    (tmp_path / "truth.tum").write_text(tum(truth))
    keyframes = Path3D(truth.ns[::seconds], truth.poses[::seconds])
    (tmp_path / "keys.tum").write_text(tum(keyframes).replace(".000000000", ""))
    result = compare(tmp_path / "truth.tum", tmp_path / "keys.tum", align="none")
    assert len(result.results["keys"].matched) == len(keyframes.ns)
    assert float(result.table.loc["ATE: max, m", "keys"]) < 1e-9


def test_frames_pair_by_their_numbers_and_files_of_other_lengths_are_refused(tmp_path: Path) -> None:
    truth = flight(3, n=100)
    estimate = astray(truth, 3)
    write_kitti(tmp_path / "truth.txt", truth.poses)
    write_kitti(tmp_path / "whole.txt", estimate.poses)
    part = Path3D(estimate.ns[::5], estimate.poses[::5])
    write_kitti(tmp_path / "part.txt", part.poses)
    (tmp_path / "numbered.txt").write_text(rows([str(5 * k) for k in range(20)], kitti(part)))
    (tmp_path / "all.txt").write_text(frames(estimate))
    for name, t in (("times", truth.t), ("part_times", part.t)):
        (tmp_path / f"{name}.txt").write_text("\n".join(map(repr, t.tolist())))
    with pytest.raises(InputError, match=r"part\.txt: it has 20 poses and .*truth\.txt has 100; .*13 columns"):
        compare(tmp_path / "truth.txt", tmp_path / "part.txt")
    with pytest.raises(InputError, match=r"part\.txt: it has 20 poses but there are 100 time stamps"):
        compare(tmp_path / "truth.txt", tmp_path / "part.txt", times=tmp_path / "times.txt")
    by_number = compare(tmp_path / "truth.txt", f"it={tmp_path / 'numbered.txt'}")
    times = [tmp_path / "times.txt", tmp_path / "part_times.txt"]
    by_time = compare(tmp_path / "truth.txt", f"it={tmp_path / 'part.txt'}", times=times)
    rmse = "ATE: RMSE, m"
    assert by_number.table.loc[rmse, "it"] == pytest.approx(by_time.table.loc[rmse, "it"], rel=1e-12)
    whole = compare(tmp_path / "truth.txt", f"it={tmp_path / 'whole.txt'}")
    numbered = compare(tmp_path / "truth.txt", f"it={tmp_path / 'all.txt'}")
    assert numbered.table.loc[rmse, "it"] == pytest.approx(whole.table.loc[rmse, "it"], rel=1e-12)
    assert "paired (by frame;" in whole.caption


def test_up_of_a_camera_is_that_of_its_format_and_the_caption_names_it(tmp_path: Path) -> None:
    """A drive in a camera's frame, y down and z forward, whose heading drifts; and the same with z up."""
    n = 200
    turn = np.tile(se3.exp([0.0, 0.0, 1.0, 0.0, 0.02, 0.0]), (n - 1, 1, 1))
    truth = se3.compose(turn)
    drifting = se3.compose(turn @ se3.exp([0.0, 0.0, 0.0, 0.0, 1e-3, 0.0]))
    level_T_camera = np.eye(4)
    level_T_camera[:3, :3] = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
    for name, poses in (("truth", truth), ("drifting", drifting)):
        write_kitti(tmp_path / f"{name}.txt", poses)
        write_kitti(tmp_path / f"{name}_level.txt", level_T_camera @ poses @ se3.inverse(level_T_camera))
    camera = compare(tmp_path / "truth.txt", f"it={tmp_path / 'drifting.txt'}", align="yaw")
    level = compare(tmp_path / "truth_level.txt", f"it={tmp_path / 'drifting_level.txt'}", align="yaw")
    assert figures(camera)["translation.rmse"] == pytest.approx(figures(level)["translation.rmse"])
    assert "Up is (0, -1, 0) in the world frame of truth (source: KITTI's camera frame)" in camera.caption
    assert "Up is (0, 0, 1) in the world frame of truth_level (source: assumed)" in level.caption
    asked = compare(tmp_path / "truth.txt", f"it={tmp_path / 'drifting.txt'}", align="yaw", up=(0.0, 0.0, 1.0))
    assert "Up is (0, 0, 1) in the world frame of truth (source: --up)" in asked.caption
    assert figures(asked)["translation.rmse"] > 2.0 * figures(camera)["translation.rmse"]


def test_a_prism_is_compared_by_a_lever_arm_that_the_orientations_of_the_estimate_carry(tmp_path: Path) -> None:
    truth = flight(4)
    arm = np.array([0.3, -0.2, 1.1])
    prism = truth.poses[:, :3, :3] @ arm + truth.poses[:, :3, 3]
    lines = [f"{stamp} {x!r} {y!r} {z!r}" for stamp, (x, y, z) in zip(truth.stamps("s"), prism.tolist(), strict=True)]
    (tmp_path / "prism.txt").write_text("\n".join(lines))
    (tmp_path / "imu.tum").write_text(tum(truth))
    imu_T_prism = np.eye(4)
    imu_T_prism[:3, 3] = arm
    write_kitti(tmp_path / "imu_T_prism.txt", imu_T_prism[None])
    largest = "ATE: max, m"
    assert compare(tmp_path / "prism.txt", tmp_path / "imu.tum").table.loc[largest, "imu"] > 0.1
    given_arm = compare(tmp_path / "prism.txt", tmp_path / "imu.tum", lever_arm=tuple(arm.tolist()))
    as_body = compare(
        tmp_path / "prism.txt", tmp_path / "imu.tum", reference_body="camera", extrinsic=tmp_path / "imu_T_prism.txt"
    )
    for result in (given_arm, as_body):
        assert result.table.loc[largest, "imu"] < 1e-9
        assert any("moved by the lever arm (0.3, -0.2, 1.1) m" in sentence for sentence in result.verdict)
    with pytest.raises(InputError, match=r"prism\.txt: it has no orientations"):
        compare(tmp_path / "imu.tum", tmp_path / "prism.txt", lever_arm=(0.0, 0.0, 1.0))


def test_a_constant_rotation_between_the_bodies_is_reported_and_removed(tmp_path: Path) -> None:
    truth = flight(5)
    estimate = astray(truth, 5)
    turned = Path3D(estimate.ns, estimate.poses @ se3.exp([0.0, 0.0, 0.0, *(np.deg2rad(120.0) / 3**0.5 * np.ones(3))]))
    for name, path in (("truth", truth), ("same", estimate), ("turned", turned)):
        (tmp_path / f"{name}.tum").write_text(tum(path))
    reported = compare(tmp_path / "truth.tum", tmp_path / "turned.tum")
    assert any("turned: its body is turned by a constant 1" in s and "--align-body" in s for s in reported.verdict)
    removed = figures(compare(tmp_path / "truth.tum", f"it={tmp_path / 'turned.tum'}", align_body=True))
    expected = figures(compare(tmp_path / "truth.tum", f"it={tmp_path / 'same.tum'}", align_body=True))
    assert removed == pytest.approx(expected, rel=1e-3, abs=1e-4)
    alone = compare(tmp_path / "truth.tum", tmp_path / "same.tum")
    assert not any("turned by a constant" in sentence for sentence in alone.verdict)


def test_inverse_poses_and_conjugated_quaternions_are_recognized(tmp_path: Path) -> None:
    truth = flight(6, n=120)
    estimate = astray(truth, 6)
    inverse = Path3D(estimate.ns, se3.inverse(estimate.poses))
    conjugated = estimate.poses.copy()
    conjugated[:, :3, :3] = np.swapaxes(estimate.poses[:, :3, :3], 1, 2)
    for name, path in (("truth", truth), ("inverse", inverse), ("jpl", Path3D(estimate.ns, conjugated))):
        (tmp_path / f"{name}.tum").write_text("# timestamp tx ty tz qx qy qz qw\n" + tum(path))
    said = " ".join(compare(tmp_path / "truth.tum", tmp_path / "inverse.tum").verdict)
    assert "inverse: the inverses of its poses fit truth to" in said
    said = " ".join(compare(tmp_path / "truth.tum", tmp_path / "jpl.tum").verdict)
    assert "jpl: its orientations fit once transposed" in said


@pytest.mark.parametrize("order", ["xyzw", "wxyz"])
def test_inverse_poses_are_recognized_in_either_order_of_quaternions(tmp_path: Path, order: str) -> None:
    """Also of a body that turns about one axis, whose inverse in one order resembles the poses in the other."""
    t = np.arange(120) / 10.0
    poses = np.tile(np.eye(4), (120, 1, 1))
    turn = np.stack([0.1 * np.sin(t), 0.1 * np.cos(0.8 * t), 0.2 * t + np.sin(0.6 * t)], axis=1)
    poses[:, :3, :3] = so3.exp_so3(turn)
    poses[:, :3, 3] = np.stack([6.0 * np.sin(0.5 * t), 4.0 * np.cos(0.4 * t), np.sin(0.7 * t)], axis=1)
    truth = Path3D(tuple(k * 10**8 for k in range(120)), poses)
    estimate = astray(truth, 6)
    inverse = Path3D(estimate.ns, se3.inverse(estimate.poses))
    (tmp_path / "truth.tum").write_text("# timestamp tx ty tz qx qy qz qw\n" + tum(truth))
    (tmp_path / "inverse.txt").write_text(tum(inverse, order=order))
    (tmp_path / "same.txt").write_text(tum(estimate))
    rmse = figures(compare(tmp_path / "truth.tum", tmp_path / "same.txt"))["translation.rmse"]
    said = compare(tmp_path / "truth.tum", tmp_path / "inverse.txt").verdict
    assert any(f"inverse: the inverses of its poses fit truth to {rmse:.3g} m" in sentence for sentence in said)
    named = [sentence for sentence in said if "quaternions are" in sentence]
    assert named == (["inverse: its quaternions are w x y z."] if order == "wxyz" else [])


@pytest.mark.parametrize("write", ["{:.6g}".format, lambda x: repr(float(np.float32(x)))])
def test_positions_that_lost_digits_to_a_far_origin_are_reported(tmp_path: Path, write: Callable[[float], str]) -> None:
    """UTM coordinates have six digits before the point."""
    truth = flight(3, n=120)
    far = Path3D(truth.ns, truth.poses.copy())
    far.poses[:, :3, 3] += [691_000.0, 5_334_000.0, 500.0]
    (tmp_path / "truth.tum").write_text(tum(truth))
    (tmp_path / "whole.tum").write_text(tum(far))
    short = [[*map(write, map(float, row[:3])), *row[3:]] for row in far.numbers()]
    (tmp_path / "short.tum").write_text(rows(far.stamps("s"), short))
    said = " ".join(compare(tmp_path / "truth.tum", tmp_path / "short.tum").verdict)
    assert re.search(r"short: its positions have lost digits: [xy], up to .* is in steps of (1|10|0.5) m", said)
    assert "lost digits" not in " ".join(compare(tmp_path / "truth.tum", tmp_path / "whole.tum").verdict)


def test_a_file_of_one_pose_is_refused_in_a_sentence(tmp_path: Path) -> None:
    truth = flight(3)
    (tmp_path / "truth.tum").write_text(tum(truth))
    (tmp_path / "one.tum").write_text(tum(truth).splitlines()[0] + "\n")
    assert "only 1 of its poses has a partner in truth" in str(compared(tmp_path / "truth.tum", tmp_path / "one.tum"))


def test_a_straight_path_may_have_one_orientation_throughout(tmp_path: Path) -> None:
    straight = Path3D(tuple(k * 10**8 for k in range(60)), np.tile(np.eye(4), (60, 1, 1)))
    straight.poses[:, 0, 3] = np.arange(60.0)
    (tmp_path / "truth.tum").write_text(tum(straight))
    (tmp_path / "mine.tum").write_text(tum(astray(straight, 1)))
    result = compare(tmp_path / "truth.tum", tmp_path / "mine.tum")
    assert result.reference.trajectory.oriented
    assert "rotation_deg" not in result.results["mine"].notes


DAMAGED = {
    "six figures": (lambda p: rows([f"{s / 1e9:.6g}" for s in p.ns], p.numbers()), "lost digits: .* significant"),
    "float32": (
        lambda p: rows([repr(float(np.float32(s / 1e9))) for s in p.ns], p.numbers()), "lost digits: .* a float32"
    ),
    "whole seconds": (lambda p: rows([str(s // 10**9) for s in p.ns], p.numbers()), "lost digits: 60 poses share 6 "),
    "beyond 2^53": (
        lambda p: rows([str(int(float(2**60 + 100 * k))) for k in range(60)], p.numbers()), "whole numbers beyond 2.53"
    ),
    "keys of GTSAM": (
        lambda p: rows([str((ord("x") << 56) + k) for k in range(len(p.ns))], p.numbers()), r"GTSAM keys \(x0 is"
    ),
    "decimal commas": (lambda p: tum(p).replace(".", ","), "line 1: .* is written with a decimal comma"),
    "decimal commas between semicolons": (lambda p: tum(p, separator=";").replace(".", ","), "with a decimal comma"),
    "a word": (lambda p: tum(p).replace(p.numbers()[7][0], "1.2x4"), "line 8: '1.2x4' is not a finite number"),
    "a line cut short": (lambda p: tum(p)[: tum(p).rindex(" ")], "line 60: expected 8 numbers, got 7"),
    "time that runs backward": (
        lambda p: "\n".join(reversed(tum(p).splitlines())), r"line 2: the time stamp .* is not after .* \(line 1\)"
    ),
    "dates": (
        lambda p: "time,x,y,z,qx,qy,qz,qw\n" + rows(["2014-06-24T19:02:59.5"] * len(p.ns), p.numbers(), ","),
        "line 2: '2014-06-24T19:02:59.5' is a date; write time stamps in seconds",
    ),
    "numbers of frames": (
        lambda p: rows([f"{k}.0" for k in range(len(p.ns))], p.numbers()), r"counts frames \(0, 1, \.\.\.\) and has"
    ),
    "JSON": (lambda _: '{"frames": [{"transform_matrix": [[1.0, 0.0]]}]}', "it is JSON"),
    "a web page": (lambda _: "<!DOCTYPE html><html><body>404</body></html>", "it is HTML or XML"),
    "a pointer": (lambda _: "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12\n", "git lfs pull"),
    "g2o": (lambda p: "\n".join(f"VERTEX_SE3:QUAT {k} {' '.join(n)}" for k, n in enumerate(p.numbers())), "pose graph"),
    "COLMAP": (
        lambda _: "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID",
        "it is a COLMAP file",
    ),
    "a stray zero": (lambda p: tum(p).replace(p.stamps("s")[9], "0.0"), "line 10: the time stamp 0.0 is not after"),
}  # fmt: skip


@pytest.mark.parametrize("case", DAMAGED)
def test_damage_is_refused_by_its_cause(tmp_path: Path, case: str) -> None:
    write, sentence = DAMAGED[case]
    truth = flight(7, start=1_403_636_579 * 10**9)
    (tmp_path / "truth.tum").write_text(tum(truth))
    (tmp_path / "other.txt").write_text(write(truth))
    with refused(sentence, tmp_path / "other.txt"):
        compare(tmp_path / "truth.tum", tmp_path / "other.txt")


@pytest.mark.parametrize("per_meter", [1e3, 1e-3, 1e2])
@pytest.mark.parametrize("oriented", [True, False])
def test_positions_in_another_unit_than_the_references_are_reported(
    tmp_path: Path, per_meter: float, oriented: bool
) -> None:
    truth = flight(9)
    estimate = astray(truth, 9)
    scaled = estimate.poses.copy()
    scaled[:, :3, 3] *= per_meter
    numbers = Path3D(estimate.ns, scaled).numbers()
    (tmp_path / "truth.tum").write_text(tum(truth))
    (tmp_path / "same.tum").write_text(tum(estimate))
    (tmp_path / "other.txt").write_text(rows(truth.stamps("s"), numbers if oriented else [n[:3] for n in numbers]))
    said = "times as large as"
    assert any(said in sentence for sentence in compare(tmp_path / "truth.tum", tmp_path / "other.txt").verdict)
    assert not any(said in sentence for sentence in compare(tmp_path / "truth.tum", tmp_path / "same.tum").verdict)
    similar = compare(tmp_path / "truth.tum", tmp_path / "other.txt", align="sim3")
    assert not any(said in sentence for sentence in similar.verdict)


def test_one_whole_stamp_does_not_make_a_file_of_euroc(tmp_path: Path) -> None:
    """Nor does it turn the order of quaternions between commas, which has to be shown by a straight path."""
    straight = Path3D(tuple(10**9 + k * 10**8 for k in range(60)), np.tile(np.eye(4), (60, 1, 1)))
    straight.poses[:, 0, 3] = np.arange(60.0)
    (tmp_path / "a.tum").write_text(tum(straight, separator=","))
    read = read_trajectory(tmp_path / "a.tum")
    np.testing.assert_array_equal(read.rotation, straight.poses[:, :3, :3])


def test_an_npz_in_nanoseconds_is_the_same_trajectory(tmp_path: Path) -> None:
    truth = flight(8, start=1_403_636_579 * 10**9)
    write_trajectory_npz(tmp_path / "truth.npz", truth.t, truth.poses)
    np.savez(tmp_path / "ns.npz", t=np.array(truth.ns), world_T_body=truth.poses)
    result = compare(tmp_path / "truth.npz", tmp_path / "ns.npz", align="none")
    assert result.table.loc["ATE: max, m", "ns"] < 1e-9
    assert any("divided by 1,000,000,000" in sentence for sentence in result.verdict)


def straight(path: Path3D, w_first: bool) -> str:
    """TUM lines without a header, the quaternion in either order."""
    split = [line.split() for line in tum(path).splitlines()]
    return "\n".join(" ".join([*row[:4], row[7], *row[4:7]] if w_first else row) for row in split) + "\n"


@pytest.mark.parametrize("w_first", [False, True])
def test_an_order_of_quaternions_that_a_straight_path_does_not_show_is_in_doubt(tmp_path: Path, w_first: bool) -> None:
    random = np.random.default_rng(5)
    ahead = np.tile([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], (119, 1))
    start = se3.exp([0.0, 0.0, 0.0, 0.3, -0.2, 0.4])
    truth = Path3D(tuple(k * 10**8 for k in range(120)), se3.compose(se3.exp(ahead), start))
    wander = np.cumsum(random.normal(size=(120, 6)) * np.repeat([2e-3, 3e-3], 3), axis=0)
    estimate = Path3D(truth.ns, truth.poses @ se3.exp(wander))
    (tmp_path / "a.tum").write_text("# timestamp [s] tx ty tz qx qy qz qw\n" + tum(truth))
    (tmp_path / "b.tum").write_text(straight(estimate, w_first))
    files = (tmp_path / "a.tum", tmp_path / "b.tum")
    said = "x y z w is assumed; --quaternion settles it"
    settled = compare(*files, quaternion="wxyz" if w_first else "xyzw")
    assert not any(said in sentence for sentence in settled.verdict)
    unsettled = compare(*files)
    assert any(said in sentence for sentence in unsettled.verdict) or figures(unsettled) == figures(settled)


@pytest.mark.parametrize("seed", range(5))
def test_matrices_with_stamps_are_not_those_of_a_kitti_camera(tmp_path: Path, seed: int) -> None:
    """Whatever the motion: a reference in a file without a convention has its up assumed."""
    truth = flight(seed, rate=20, start=0)
    (tmp_path / "stamped.csv").write_bytes(VARIANTS["stamps before matrices"].write(truth))
    (tmp_path / "estimate.tum").write_text(tum(astray(truth, seed)))
    found = compare(tmp_path / "stamped.csv", tmp_path / "estimate.tum")
    assert (found.up.tolist(), found.up_from) == ([0.0, 0.0, 1.0], "assumed")
