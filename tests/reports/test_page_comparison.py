"""The pages of a run, a comparison and a diagnosis are one: sections for the data that each has, and one record."""

import json
from base64 import b64decode
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data import Trajectory
from fgbaseline.diagnosis import diagnose
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.reports.cli import main
from fgbaseline.reports.comparison import ComparisonReport, compare
from fgbaseline.reports.figures.comparison_data import of_comparison
from fgbaseline.reports.html import comparison_page, run_page
from fgbaseline.reports.html.comparison_page import GAP, MOMENTS, comparison_plots
from fgbaseline.reports.html.plot_data import page_data
from fgbaseline.reports.results.diagnosis import found_by
from fgbaseline.reports.results.provenance import LIBRARIES, creation

from ..builders.runs import as_dict, standard_run
from ..builders.synthetic import drive

NAMES = ("steady", "wandering", "sparse", "late", "scaled", "positions")


def scattered(poses: FloatArray, size: float, seed: int) -> FloatArray:
    steps = size * np.random.default_rng(seed).normal(size=(len(poses), 6)) * np.repeat([1.0, 0.1], 3)
    return poses @ se3.exp(np.cumsum(steps, axis=0))


@cache
def truth() -> Trajectory:
    sequence = drive(seconds=12.0)
    assert sequence.truth is not None
    return Trajectory(sequence.t, sequence.truth.world_T_imu, "truth")


@cache
def six() -> ComparisonReport:
    """Six estimates: one with a pose in ten, one that starts late, one of another scale, one of positions only."""
    t, poses = truth().t, truth().world_T_body
    scaled = scattered(poses, 0.005, 4)
    scaled[:, :3, 3] *= 1.02
    bare = np.tile(np.eye(4), (len(t), 1, 1))
    bare[:, :3, 3] = scattered(poses, 0.01, 5)[:, :3, 3]
    every = (
        Trajectory(t, scattered(poses, 0.005, 1), "steady"),
        Trajectory(t, scattered(poses, 0.05, 2), "wandering"),
        Trajectory(t[::10], scattered(poses, 0.01, 3)[::10], "sparse"),
        Trajectory(t[30:], scattered(poses, 0.01, 6)[30:], "late"),
        Trajectory(t, scaled, "scaled"),
        Trajectory(t, bare, "positions", oriented=False),
    )
    return compare(truth(), *every)


def page_of(comparison: ComparisonReport) -> str:
    return comparison_page.render(comparison, comparison.summary, {})


def page_of_run() -> str:
    return run_page.render(standard_run(), as_dict(standard_run()), {})


def sections(page: str) -> list[str]:
    return [part.partition('"')[0] for part in page.split('<section id="')[1:]]


def held_by(page: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(page.partition('id="run">')[2].partition("</script>")[0])
    return found


def unpacked(text: str) -> FloatArray:
    return np.frombuffer(b64decode(text), "<f4").astype(np.float64)


def test_a_comparison_has_the_sections_and_scripts_of_a_run_without_those_that_it_has_no_data_for() -> None:
    run, comparison = page_of_run(), page_of(six())
    assert sections(comparison) == ["verdict", "paths", "table", "over-time", "glossary", "record"]
    assert set(sections(comparison)) <= set(sections(run))
    assert run.rpartition("<script>")[2] == comparison.rpartition("<script>")[2]
    plots = comparison_plots(six(), of_comparison(six()))
    of_run = page_data(standard_run())
    assert plots.keys() == of_run.keys()
    assert all(one.keys() == of_run["estimators"][0].keys() for one in plots["estimators"])
    assert {chart["name"] for chart in plots["charts"]} == {
        *("divergence", "rotation", "along", "across", "above", "heading", "height"),
    }


def test_a_page_offers_no_switch_for_what_it_cannot_show() -> None:
    assert 'data-do="landmarks"' in page_of_run()
    assert 'data-do="landmarks"' not in page_of(six())
    assert 'data-do="ellipses"' not in page_of(six())


def test_a_line_goes_through_every_pair_of_poses_and_breaks_where_an_estimate_has_none() -> None:
    plots, comparison = held_by(page_of(six())), six()
    t = unpacked(plots["t"])
    assert plots["frames"] == len(t) <= MOMENTS
    lines = next(chart["lines"] for chart in plots["charts"] if chart["name"] == "divergence")
    for number, name in enumerate(NAMES, start=1):
        result = comparison.results[name]
        stamps = result.matched.reference.t - truth().t[0]
        shown = unpacked(lines[str(number)])
        at = np.argmin(np.abs(t[:, None] - stamps), axis=0)
        np.testing.assert_allclose(shown[at], result.divergence["position"], rtol=1e-5, atol=1e-6)
        inside = (t >= stamps[0] - 1e-6) & (t <= stamps[-1] + 1e-6)
        assert np.isfinite(shown[inside]).all()
        assert np.isnan(shown[~inside]).all()
        path = unpacked(plots["estimators"][number]["path"]).reshape(-1, 3)[at]
        expected = result.matched.estimate.position - truth().position[0]
        np.testing.assert_allclose(np.linalg.norm(path, axis=1), np.linalg.norm(expected, axis=1), atol=1e-4)
    assert (~inside).sum() == 0
    rotations = next(chart["lines"] for chart in plots["charts"] if chart["name"] == "rotation")
    assert sorted(rotations) == ["1", "2", "3", "4", "5"]  # none of positions alone


def test_a_line_is_broken_across_a_gap_of_many_intervals() -> None:
    t, poses = truth().t, truth().world_T_body
    gap = round(GAP) + 5
    kept = np.r_[0:40, 40 + gap : len(t)]
    comparison = compare(truth(), Trajectory(t[kept], scattered(poses, 0.01, 1)[kept], "gap"))
    plots = comparison_plots(comparison, of_comparison(comparison))
    shown = unpacked(plots["charts"][0]["lines"]["1"])
    missing = np.flatnonzero(np.isnan(shown))
    np.testing.assert_array_equal(missing, np.arange(40, 40 + gap))


def test_a_long_trajectory_is_thinned_to_what_a_page_can_hold() -> None:
    t = np.arange(10_001) / 200.0
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, 0, 3] = t
    moved = poses.copy()
    moved[:, 1, 3] = 0.1
    reference, estimate = Trajectory(t, poses, "reference"), Trajectory(t, moved, "moved")
    comparison = compare(reference, estimate, align="none")
    plots = comparison_plots(comparison, of_comparison(comparison))
    assert MOMENTS / 2 < plots["frames"] <= MOMENTS
    np.testing.assert_allclose(unpacked(plots["charts"][0]["lines"]["1"]), 0.1, rtol=1e-5)


