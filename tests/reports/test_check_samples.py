"""A gate says nothing of next to no data: every metric has a sample, and below the smallest `check` exits 2."""

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from fgbaseline import compare as figures
from fgbaseline import data
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.accuracy_check import assert_accuracy
from fgbaseline.reports.accuracy_check.command import Outputs
from fgbaseline.reports.accuracy_check.evaluation import evaluate
from fgbaseline.reports.accuracy_check.limits import read_limits
from fgbaseline.reports.comparison import compare
from fgbaseline.reports.phrases.run import verdict
from fgbaseline.reports.results.reader import metrics_of, read_folder, sample_of

from ..builders.commands import fgbaseline
from ..builders.runs import answer, as_dict, partly_known, run_of, scene, standard_run
from ..builders.summaries import check_files
from ..builders.synthetic import plain_problem
from ..compare.test_common_frames import off, path
from ..conftest import RECORDINGS

NO_STATISTIC = {
    "samples", "coverage", "seconds", "frames_per_second", "truth", "covariance", "landmarks", "observations",
    "poses", "rank", "pairing",
}  # fmt: skip
"""counts, times and shares of them, which are not taken over a sample"""
LIMIT = '[[limit]]\nmetric = "{}"\nat_most = 100.0\n'


def judged(document: dict[str, Any], folder: Path, limits: str) -> int:
    """The exit code of a check of a summary."""
    name = "comparison.json" if "estimates" in document else "summary.json"
    (folder / name).write_text(json.dumps(document))
    (folder / "limits.toml").write_text(limits)
    return evaluate(read_limits(folder / "limits.toml"), read_folder(folder), None).exit_code


def compared(n: int, *, estimate: FloatArray | None = None, every: int = 1) -> dict[str, Any]:
    """`comparison.json` of a path against a truth that has n of its poses, every so many."""
    t, poses = 0.1 * np.arange(200), path()
    k = np.arange(0, n * every, every)
    truth = Trajectory(t[k], poses[k], "truth")
    here = off(poses, 0.01, 1) if estimate is None else estimate
    result = compare(truth, Trajectory(t[: len(here)], here, "mine"))
    return result.summary.model_dump(mode="json", by_alias=True)


def test_every_number_of_a_run_and_of_a_comparison_has_its_sample_or_is_none() -> None:
    for estimator in [*as_dict(standard_run())["estimators"].values(), *compared(200)["estimates"].values()]:
        for metric in metrics_of(estimator):
            has = sample_of(estimator, metric) is not None
            assert has != (metric.partition(".")[0] in NO_STATISTIC), metric


@pytest.mark.parametrize(
    ("n", "every", "code"), [(3, 1, 2), (3, 60, 2), (29, 1, 2), (99, 1, 2), (101, 1, 0), (29, 6, 2), (33, 6, 0)]
)
def test_fewer_than_30_poses_or_half_of_the_time_are_undecided(n: int, every: int, code: int, tmp_path: Path) -> None:
    document = compared(n, every=every)
    for metric in ("translation.rmse.value", "rotation_deg.max", "final_m", "shares.scale_percent"):
        assert judged(document, tmp_path, LIMIT.format(metric)) == code
    assert judged(document, tmp_path, LIMIT.format("translation.rmse.value").replace("100.0", "-1.0")) == (code or 1)


def test_a_slow_truth_under_a_fast_estimate_is_enough() -> None:
    t = 0.005 * np.arange(200 * 60)
    assert figures.time_coverage(t[::200], t) == pytest.approx(1.0, abs=0.02)


def test_the_smallest_sample_and_coverage_are_settable_for_the_file_and_for_a_limit(tmp_path: Path) -> None:
    document, limit = compared(50), LIMIT.format("translation.rmse.value")
    assert judged(document, tmp_path, limit) == 2
    assert judged(document, tmp_path, f"smallest_coverage = 0.2\n{limit}") == 0
    assert judged(document, tmp_path, f"{limit}smallest_coverage = 0.2\n") == 0
    assert judged(document, tmp_path, f"smallest_coverage = 0.2\nsmallest_sample = 60\n{limit}") == 2
    limits = f"smallest_coverage = 0.2\nsmallest_sample = 60\n{limit}smallest_sample = 9\n"
    assert judged(document, tmp_path, limits) == 0


def test_one_stretch_of_many_meters_is_too_little_of_a_path(tmp_path: Path) -> None:
    t, poses = 0.1 * np.arange(200), path()
    result = compare(Trajectory(t, poses, "truth"), Trajectory(t, off(poses, 0.01, 1), "mine"), deltas=["90m", "50m"])
    document = result.summary.model_dump(mode="json", by_alias=True)
    assert judged(document, tmp_path, LIMIT.format("relative.90 m.translation.rmse.value")) == 2
    assert judged(document, tmp_path, LIMIT.format("relative.90 m.rotation_deg.max") + "smallest_sample = 1\n") == 0
    assert judged(document, tmp_path, LIMIT.format("relative.50 m.translation.rmse.value")) == 0


