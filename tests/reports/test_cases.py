"""Trajectories as people bring them: each situation gives the number that other tools give, or names its cause."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline.compare import associate
from fgbaseline.data.formats import read_trajectory
from fgbaseline.geometry import InputError
from fgbaseline.reports.comparison import ComparisonReport, compare

from ..builders.commands import fgbaseline
from ..conftest import RECORDINGS

RMSE = "translation.rmse"
ROTATION = "rotation_deg.rmse"
SECOND = "relative.1 s.translation.rmse"
SEGMENTS = "segments.intervals"

RIGHT: dict[str, tuple[tuple[str, ...], dict[str, Any], dict[str, float]]] = {
    "01-tum-fr2-desk": (("gt.txt", "est.txt"), {}, {RMSE: 0.005771, ROTATION: 1.1334}),
    "03-orbslam3-ns": (("gt.csv", "f_mono.txt"), {}, {SECOND: 0.0576}),
    "03-orbslam3-ns, both": (("gt_ns.txt", "f_mono.txt"), {}, {SECOND: 0.0576, "drift.translation per second": 0.0153}),
    "05-vins-fusion": (("gt.csv", "vio.csv"), {}, {SECOND: 0.0576, ROTATION: 1.25}),
    "05-vins-fusion, 8 fields": (("gt.csv", "vio8.csv"), {}, {SECOND: 0.0576, ROTATION: 1.25}),
    "05-vins-fusion, no comma": (("gt.csv", "vio_notrail.csv"), {}, {SECOND: 0.0576, ROTATION: 1.25}),
    "06-okvis2": (("gt.csv", "okvis2.csv"), {}, {SECOND: 0.0576, ROTATION: 1.25}),
    "06-okvis2, hash": (("gt.csv", "okvis2_hash.csv"), {}, {SECOND: 0.0576, ROTATION: 1.25}),
    "06-okvis2, no header": (("gt.csv", "okvis2_nohead.csv"), {}, {SECOND: 0.0576, ROTATION: 1.25}),
    "07-openvins-cov": (("gt.txt", "est.txt"), {}, {SECOND: 0.0576}),
    "08-kitti-13-columns": (
        ("gt.txt", "est13.txt"),
        {"align": "sim3"},
        {RMSE: 6.630, f"{SEGMENTS}.translation_percent": 3.331, f"{SEGMENTS}.rotation_deg_per_m": 0.00307},
    ),
    "09-kitti-up": (
        ("gt.txt", "est.txt"), {"align": "yaw", "times": "times.txt"}, {RMSE: 7.10, "shares.intervals.heading": 0.94}
    ),
    "11-position-only, columns": (("gt_4col.txt", "est.tum"), {}, {RMSE: 0.207}),
    "11-position-only, zero": (("gt_zeroq.txt", "est.tum"), {}, {RMSE: 0.207}),
    "11-position-only, identity": (("gt_idq.txt", "est.tum"), {}, {RMSE: 0.207}),
    "11-position-only, leica": (("leica0.csv", "est.tum"), {}, {RMSE: 0.207}),
    "14-body-rotation": (("gt.tum", "est.tum"), {"align": "yaw", "align_body": True}, {SECOND: 0.0579}),
    "29-hilti-prism": (
        ("prism.txt", "imu_perfect.txt"), {"reference_body": "camera", "extrinsic": "imu_T_prism.txt"}, {RMSE: 0.0}
    ),
    "29-hilti-prism, arm": (("prism.txt", "imu_perfect.txt"), {"lever_arm": (-0.006, 0.012, -0.273)}, {RMSE: 0.0}),
    "32-nan-and-utf16, NaN": (("gt.tum", "nan.tum"), {}, {"pairing.pairs": 189.0}),
    "32-nan-and-utf16, UTF-16": (("gt.tum", "utf16.tum"), {}, {"pairing.pairs": 199.0}),
    "32-nan-and-utf16, blanks": (("gt.tum", "dso_double_space.tum"), {}, {"pairing.pairs": 199.0}),
}  # fmt: skip
"""files, options and what other tools find"""

SAID: dict[str, tuple[tuple[str, ...], str]] = {
    "01-tum-fr2-desk": (("gt.txt", "est.txt"), "gt: 1 of 4,500 lines repeats the time stamp before"),
    "03-orbslam3-ns": (("gt.csv", "f_mono.txt"), "f_mono: its time stamps are in nanoseconds and"),
    "06-okvis2": (
        ("gt.csv", "okvis2_nohead.csv"),
        "its quaternions are read as x y z w: the median misfit",
    ),
    "11-position-only": (("gt_idq.txt", "est.tum"), "gt_idq: all its orientations are the same"),
    "14-body-rotation": (("gt.tum", "est.tum"), "est: its body is turned by a constant 119.9°"),
    "14-body-rotation, JPL": (("gt.tum", "est_jpl.tum"), "its quaternions are conjugated, as in JPL's convention"),
    "26-inverse-poses": (("gt.tum", "tcw.tum"), "the inverses of its poses fit gt to 0.207 m"),
    "32-nan-and-utf16": (("gt.tum", "nan.tum"), "nan: 10 of 199 lines have NaN in place of a pose and are left out"),
}

REFUSED: dict[str, tuple[tuple[str, ...], str]] = {
    "08-kitti-13-columns": (("gt.txt", "est12.txt"), r"est12\.txt: it has 1,197 poses and .*gt\.txt has 1,201"),
    "10-kitti-lengths": (("gt.txt", "kf.txt"), r"kf\.txt: it has 455 poses and .*gt\.txt has 4,541"),
    "15-stamps-cut": (("gt.tum", "est.txt"), r"est\.txt: its time stamps have lost digits: .* 6 significant figures"),
    "18-decimal-comma": (("gt.tum", "est.txt"), r"est\.txt: line 1: .* is written with a decimal comma"),
    "20-gtsam-keys": (("gt.tum", "poses.txt"), r"poses\.txt: its first column has GTSAM keys .* beyond 2\^53"),
}

Recordings = Callable[[str], Path]


def compared(recordings: Recordings, folder: str, files: tuple[str, ...], options: dict[str, Any]) -> ComparisonReport:
    places = {name: recordings(f"{folder}/{name}") for name in files}
    chosen = {
        key: recordings(f"{folder}/{value}") if key in ("times", "extrinsic") else value
        for key, value in options.items()
    }
    return compare(*places.values(), **chosen)


def value_of(comparison: ComparisonReport, metric: str, row: int = 0) -> float:
    return float(comparison.metrics.set_index("metric")["value"].loc[[metric]].iloc[row])


@pytest.mark.parametrize("case", RIGHT)
def test_a_situation_gives_the_values_of_other_tools(recordings: Recordings, case: str) -> None:
    files, options, right = RIGHT[case]
    result = compared(recordings, f"cases/{case.partition(',')[0]}", files, options)
    for metric, value in right.items():
        assert value_of(result, metric) == pytest.approx(value, rel=5e-3, abs=1e-6), metric


@pytest.mark.parametrize("case", SAID)
def test_detected_conventions_are_reported(recordings: Recordings, case: str) -> None:
    files, sentence = SAID[case]
    result = compared(recordings, f"cases/{case.partition(',')[0]}", files, {})
    assert any(sentence in said for said in result.verdict), result.verdict


@pytest.mark.parametrize("case", REFUSED)
def test_incomparable_trajectories_are_refused_with_the_cause(recordings: Recordings, case: str) -> None:
    files, sentence = REFUSED[case]
    with pytest.raises(InputError, match=sentence):
        compared(recordings, f"cases/{case}", files, {})


def test_covariances_behind_the_poses_are_used(recordings: Recordings) -> None:
    result = compared(recordings, "cases/07-openvins-cov", ("gt.txt", "est.txt"), {})
    covariance = result.results["est"].entry.covariance
    assert covariance is not None
    assert covariance[0].diagonal() == pytest.approx([0.01] * 3 + [1e-4] * 3)


def test_positions_without_orientations_are_no_truth_of_a_run(recordings: Recordings, tmp_path: Path) -> None:
    place = recordings("cases/49-truth-one-frame/drive.npz").parent
    arguments = ["--truth", place / "truth_ns.tum", "--truth-frame", "imu", "--out", tmp_path / "run"]
    ended = fgbaseline("run", place / "drive.npz", *arguments, cwd=tmp_path, drawing=False)
    assert ended.returncode == 2
    assert "positions without orientations" in ended.stderr
    limits = place / "limits.toml"
    assert fgbaseline("check", tmp_path / "run", "--limits", limits, cwd=tmp_path).returncode == 2


PUBLISHED: dict[str, tuple[str, tuple[str, ...], list[str], list[float], float]] = {
    "VINS and PL-VIO on EuRoC MH_05": (
        "euroc_MH_05",
        ("MH_05_difficult.csv", "vins-mono.csv", "vins-fusion.csv", "pl-vio.txt", "pls-vio.csv"),
        [],
        [0.302, 0.200, 0.286, 0.190],
        5e-4,
    ),
    "ORB-SLAM2 on KITTI 00": ("kitti_00", ("KITTI_00_gt.txt", "KITTI_00_ORB.txt"), [], [1.3034], 5e-5),
    "ORB-SLAM3 on TUM-VI room4": (
        "orbslam3_native", ("room4_data.csv", "room4_f_dataset-room4_512_mono.txt"), ["--align", "sim3"], [0.080], 5e-4
    ),
}  # fmt: skip
"""folder, files, options, and the published RMSE of each estimate, to its last digit"""


@pytest.mark.parametrize("paper", PUBLISHED)
def test_published_files_give_published_numbers_in_one_command(
    recordings: Recordings, tmp_path: Path, paper: str
) -> None:
    folder, files, options, published, digit = PUBLISHED[paper]
    for name in files:
        recordings(f"trajectories/{folder}/{name}")
    place = RECORDINGS / "trajectories" / folder
    out = ["--out", str(tmp_path / "out")]
    ended = fgbaseline("compare", *files, *options, *out, cwd=place, drawing=False)
    assert ended.returncode == 0, ended.stderr
    estimates = json.loads((tmp_path / "out" / "comparison.json").read_text())["estimates"]
    found = [each["translation"]["rmse"]["value"] for each in estimates.values()]
    assert found == pytest.approx(published, abs=digit)


def test_orb_slam3_writes_the_orientations_of_its_keyframes_transposed(recordings: Recordings) -> None:
    place = "trajectories/orbslam3_native"
    files = (recordings(f"{place}/room4_{kind}_dataset-room4_512_mono.txt") for kind in ("f", "kf"))
    frames, keyframes = map(read_trajectory, files)
    pairs = associate(frames, keyframes)
    assert len(pairs) > 100
    moved = np.linalg.norm(pairs.reference.position - pairs.estimate.position, axis=1)
    same = moved < 1e-5
    assert same.any()
    transposed = np.swapaxes(pairs.estimate.rotation, 1, 2)
    np.testing.assert_allclose(transposed[same], pairs.reference.rotation[same], atol=1e-6)
    result = compare(recordings(f"{place}/room4_data.csv"), keyframes, align="sim3")
    assert any("its orientations fit once transposed" in sentence for sentence in result.verdict)
