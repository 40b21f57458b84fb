"""On recordings that no estimator was made for: an answer that admits its errors, or a failure with its reason.

The table of docs/reliability.md is written by `python -m benchmarks.reliability` from the same recordings.
"""

from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, data, smoother
from fgbaseline.compare import Verdict
from fgbaseline.diagnosis import (
    calibrated,
    diagnose,
    findings_of,
    read_repairs,
    repairs_text,
    to_json,
    track_statistics,
)
from fgbaseline.geometry import InputError
from fgbaseline.reports.results.run import summarize

from ..builders.commands import fgbaseline
from ..builders.hostile import ESTIMATORS, RECORDINGS, REFUSED, Cell, Hostile, base, cell, cut, solved, velocity_jump

BY_NAME = {recording.name: recording for recording in RECORDINGS}


def promised(recording: Hostile, estimator: str) -> Cell:
    if estimator in recording.fails:
        return Cell.FAILED
    return Cell.OVERCONFIDENT if estimator in recording.overconfident else Cell.ADMITS


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_NAME)
def test_every_estimator_is_consistent_or_fails_with_a_reason_and_the_tables_are_written(name: str) -> None:
    recording, run = BY_NAME[name], solved(BY_NAME[name])
    assert {e: cell(result) for e, result in run.results.items()} == {e: promised(recording, e) for e in ESTIMATORS}
    for result in run.results.values():
        assert result.answered or result.estimate.reason
        assert "Error" not in result.estimate.reason
    if recording.make in (base, velocity_jump):
        assert run.trust.verdict is Verdict.TRUSTED
    summary = summarize(run).model_dump(mode="json")
    assert set(summary["estimators"]) == set(ESTIMATORS)
    assert all(e["reason"] for e in summary["estimators"].values() if e["status"] == "failed")


@pytest.mark.parametrize("name", BY_NAME)
def test_a_hostile_recording_is_diagnosed_without_an_exception_text(name: str) -> None:
    diagnosis = diagnose(BY_NAME[name].make())
    tracks = track_statistics(diagnosis)
    findings = findings_of(diagnosis, tracks)
    assert [f["code"] for f in to_json(diagnosis, tracks, findings)["findings"]] == [f.code for f in findings]
    assert "Error" not in diagnosis.failure_reason
    assert repairs_text(diagnosis)


@pytest.mark.parametrize("name", REFUSED)
def test_an_invalid_recording_is_refused_by_field_and_frame(tmp_path: Path, name: str) -> None:
    make, sentence = REFUSED[name]
    np.savez(tmp_path / "a.npz", **make())
    with pytest.raises(InputError, match=sentence):
        data.read(tmp_path / "a.npz")


@pytest.mark.parametrize("name", ["zero and negative disparities only", "one velocity sample of 500 m/s"])
def test_the_report_is_written_and_diagnose_exits_zero(tmp_path: Path, name: str) -> None:
    data.write_npz(BY_NAME[name].make(), tmp_path / "drive.npz")
    estimators = "dead-reckoning,joint-ekf,isam2"
    run = fgbaseline("run", "drive.npz", "--out", "out", "--estimators", estimators, cwd=tmp_path, drawing=False)
    failed = bool(BY_NAME[name].fails)
    assert run.returncode == int(failed), run.stderr
    assert "Traceback" not in run.stderr
    assert (tmp_path / "out" / "report.html").is_file()
    finished = fgbaseline("diagnose", "drive.npz", "--write-repairs", "repairs.toml", cwd=tmp_path)
    assert finished.returncode == (2 if failed else 1), finished.stderr
    assert "Traceback" not in finished.stderr
    assert read_repairs(tmp_path / "repairs.toml")


def test_a_possible_cut_of_the_recording_is_reported() -> None:
    sequence = cut()
    diagnosis = diagnose(sequence)
    (finding,) = [f for f in findings_of(diagnosis, track_statistics(diagnosis)) if f.code == "cuts"]
    assert "30" in finding.sentence
    problem = calibrated(sequence)
    reasons = compare.trust(problem, smoother.isam2(problem)).reasons
    untied = "1 of 47 pairs of consecutive frames (2.13 %) have no used landmark in common"
    assert any(untied in reason for reason in reasons)
    assert not any(f.code == "cuts" for f in calibrated(base()).findings)


def test_the_recordings_match_their_description() -> None:
    truth = cut().truth
    assert truth is not None
    step = np.linalg.norm(np.diff(truth.world_T_imu[:, :3, 3], axis=0), axis=1)
    assert 50.0 <= step.max() < 55.0
    assert all(recording.make().truth is not None for recording in RECORDINGS)
    assert len(base().observations) > 800
