"""Bad input is one sentence on standard error, exit code 2, and leaves nothing behind."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data

from ..builders.commands import everything_in, fgbaseline
from ..builders.synthetic import drive


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a good recording and much that is not one."""
    sequence = drive()
    assert sequence.truth is not None
    data.write_npz(sequence, tmp_path / "drive.npz")
    data.write_tum(tmp_path / "truth.tum", sequence.t, sequence.truth.world_T_imu)
    (tmp_path / "kitti_long.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 1000)
    (tmp_path / "text.npz").write_text("this is not a recording\n")
    (tmp_path / "empty.npz").write_bytes(b"")
    whole = (tmp_path / "drive.npz").read_bytes()
    (tmp_path / "truncated.npz").write_bytes(whole[: len(whole) // 2])
    np.savez(tmp_path / "poor.npz", time_stamps=np.arange(4.0)[None, :])
    (tmp_path / "recordings").mkdir()
    (tmp_path / "ours").mkdir()
    (tmp_path / "ours" / "summary.json").write_text("{}")
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "thesis.tex").write_text("years of work")
    return tmp_path


@dataclass(frozen=True)
class Bad:
    """A command line and what its sentence must name."""

    line: str
    names: tuple[str, ...]


RUN = [
    Bad("run missing.npz --out out", ("missing.npz", "no such file")),
    Bad("run recordings --out out", ("recordings", "folder")),
    Bad("run text.npz --out out", ("text.npz", "text file")),
    Bad("run empty.npz --out out", ("empty.npz", "empty")),
    Bad("run truncated.npz --out out", ("truncated.npz",)),
    Bad("run poor.npz --out out", ("poor.npz", "linear_velocity")),
    Bad("run drive.npz --out out --estimators kalman", ("'kalman'", "installed are", "isam2")),
    Bad("run drive.npz --out out --estimators ekf,isam2,ekf", ("'ekf'", "twice")),
    Bad("run drive.npz --out out --estimators ,", ("name at least one",)),
    Bad("run drive.npz --out out --features 0", ("--features", "'0'", "at least 1")),
    Bad("run drive.npz --out out --features -3", ("--features", "'-3'")),
    Bad("run drive.npz --out out --features abc", ("--features", "'abc'", "'all'")),
    Bad("run drive.npz --out out --features 2.5", ("--features", "'2.5'")),
    Bad("run drive.npz --out out --preset best", ("--preset", "best", "calibrated")),
    Bad("run drive.npz --out out --landmarks both", ("--landmarks", "both")),
    Bad("run drive.npz --out out --seed -1", ("--seed", "-1")),
    Bad("run drive.npz --out out --truth truth.tum", ("truth.tum", "--truth-frame")),
    Bad("run drive.npz --out out --truth truth.tum --truth-frame lidar", ("--truth-frame", "lidar")),
    Bad("run drive.npz --out out --truth-frame camera", ("truth-frame", "--truth")),
    Bad("run drive.npz --out out --truth missing.txt --truth-frame imu", ("missing.txt", "no such file")),
    Bad("run drive.npz --out out --truth text.npz --truth-frame imu", ("text.npz", "line 1")),
    Bad("run drive.npz --out out --truth kitti_long.txt --truth-frame imu", ("kitti_long.txt", "1000 lines")),
    Bad("run --out out --truth truth.tum --truth-frame imu", ("truth", "RECORDING")),
    Bad("run drive.npz --out ours", ("ours", "--force")),
    Bad("run drive.npz --out theirs --force", ("theirs", "summary.json")),
    Bad("run drive.npz --out text.npz --force", ("text.npz", "not a folder")),
    Bad("run drive.npz --out text.npz/below", ("text.npz", "not a folder")),
    Bad(f"run drive.npz --out {'x' * 300}", ("xxx", "cannot be written")),
    Bad("run drive.npz other.npz --out out", ("other.npz", "run --help")),
    Bad("run drive.npz --output out", ("--output", "run --help")),
    Bad("walk drive.npz", ("'walk'", "--help")),
]
SIMULATE = [
    Bad("simulate", ("OUTPUT", "simulate --help")),
    Bad("simulate new", ("new", ".npz")),
    Bad("simulate new.csv", ("new.csv", ".npz")),
    Bad("simulate drive.npz", ("drive.npz", "--force")),
    Bad("simulate recordings --force", ("recordings",)),
    Bad("simulate missing/new.npz --duration 2", ("missing/new.npz",)),
    Bad("simulate text.npz/new.npz --duration 2", ("text.npz/new.npz",)),
    Bad("simulate new.npz --burst 1:2", ("--burst", "START:END:SHARE", "'1:2'")),
    Bad("simulate new.npz --burst a:b:c", ("--burst", "'a:b:c'")),
    Bad("simulate new.npz --burst 2:1:0.5", ("burst", "start before the end")),
    Bad("simulate new.npz --burst 1:2:1.5", ("burst", "1.5")),
    Bad("simulate new.npz --burst nan:2:0.5", ("burst", "nan")),
    Bad("simulate new.npz --blackout 3", ("--blackout", "START:END")),
    Bad("simulate new.npz --duration -1", ("duration", "-1")),
    Bad("simulate new.npz --duration nan", ("duration", "nan")),
    Bad("simulate new.npz --duration 0.1", ("duration", "1 frames")),
    Bad("simulate new.npz --wrong-share 2", ("wrong_share", "2")),
    Bad("simulate new.npz --gyro-bias 1 2", ("--gyro-bias",)),
    Bad("simulate new.npz --angular-axes x,x,z", ("angular_axes", "x,x,z")),
    Bad("simulate new.npz --path mountain", ("--path", "mountain")),
    Bad("simulate new.npz --path along", ("along",)),
    Bad("simulate new.npz --along missing.npz", ("missing.npz", "no such file")),
    Bad("simulate new.npz --path town --along drive.npz", ("path", "along")),
    Bad("simulate new.npz --seed -4", ("seed", "-4")),
]


def identity(bad: Bad) -> str:
    return bad.line.replace("/", "|")[:60]


@pytest.mark.parametrize("bad", RUN + SIMULATE, ids=identity)
def test_the_fault_is_one_sentence_and_nothing_is_written(bad: Bad, folder: Path) -> None:
    before = {name: (folder / name).stat().st_mtime_ns for name in everything_in(folder)}
    result = fgbaseline(*bad.line.split(), cwd=folder)
    assert result.returncode == 2
    sentences = result.stderr.strip().splitlines()
    assert len(sentences) == 1, result.stderr
    assert sentences[0].startswith("fgbaseline: ")
    assert all(name in sentences[0] for name in bad.names), sentences[0]
    assert "Error" not in result.stderr
    assert result.stdout == ""
    assert {name: (folder / name).stat().st_mtime_ns for name in everything_in(folder)} == before


def a_null(arrays: dict[str, np.ndarray]) -> None:
    arrays["linear_velocity"][1, 3] = np.nan


def falling_stamps(arrays: dict[str, np.ndarray]) -> None:
    arrays["time_stamps"][0, 5] = arrays["time_stamps"][0, 3]


def no_rotation(arrays: dict[str, np.ndarray]) -> None:
    arrays["imu_T_cam"][0, 0] += 1e-4


def a_pickle(arrays: dict[str, np.ndarray]) -> None:
    arrays["K"] = np.array([{"fu": 1}], dtype=object)


@pytest.mark.parametrize(
    ("spoil", "field"),
    [(a_null, "linear_velocity"), (falling_stamps, "time_stamps"), (no_rotation, "imu_T_cam"), (a_pickle, "K")],
)
def test_a_corrupted_recording_is_refused_with_its_field(
    spoil: Callable[[dict[str, np.ndarray]], None], field: str, folder: Path
) -> None:
    with np.load(folder / "drive.npz") as file:
        arrays = {name: file[name] for name in file.files}
    spoil(arrays)
    np.savez(folder / "spoilt.npz", **arrays)
    result = fgbaseline("run", "spoilt.npz", "--out", "out", cwd=folder)
    assert result.returncode == 2
    assert len(result.stderr.strip().splitlines()) == 1
    assert f"spoilt.npz: {field}" in result.stderr
    assert not (folder / "out").exists()