@pytest.mark.parametrize(("missing", "code"), [(0, 0), (20, 0), (31, 2), (59, 2)])
def test_a_run_with_little_ground_truth_is_undecided_and_reports_it_first(
    missing: int, code: int, tmp_path: Path
) -> None:
    sequence = scene()
    assert sequence.truth is not None
    problem = plain_problem(scene(truth=partly_known(sequence.truth, missing)))
    whole = plain_problem(sequence)
    run = run_of(problem, answer(whole, "ekf"), answer(whole, "isam2"))
    document = {**as_dict(run), "reference": {"name": "isam2", "trust": "trusted", "reasons": []}}
    for metric in ("ate.rmse", "ate_unaligned.max", "ate_common.rmse"):
        assert judged(document, tmp_path, LIMIT.format(metric)) == code
    assert judged(document, tmp_path, LIMIT.format("divergence.rmse")) == 0
    assert verdict(run)[0].startswith("Too little ground truth for an ATE") == (code == 2)
    assert any(sentence.startswith("ATE (") for sentence in verdict(run)) == (code == 0)


def test_too_small_samples_are_reported_first_everywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert judged(compared(3), tmp_path, LIMIT.format("translation.rmse.value")) == 2
    files = Outputs(tmp_path / "c.xml", tmp_path / "c.md", tmp_path / "c.json")
    assert check_files(tmp_path, tmp_path / "limits.toml", None, files) == 2
    first = "Too little data for translation.rmse.value of mine: it has a sample of 3 over "
    assert capsys.readouterr().out.startswith(first)
    assert (tmp_path / "c.md").read_text().splitlines()[2].startswith(f"> {first}")
    document = json.loads((tmp_path / "c.json").read_text())
    assert document["shortages"][0].startswith(first)
    assert document["lines"][0]["sample"] == 3
    assert ElementTree.parse(tmp_path / "c.xml").getroot().get("errors") == "1"


def test_no_baseline_is_written_from_too_little(tmp_path: Path) -> None:
    limit = LIMIT.format("translation.rmse.value") + 'baseline = { better = "lower" }\n'
    (tmp_path / "comparison.json").write_text(json.dumps(compared(3)))
    (tmp_path / "limits.toml").write_text(limit)
    code = check_files(tmp_path, tmp_path / "limits.toml", tmp_path / "baseline.json", Outputs(), update=True)
    assert (code, (tmp_path / "baseline.json").exists()) == (2, False)


def test_the_pytest_fixture_asks_for_the_same_sample() -> None:
    t, poses = 0.1 * np.arange(200), path()
    with pytest.raises(AssertionError, match=r"violated +pairs +29 +>= 30"):
        assert_accuracy((t[:29], poses[:29]), (t[:29], poses[:29]), ate=1.0)
    assert assert_accuracy((t[:29], poses[:29]), (t[:29], poses[:29]), ate=1.0, smallest_sample=20)["pairs"] == 29


def test_a_truth_of_one_frame_leaves_the_check_undecided(tmp_path: Path) -> None:
    sequence = scene()
    assert sequence.truth is not None
    data.write_npz(sequence, tmp_path / "drive.npz")
    data.write_tum(tmp_path / "truth.tum", sequence.t[:1], sequence.truth.world_T_imu[:1])
    ran = fgbaseline(
        *("run", "drive.npz", "--truth", "truth.tum", "--truth-frame", "imu", "--estimators", "dead-reckoning,ekf"),
        *("--as-recorded", "--out", "out"),
        cwd=tmp_path,
    )
    assert ran.returncode == 0, ran.stderr
    (tmp_path / "limits.toml").write_text('reference = "none"\n' + LIMIT.format("ate.rmse"))
    result = fgbaseline("check", "out", "--limits", "limits.toml", cwd=tmp_path)
    assert result.returncode == 2
    assert result.stdout.startswith("Too little data for ate.rmse of dead-reckoning, ekf")


def test_case_49_truth_at_one_frame(tmp_path: Path) -> None:
    folder = RECORDINGS / "cases" / "49-truth-one-frame"
    if not folder.is_dir():
        pytest.skip(f"cases/49-truth-one-frame is not in {RECORDINGS} (set FGBASELINE_RECORDINGS)")
    given = ("--truth", str(folder / "truth_ns.tum"), "--truth-frame", "imu")
    ran = fgbaseline("run", str(folder / "drive.npz"), *given, "--out", "out", cwd=tmp_path, drawing=False)
    if ran.returncode == 2:  # refused, with the reason
        assert "truth_ns.tum" in ran.stderr
        return
    truth = json.loads((tmp_path / "out" / "summary.json").read_text())["estimators"]["isam2"]["truth"]
    result = fgbaseline("check", "out", "--limits", str(folder / "limits.toml"), cwd=tmp_path)
    assert result.returncode == 2 or truth["frames"] == 120  # the unit may be recognized: then there is truth enough


def test_case_25_limits_on_the_lost_estimate(tmp_path: Path) -> None:
    folder = RECORDINGS / "cases" / "25-completion"
    if not folder.is_dir():
        pytest.skip(f"cases/25-completion is not in {RECORDINGS} (set FGBASELINE_RECORDINGS)")
    compare(folder / "gt.tum", folder / "whole.tum", folder / "lost.tum").report(tmp_path / "out")
    limits = read_limits(folder / "limits2.toml")
    assert evaluate(limits, read_folder(tmp_path / "out"), None).exit_code == 1
    (tmp_path / "limits.toml").write_text('[[limit]]\nmetric = "coverage"\nestimators = "lost"\nat_least = 0.95\n')
    assert evaluate(read_limits(tmp_path / "limits.toml"), read_folder(tmp_path / "out"), None).exit_code == 1
