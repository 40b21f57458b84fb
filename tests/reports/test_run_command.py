"""`fgbaseline run` as its user meets it: the folder it leaves, its exit codes, its progress, and being interrupted."""

import csv
import json
import os
import pty
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.geometry import InputError
from fgbaseline.reports.problem.construction import build_problem, read_sequence
from fgbaseline.reports.problem.settings import RunSettings
from fgbaseline.reports.results.run import summarize
from fgbaseline.reports.run.estimation import solve
from fgbaseline.reports.run.folder import write_run

from ..builders.commands import COMMAND, environment, everything_in, fgbaseline, heeding_interrupts, started

ESTIMATORS = ("dead-reckoning", "ekf", "isam2")


@dataclass(frozen=True)
class Finished:
    """A run of the command, and where."""

    folder: Path
    result: subprocess.CompletedProcess[str]

    @property
    def out(self) -> Path:
        return self.folder / "out"

    @property
    def summary(self) -> Any:
        def refuse(constant: str) -> None:
            raise AssertionError(f"{constant} is not JSON")

        return json.loads((self.out / "summary.json").read_text(encoding="utf-8"), parse_constant=refuse)


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight seconds of a simulated drive."""
    folder = tmp_path_factory.mktemp("recording")
    result = fgbaseline(
        "simulate", "drive.npz", *["--duration", "8", "--features-per-frame", "25", "--seed", "4"], cwd=folder
    )
    assert result.returncode == 0, result.stderr
    assert "drive.npz: 80 frames" in result.stdout
    return folder / "drive.npz"


@pytest.fixture(scope="session")
def finished(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """A run on it that went well."""
    folder = tmp_path_factory.mktemp("finished")
    asked = ("--out", "out", "--estimators", ",".join(ESTIMATORS))
    return Finished(folder, fgbaseline("run", recording, *asked, cwd=folder, drawing=False))


def rows(path: Path) -> Iterator[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        yield from csv.DictReader(file)


def test_the_command_exits_zero_and_prints_the_place_of_the_report(finished: Finished) -> None:
    assert finished.result.returncode == 0, finished.result.stderr
    assert finished.result.stdout.rstrip().endswith("The report is in out/report.html")
    assert all(name in finished.result.stdout for name in ESTIMATORS)


def test_the_folder_holds_the_documented_files_and_nothing_else(finished: Finished) -> None:
    figures = {path.stem for path in (finished.out / "figures").iterdir()}
    assert len(figures) >= 6
    expected = {"summary.json", "metrics.csv", "report.html", "truth.tum", "table.csv", "table.md", "table.tex"}
    expected |= {"trajectories", "landmarks", "series", "figures"}
    expected |= {f"trajectories/{name}.tum" for name in ESTIMATORS}
    expected |= {f"landmarks/{name}.csv" for name in ESTIMATORS}
    expected |= {f"series/{name}.csv" for name in ESTIMATORS}
    expected |= {
        "tables",
        *(f"tables/{name}.csv" for name in ("map_by_depth", "moved_points", "reprojection_classes", "trust")),
    }
    expected |= {f"figures/{name}.{kind}" for name in figures for kind in ("png", "svg")}
    assert everything_in(finished.out) == expected
    assert everything_in(finished.folder) == {"out", *(f"out/{name}" for name in expected)}
    assert all(path.stat().st_size > 0 for path in finished.out.rglob("*") if path.is_file())


def test_the_summary_is_strict_json_and_names_what_was_asked(finished: Finished, recording: Path) -> None:
    summary = finished.summary
    assert list(summary["estimators"]) == list(ESTIMATORS)
    assert all(e["status"] == "ok" for e in summary["estimators"].values())
    assert summary["reference"]["name"] == "isam2"
    assert summary["settings"]["sequence"] == str(recording)
    assert summary["sequence"]["frames"] == 80
    assert summary["estimators"]["isam2"]["ate"]["rmse"] < summary["estimators"]["dead-reckoning"]["ate"]["rmse"]


def test_metrics_csv_holds_the_numbers_of_the_summary(finished: Finished) -> None:
    for row in rows(finished.out / "metrics.csv"):
        value = finished.summary["estimators"][row["estimator"]]
        for key in row["metric"].split("."):
            value = value[key]
        assert (None if row["value"] == "" else float(row["value"])) == value


@pytest.mark.parametrize("name", ESTIMATORS)
def test_trajectories_and_landmarks_give_the_series_again(finished: Finished, recording: Path, name: str) -> None:
    sequence = data.read(recording)
    t, poses = data.read_tum(finished.out / "trajectories" / f"{name}.tum")
    np.testing.assert_array_equal(t, sequence.t)
    _, reference = data.read_tum(finished.out / "trajectories" / "isam2.tum")
    series = list(rows(finished.out / "series" / f"{name}.csv"))
    distance = np.linalg.norm(poses[:, :3, 3] - reference[:, :3, 3], axis=1)
    np.testing.assert_array_equal([float(row["t"]) for row in series], sequence.t)
    np.testing.assert_allclose([float(row["divergence_position"]) for row in series], distance, atol=1e-8)
    assert sequence.truth is not None
    error = np.linalg.norm(poses[:, :3, 3] - sequence.truth.world_T_imu[:, :3, 3], axis=1)
    np.testing.assert_allclose([float(row["truth_position"]) for row in series], error, atol=1e-8)

    landmarks = list(rows(finished.out / "landmarks" / f"{name}.csv"))
    e = finished.summary["estimators"][name]
    assert len(landmarks) == e["landmarks"]
    assert sum(int(row["n_used"]) for row in landmarks) == e["observations"]["used"]
    seen = np.flatnonzero(sequence.observations.landmark == int(landmarks[0]["id"]))
    first = sequence.observations.select(seen[:1])
    position = [float(landmarks[0][axis]) for axis in "xyz"]
    camera = np.linalg.inv(poses[first.frame[0]] @ sequence.imu_T_cam) @ [*position, 1.0]
    assert camera[2] > 0
    np.testing.assert_allclose(sequence.camera.project(camera[:3]), first.pixel[0], atol=100.0)


def test_elsewhere_than_on_a_terminal_progress_is_plain_lines(finished: Finished) -> None:
    lines = finished.result.stderr.splitlines()
    assert lines[0].startswith("drive: 80 frames, ")
    assert [line for line in lines if line.endswith(": started")] == [f"{name}: started" for name in ESTIMATORS]
    assert len([line for line in lines if ": finished after " in line]) == len(ESTIMATORS)
    assert lines[-1] == "writing the report"
    assert "\x1b" not in finished.result.stderr + finished.result.stdout
    assert "\r" not in finished.result.stderr


@pytest.fixture
def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures and page cost more than all the rest."""
    monkeypatch.setattr("fgbaseline.reports.figures.draw", lambda *_: {})
    monkeypatch.setattr("fgbaseline.reports.run.folder.render", lambda *_: "")


