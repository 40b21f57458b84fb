"""`fgbaseline compare` as its users start it: against files, against a run, and with what is wrong."""

import json
import signal
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fgbaseline import data
from fgbaseline.geometry import se3
from fgbaseline.reports.cli import main
from fgbaseline.reports.comparison import compare

from ..builders.commands import everything_in, fgbaseline
from ..builders.synthetic import drive


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording, a run on it, its problem, and a filter's answer from elsewhere (a copy of the run's)."""
    folder = tmp_path_factory.mktemp("made")
    sequence = drive(features_per_frame=20.0)
    assert sequence.truth is not None
    data.write_npz(sequence, folder / "drive.npz")
    data.write_tum(folder / "truth.tum", sequence.t, sequence.truth.world_T_imu)
    run = fgbaseline(
        "run", "drive.npz", "--estimators", "dead-reckoning,ekf", "--out", "run", cwd=folder, drawing=False
    )
    assert run.returncode == 0, run.stderr
    assert fgbaseline("export", "drive.npz", "--out", "problem", cwd=folder).returncode == 0
    (folder / "mine.tum").write_bytes((folder / "run/trajectories/dead-reckoning.tum").read_bytes())
    (folder / "mine.csv").write_bytes((folder / "run/landmarks/ekf.csv").read_bytes())
    moved = se3.exp([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]) @ sequence.truth.world_T_imu
    data.write_kitti(folder / "moved.txt", moved)
    (folder / "text.txt").write_text("years of work\n")
    (folder / "theirs").mkdir()
    (folder / "theirs" / "thesis.tex").write_text("years of work")
    return folder


def test_against_a_run_the_trust_comes_first_and_its_estimators_stand_beside(made: Path) -> None:
    finished = fgbaseline(
        *["compare", "run", "mine.tum", "--sequence", "problem", "--landmarks", "mine.csv", "--out", "out/c"],
        cwd=made,
        drawing=False,
        COLUMNS="200",
    )
    assert finished.returncode == 0, finished.stderr
    first = finished.stdout.splitlines()[0]
    assert first.startswith("The reference, ekf, is ")
    summary = json.loads((made / "out/c/comparison.json").read_text())
    run = json.loads((made / "run/summary.json").read_text())
    assert summary["reference"]["trust"] == run["reference"]["trust"]
    assert summary["reference"]["reasons"] == run["reference"]["reasons"]
    assert summary["caption"].count("not aligned") == 1
    assert list(summary["estimates"]) == ["dead-reckoning", "mine"]
    beside, mine = summary["estimates"].values()
    assert mine["translation"] == beside["translation"]
    of_run = run["estimators"]["dead-reckoning"]["divergence"]["rmse"]
    assert beside["translation"]["rmse"]["value"] == pytest.approx(of_run, rel=1e-9)
    assert summary["reference"]["reprojection"]["median"] == pytest.approx(
        run["estimators"]["ekf"]["reprojection"]["median"], rel=1e-9
    )
    assert mine["reprojection"]["n"] == summary["reference"]["reprojection"]["n"]
    up = compare(made / "run", made / "mine.tum").up
    np.testing.assert_array_equal(up, drive(features_per_frame=20.0).up)
    assert beside["map"]["median"] > 0.01
    own = pd.read_csv(made / "out/c/maps/mine.csv")
    assert len(own) == mine["map"]["n"] == sum(of["n"] for of in mine["map"]["by_depth"])
    assert own["distance"].max() < 1e-6
    page = (made / "out/c/report.html").read_text()
    assert 'class="trust' in page


def test_the_problem_of_a_run_is_posed_again_from_its_recording(made: Path) -> None:
    one, other = (
        compare(made / "run", made / "mine.tum", landmarks=[made / "mine.csv"], beside="none", sequence=made / sequence)
        for sequence in ("problem", "drive.npz")
    )
    assert list(one.results) == ["mine"]
    assert one.summary.estimates == other.summary.estimates


def test_against_a_reference_file_the_table_is_captioned_and_no_page_is_written(made: Path) -> None:
    finished = fgbaseline(*["compare", "truth.tum", "k=moved.txt", "mine.tum", "--sequence", "drive.npz"], cwd=made)
    assert finished.returncode == 0, finished.stderr
    assert finished.stdout.startswith("The reference, truth, is taken as given")
    assert "SE(3)-aligned over all 50 poses" in finished.stdout
    assert "ATE: RMSE, m" in finished.stdout
    assert not (made / "report.html").exists()


def test_the_recording_itself_is_a_reference(made: Path) -> None:
    result = compare(made / "drive.npz", made / "truth.tum", align="none")
    assert result.table.loc["ATE: max, m", "truth"] < 1e-9


def in_process(line: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    """Exit code, standard output and error of a command line, without the second that a process takes to start."""
    handler = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(SystemExit) as ended:
            main(line.split())
    finally:
        signal.signal(signal.SIGTERM, handler)
    printed = capsys.readouterr()
    return int(ended.value.code or 0), printed.out, printed.err


BAD = {
    "compare": ("REFERENCE", "compare --help"),
    "compare truth.tum": ("nothing to compare",),
    "compare truth.tum missing.tum": ("missing.tum", "no such file"),
    "compare truth.tum text.txt": ("text.txt", "line 1"),
    "compare truth.tum moved.txt": ("moved.txt", "--times"),
    "compare theirs mine.tum": ("theirs", "summary.json"),
    "compare truth.tum theirs": ("theirs", "folder"),
    "compare truth.tum mine.tum --format euroc": ("truth.tum", "line 2"),
    "compare truth.tum mine.tum --format bag": ("--format", "bag"),
    "compare truth.tum mine.tum --align icp": ("--align", "icp"),
    "compare truth.tum mine.tum --align-first 0": ("--align-first", "0"),
    "compare truth.tum mine.tum --align-first 1000": ("the first 1000",),
    "compare truth.tum mine.tum --up 1,2": ("--up", "'1,2'"),
    "compare truth.tum mine.tum --up 0,0,0": ("up", "0,0,1"),
    "compare truth.tum mine.tum --delta 10": ("delta", "'10'"),
    "compare truth.tum mine.tum --delta 400deg": ("delta", "180"),
    "compare truth.tum mine.tum --delta 2.5frames": ("delta", "whole number"),
    "compare truth.tum mine.tum --tolerance -1": ("tolerance", "-1"),
    "compare truth.tum mine.tum --offset 1000": ("mine.tum", "offset"),
    "compare truth.tum mine.tum --search-offset 1000": ("1000 s", "overlap"),
    "compare truth.tum mine.tum --times missing.txt": ("missing.txt", "no such file"),
    "compare truth.tum mine.tum --landmarks mine.csv": ("landmarks", "--sequence"),
    "compare truth.tum mine.tum --landmarks you=mine.csv --sequence problem": ("'you'", "mine"),
    "compare truth.tum mine.tum --landmarks text.txt --sequence problem": ("text.txt", "id,x,y,z"),
    "compare truth.tum mine.tum --sequence theirs": ("theirs", "problem.json"),
    "compare truth.tum mine.tum --sequence text.txt": ("text.txt", "text file"),
    "compare truth.tum mine.tum --estimate-body camera": ("mine.tum", "--extrinsic"),
    "compare truth.tum mine.tum --extrinsic moved.txt": ("moved.txt", "one line"),
    "compare run mine.tum --beside isam2": ("'isam2'", "dead-reckoning"),
    "compare run mine.tum --sequence drive.npz --held-out 0.2": ("run", "--held-out"),
    "compare truth.tum mine.tum --sequence drive.npz --held-out 2": ("held-out", "2"),
    "compare truth.tum mine.tum --force": ("--out",),
    "compare truth.tum mine.tum --out theirs": ("theirs", "--force"),
    "compare truth.tum mine.tum --out theirs --force": ("theirs", "comparison.json"),
    "compare truth.tum a/b=mine.tum": ("a/b=mine.tum", "no such file"),
}


@pytest.mark.parametrize("line", BAD, ids=lambda line: line.replace("/", "|")[:60])
def test_bad_input_is_one_sentence_and_nothing_is_written(
    made: Path, line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = everything_in(made)
    monkeypatch.chdir(made)
    code, out, err = in_process(line, capsys)
    assert code == 2, out
    sentences = err.strip().splitlines()
    assert len(sentences) == 1, err
    assert sentences[0].startswith("fgbaseline: ")
    assert all(name in sentences[0] for name in BAD[line]), sentences[0]
    assert out == ""
    assert everything_in(made) == before


def test_stamps_and_poses_that_are_no_numbers_are_refused_with_their_line(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    lines = (made / "mine.tum").read_text().splitlines()
    for k, (column, word) in enumerate([(0, "nan"), (3, "inf"), (7, "9.0")]):
        words = lines[5].split()
        words[column] = word
        (tmp_path / f"{k}.tum").write_text("\n".join([*lines[:5], " ".join(words), *lines[6:]]))
        code, _, err = in_process(f"compare {made / 'truth.tum'} {k}.tum", capsys)
        assert code == 2
        assert f"{k}.tum: line 6" in err


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("{}", "it is not the summary of a run"),
        ("[", "summary.json: this is not JSON"),
        ('{"reference": [], "estimators": {}}', "it is not the summary of a run"),
    ],
)
def test_a_file_that_is_no_summary_is_refused(
    made: Path,
    text: str,
    fault: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "summary.json").write_text(text)
    code, _, err = in_process(f"compare . {made / 'mine.tum'}", capsys)
    assert code == 2
    assert fault in err