def test_landmarks_pixels_and_ellipses_come_along_where_a_comparison_has_them(tmp_path: Path) -> None:
    t, poses = truth().t, truth().world_T_body
    covariance = np.tile(np.diag(np.repeat([0.01, 1e-4], 3)), (len(t), 1, 1))
    data.write_trajectory_npz(tmp_path / "mine.npz", t, scattered(poses, 0.005, 1), covariance)
    data.write_npz(drive(seconds=12.0), tmp_path / "drive.npz")
    points = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    rows = [f"{i},{x},{y},{z}" for i, (x, y, z) in enumerate(points.tolist())]
    (tmp_path / "mine.csv").write_text("\n".join(["id,x,y,z", *rows]))
    comparison = compare(
        truth(), tmp_path / "mine.npz", sequence=tmp_path / "drive.npz", landmarks=[tmp_path / "mine.csv"]
    )
    page = page_of(comparison)
    plots = held_by(page)
    assert 'data-do="landmarks"' in page
    assert 'data-do="ellipses"' in page
    assert [chart["name"] for chart in plots["charts"]][-2:] == ["nees", "reprojection"]
    placed = np.tile(np.eye(4), (len(points), 1, 1))
    placed[:, :3, 3] = points
    there = comparison.results["mine"].matched.alignment.apply(placed)
    shown = unpacked(plots["estimators"][1]["points"]).reshape(-1, 3)
    np.testing.assert_allclose(
        np.linalg.norm(shown, axis=1), np.linalg.norm(there[:, :3, 3] - truth().position[0], axis=1), rtol=1e-5
    )
    assert {"0", "1"} == set(plots["charts"][-1]["lines"])


def test_frames_without_stamps_are_counted_and_not_timed(tmp_path: Path) -> None:
    for name, seed in (("one", 1), ("two", 2)):
        data.write_kitti(tmp_path / f"{name}.txt", scattered(truth().world_T_body, 0.01, seed))
    plots = held_by(page_of(compare(tmp_path / "one.txt", tmp_path / "two.txt")))
    assert (plots["step"], plots["stamped"]) == ("frame", False)
    np.testing.assert_array_equal(unpacked(plots["t"]), np.arange(len(truth())))
    assert plots["axes"][2] == "up"


def records(page: str) -> dict[str, str]:
    """Keys and values of the record at the end of a page."""
    rows = page[page.index('id="record"') :].split("<dt>")[1:]
    return {row.partition("</dt>")[0]: row.partition("<dd>")[2].partition("</dd>")[0] for row in rows}


@pytest.mark.parametrize("kind", ["run", "comparison", "diagnosis"])
def test_every_page_ends_with_date_command_line_versions_and_processor(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    pages = {
        "run": page_of_run,
        "comparison": lambda: page_of(six()),
        "diagnosis": lambda: run_page.render_diagnosis(found_by(diagnose(drive(seconds=4.0))), {}),
    }
    page = pages[kind]()
    record = records(page)
    assert ("glossary" in sections(page)) == (kind != "diagnosis")
    assert record["date"] == "1970-01-02 00:00:00 +0000"
    assert record["command line"] == "none: called from Python"
    assert {"python", "fgbaseline", "gtsam", "numpy", *LIBRARIES} <= record.keys()
    assert record["model"]
    assert record["processor"]


def test_the_command_line_of_a_page_can_be_given_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    data.write_tum(tmp_path / "truth.tum", truth().t, truth().world_T_body)
    data.write_tum(tmp_path / "my path.tum", truth().t, scattered(truth().world_T_body, 0.01, 1))
    given = ["compare", "truth.tum", "my path.tum", "--align", "none", "--out", "out"]
    with pytest.raises(SystemExit) as ended:
        main(given)
    assert ended.value.code == 0, capsys.readouterr().err
    record = records((tmp_path / "out/report.html").read_text())
    line = record["command line"].replace("&#39;", "'")
    assert line == "fgbaseline compare truth.tum 'my path.tum' --align none --out out"
    assert "command line" in creation()["Created"]


def test_heading_and_scale_are_in_a_sentence_only_where_they_explain_the_error() -> None:
    t, poses = truth().t, truth().world_T_body
    shaken, scaled = poses.copy(), poses.copy()
    shaken[:, :3, 3] += np.random.default_rng(0).normal(0.0, 0.1, (len(t), 3))
    scaled[:, :3, 3] *= 1.05
    estimates = (Trajectory(t, shaken, "shaken"), Trajectory(t, scaled, "scaled"))
    sentences = compare(truth(), *estimates, align="yaw").verdict
    scaled_text, others = (s for s in sentences if s.startswith("Squared position error"))
    assert scaled_text.startswith("Squared position error of scaled: ")
    assert " from scale (least-squares scale 1.0500), " in scaled_text
    assert others == "Squared position error of the other estimates: scale and heading below 5 % each."