@pytest.mark.usefixtures("without_figures")
def test_the_same_run_from_python_gives_the_same_tables(finished: Finished, recording: Path, tmp_path: Path) -> None:
    settings = RunSettings(sequence=recording, estimators=ESTIMATORS)
    run = solve(build_problem(read_sequence(settings), settings), settings)
    write_run(run, tmp_path)
    for name in sorted(everything_in(finished.out)):
        if name.startswith(("trajectories/", "landmarks/")) and "." in name:
            assert (tmp_path / name).read_bytes() == (finished.out / name).read_bytes(), name
        if name.startswith("series/"):
            there, here = (
                [{key: value for key, value in row.items() if key != "seconds"} for row in rows(folder / name)]
                for folder in (finished.out, tmp_path)
            )
            assert here == there, name
    there, here = (
        [row for row in rows(folder / "metrics.csv") if row["metric"] not in ("seconds", "frames_per_second")]
        for folder in (finished.out, tmp_path)
    )
    assert here == there
    summaries = [json.loads((folder / "summary.json").read_text()) for folder in (finished.out, tmp_path)]
    for key in ("schema", "sequence", "problem", "reference", "settings", "versions", "machine"):
        assert summaries[0][key] == summaries[1][key]


@pytest.fixture
def imu_only(recording: Path, tmp_path: Path) -> Path:
    """The recording without its features."""
    with np.load(recording) as file:
        np.savez(
            tmp_path / "imu.npz", **{name: file[name] for name in file.files if name not in ("features", "landmarks")}
        )
    return tmp_path / "imu.npz"


def test_without_features_the_path_is_reported_and_the_others_fail(imu_only: Path, tmp_path: Path) -> None:
    result = fgbaseline("run", imu_only, "--out", "out", cwd=tmp_path, drawing=False)
    assert result.returncode == 1, result.stderr
    estimators = Finished(tmp_path, result).summary["estimators"]
    assert {name: e["status"] for name, e in estimators.items()} == {
        "dead-reckoning": "ok",
        "ekf": "failed",
        "isam2": "failed",
        "isam2-online": "failed",
    }
    assert all(e["reason"] == "no observations" for e in estimators.values() if e["status"] == "failed")
    assert "isam2 failed: no observations" in result.stderr
    assert (tmp_path / "out" / "report.html").is_file()
    assert {path.name for path in (tmp_path / "out" / "trajectories").iterdir()} == {"dead-reckoning.tum"}
    assert {path.name for path in (tmp_path / "out" / "series").iterdir()} == {f"{name}.csv" for name in estimators}


def test_truth_that_ends_early_is_counted(recording: Path, tmp_path: Path) -> None:
    sequence = data.read(recording)
    assert sequence.truth is not None
    np.savetxt(tmp_path / "kitti.txt", sequence.truth.world_T_imu[:70, :3].reshape(70, 12))
    settings = RunSettings(
        sequence=recording, estimators=("dead-reckoning",), truth=tmp_path / "kitti.txt", truth_frame="imu"
    )
    run = solve(build_problem(read_sequence(settings), settings), settings)
    e = summarize(run).estimators["dead-reckoning"]
    assert e.truth is not None
    assert (e.truth.frames, e.truth.missing) == (70, 10)
    assert e.ate_unaligned is not None
    assert e.ate_unaligned.final is None
    assert e.notes["ate_unaligned.final"] == "the last frame has no ground truth"


def test_the_stated_up_of_the_truth_is_kept_and_no_direction_is_refused(recording: Path) -> None:
    truth = read_sequence(RunSettings(sequence=recording, truth_up=(0.0, 0.0, 2.0))).truth
    assert truth is not None
    np.testing.assert_allclose(truth.up, [0.0, 0.0, 1.0])
    with pytest.raises(InputError, match="truth-up: 0,0,0 is not a direction"):
        read_sequence(RunSettings(sequence=recording, truth_up=(0.0, 0.0, 0.0)))
    without = data.read(recording).with_truth(None)
    with pytest.raises(InputError, match="truth-up: 0,0,1 is given without a ground truth; add --truth FILE"):
        read_sequence(RunSettings(sequence=without, truth_up=(0.0, 0.0, 1.0)))


OUTSIDE = """
from fgbaseline import ekf


def straight_on(problem, progress=None):
    return ekf.dead_reckoning(problem, progress)


def crashing(problem, progress=None):
    return {}["no such key"]
"""
ENTRY_POINTS = """[fgbaseline.estimators]
straight-on = outside_filters:straight_on
crashing = outside_filters:crashing
vanished = a_module_that_is_gone:solve
"""


def test_user_estimators_are_compared_and_their_crashes_stop_no_other_estimator(
    recording: Path, tmp_path: Path
) -> None:
    site = tmp_path / "site"
    described = site / "outside_filters-1.0.dist-info"
    described.mkdir(parents=True)
    (site / "outside_filters.py").write_text(OUTSIDE)
    (described / "METADATA").write_text("Metadata-Version: 2.1\nName: outside-filters\nVersion: 1.0\n")
    (described / "entry_points.txt").write_text(ENTRY_POINTS)
    names = "crashing,vanished,straight-on"
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").write_text("{}")
    (tmp_path / "out" / "old.txt").write_text("of an earlier run, which --force replaces whole")
    result = fgbaseline(
        *("run", recording, "--out", "out", "--force", "--estimators", names),
        cwd=tmp_path,
        drawing=False,
        first=lambda: sys.path.insert(0, str(site)),
    )
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
    estimators = Finished(tmp_path, result).summary["estimators"]
    assert list(estimators) == names.split(",")
    assert estimators["straight-on"]["status"] == "ok"
    assert estimators["crashing"]["status"] == estimators["vanished"]["status"] == "failed"
    assert "KeyError" in estimators["crashing"]["reason"]
    assert "outside_filters.py, line 10" in estimators["crashing"]["reason"]
    assert "a_module_that_is_gone" in estimators["vanished"]["reason"]
    assert "straight-on" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "trajectories" / "straight-on.tum").is_file()
    assert not (tmp_path / "out" / "old.txt").exists()
    assert {path.name for path in tmp_path.iterdir()} == {"site", "out"}


@pytest.mark.parametrize(
    ("number", "line", "before"),
    [
        (signal.SIGINT, "isam2: started", "nothing"),
        (signal.SIGTERM, "isam2: started", "an earlier run"),
        (signal.SIGTERM, "writing the report", "nothing"),
        (signal.SIGINT, "writing the report", "an earlier run"),
    ],
)
def test_an_interruption_keeps_earlier_files_and_leaves_no_partial_ones(
    recording: Path, tmp_path: Path, number: signal.Signals, line: str, before: str
) -> None:
    if before == "an earlier run":
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "summary.json").write_text("{}")
    there = everything_in(tmp_path)
    run = started("run", recording, "--out", "out", "--force", "--estimators", "dead-reckoning,isam2", cwd=tmp_path)
    assert run.stderr is not None
    printed = iter(run.stderr)
    assert any(read.strip() == line for read in printed)
    run.send_signal(number)
    _, rest = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "interrupted" in rest
    assert "Traceback" not in rest
    assert everything_in(tmp_path) == there


def test_on_a_terminal_progress_is_a_bar_with_frames_per_second(recording: Path, tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [COMMAND, "run", recording, "--out", "out", "--estimators", "dead-reckoning,isam2"],
        cwd=tmp_path,
        env=environment(TERM="xterm", COLUMNS="120"),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=theirs,
        preexec_fn=heeding_interrupts,
    )
    os.close(theirs)
    text = ""
    while "writing the report" not in text:
        text += os.read(ours, 65536).decode(errors="replace")
    process.send_signal(signal.SIGINT)  # what follows is the business of other tests
    assert process.wait(timeout=60) == 130
    os.close(ours)
    assert "\x1b[" in text
    assert "80/80" in text
    assert "frames/s" in text
    assert "isam2" in text
    assert "started" not in text
