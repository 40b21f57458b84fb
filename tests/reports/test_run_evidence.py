"""A run reports consistency, residuals, map and held-out tracks: files, figures, page and sentences."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest

from fgbaseline import data, diagnosis
from fgbaseline.compare.estimate_comparison import Run, compare_all
from fgbaseline.data import Innovations
from fgbaseline.geometry import InputError
from fgbaseline.reports import figures
from fgbaseline.reports.html.run_page import render
from fgbaseline.reports.phrases.run import verdict
from fgbaseline.reports.problem.construction import hold_out_tracks
from fgbaseline.reports.problem.settings import RunSettings
from fgbaseline.reports.results.evidence import frame_ranges
from fgbaseline.reports.run.estimation import solve
from fgbaseline.reports.run.folder import write_run

from ..builders.commands import fgbaseline
from ..builders.empty_figures import figures_left_empty
from ..builders.runs import answer, as_dict, failed, run_of, scene, standard_run
from ..builders.synthetic import drive, matched, plain_problem

SCHEMA = Path(__file__).parents[2] / "docs" / "summary.schema.json"


@cache
def held_out_run() -> Run:
    """Dead reckoning and both filters on a short drive with a quarter of its tracks held out."""
    settings = RunSettings(held_out=0.25, seed=3, estimators=("dead-reckoning", "ekf", "joint-ekf"))
    kept, held = hold_out_tracks(drive(seconds=8.0, features_per_frame=25.0), settings)
    return solve(matched(kept), settings, held=held)


def test_the_summary_has_all_of_it_and_keeps_to_the_schema() -> None:
    run = held_out_run()
    summary = as_dict(run)
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8"))).validate(summary)
    assert run.held_out is not None
    assert run.held_out.errors is not None
    assert summary["held_out"]["share"] == 0.25
    assert summary["held_out"]["seed"] == 3
    assert summary["held_out"]["inliers"] == run.held_out.errors.inliers > 10
    ranks = {name: e["held_out"]["rank"] for name, e in summary["estimators"].items()}
    assert sorted(ranks.values()) == [1, 2, 3]
    assert ranks["dead-reckoning"] == 3
    joint, dead = summary["estimators"]["joint-ekf"], summary["estimators"]["dead-reckoning"]
    assert run.reference == "joint-ekf"
    assert joint["nees_reference"] is joint["sigma_ratio"] is joint["map"] is None
    assert joint["notes"]["nees_reference"] == "it is the reference"
    assert joint["nis"]["low"] < 1.0 < joint["nis"]["high"]
    assert dead["notes"]["nis"] == "it records no innovations"
    assert dead["sigma_ratio"]["position"] > 1.0
    assert dead["nees_reference"]["frames"] + dead["nees_reference"]["left_out"] == run.problem.n_frames - 1
    assert dead["map"]["n"] > 50
    assert dead["covariance"] == {"frames": run.problem.n_frames, "held": 1, "not_positive_definite": 0, "where": ""}


def test_nothing_is_held_out_unless_asked_for() -> None:
    summary = as_dict(standard_run())
    assert summary["held_out"] is None
    assert all(e["notes"]["held_out"] == "no tracks were held out" for e in summary["estimators"].values())
    sequence = drive()
    assert hold_out_tracks(sequence, RunSettings()) == (sequence, None)
    with pytest.raises(InputError, match="held-out"):
        hold_out_tracks(sequence, RunSettings(held_out=1.5))


def test_the_folder_has_series_and_tables_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figures_left_empty(monkeypatch)
    run = held_out_run()
    write_run(run, tmp_path)
    tables = {path.name for path in (tmp_path / "tables").iterdir()}
    assert tables >= {"held_out.csv", "map_by_depth.csv", "reprojection_classes.csv"}
    ranking = pd.read_csv(tmp_path / "tables" / "held_out.csv")
    assert ranking["estimator"].tolist()[-1] == "dead-reckoning"
    series = pd.read_csv(tmp_path / "series" / "ekf.csv")
    for column in ("nees", "nees_position", "nees_rotation", "nees_reference", "nis", "nis_degrees", "covariance"):
        assert column in series, column
    assert series["covariance"].tolist()[:2] == ["held", "positive definite"]
    innovations = run.results["ekf"].estimate.innovations
    assert innovations is not None
    np.testing.assert_allclose(series["nis"], innovations.nis, rtol=1e-8)


def test_the_figures_show_it_and_the_page_has_its_table() -> None:
    run = held_out_run()
    drawn = figures.draw(run)
    expected = {"held_out", "consistency", "reprojection_classes", "map_difference", "three_sigma_ekf"}
    assert expected <= set(drawn)
    ((_, ordinate), *_) = [line.get_data() for line in drawn["three_sigma_ekf"].axes[0].get_lines()]
    error = run.results["ekf"].evidence.error
    assert error is not None
    np.testing.assert_array_equal(ordinate, error[:, 0])
    page = render(run, as_dict(run), drawn)
    assert page.count('id="figure-held_out"') == 1
    assert page.count('id="figure-three_sigma_ekf"') == 1
    assert 'id="evidence"' in page
    assert "above the best, px" in page
    assert "covariances not positive definite" not in page  # a column of zeros tells nothing


def test_the_sentences_name_the_best_estimator_and_those_without_significant_difference() -> None:
    run = held_out_run()
    assert run.held_out is not None
    (sentence,) = (s for s in verdict(run) if s.startswith("Held-out error"))
    ranking = run.held_out.ranking
    assert f" px for {ranking.index[0]}" in sentence.partition(",")[0]
    apart = " ".join(s for s in verdict(run) if s.startswith("No significant difference in held-out error"))
    assert "dead-reckoning" not in apart
    twins = ranking.copy()
    twins["behind_low"] = 0.0
    alike = replace(run, held_out=replace(run.held_out, ranking=twins))
    same = f"No significant difference in held-out error between {ranking.index[0]} and "
    assert any(s.startswith(same) for s in verdict(alike))


def test_indefinite_covariances_are_reported_with_their_frames() -> None:
    problem = plain_problem(scene())
    base = answer(problem, "isam2")
    assert base.covariance is not None
    P = base.covariance.copy()
    P[[3, 7, 8, 9]] *= -1.0
    run = run_of(problem, base, answer(problem, "ekf", (0.0, 1.0, 0.0), covariance=P))
    summary = as_dict(run)["estimators"]["ekf"]
    assert summary["covariance"] == {"frames": 60, "held": 0, "not_positive_definite": 4, "where": "3, 7 to 9"}
    assert summary["nees"]["frames"] == 56
    assert any(
        "not positive definite, which NEES leaves out: 4 of" in s and "(frames 3, 7 to 9)" in s for s in verdict(run)
    )
    assert "covariances not positive definite" in render(run, as_dict(run), {})


def test_a_run_without_any_estimate_reports_that_nothing_can_be_compared() -> None:
    kept, held = diagnosis.hold_out(drive(), 0.5)
    problem = matched(kept)
    run = compare_all(problem, {"ekf": failed(problem, "ekf", "no")}, {}, held)
    assert any("There is no held-out error: none of " in sentence for sentence in verdict(run))
    summary = as_dict(run)
    assert summary["held_out"]["judged"] == 0
    assert summary["estimators"]["ekf"]["notes"] == {"*": "the estimator failed: no"}


def test_innovations_that_were_never_recorded_are_no_figure() -> None:
    problem = plain_problem(scene())
    run = run_of(problem, answer(problem, "isam2", covariance=None))
    assert "consistency" not in figures.draw(run)
    empty = run_of(problem, answer(problem, "isam2", covariance=None, innovations=Innovations.none(60)))
    assert "consistency" not in figures.draw(empty)
    assert as_dict(empty)["estimators"]["isam2"]["nis"] is None


def test_the_nis_figure_exists_where_most_frames_have_no_innovation() -> None:
    problem = plain_problem(scene())
    innovations = Innovations.none(60)
    innovations.nis[20:30], innovations.degrees[20:30] = 5.0, 6
    estimate = answer(problem, "ekf", innovations=innovations)
    assert "consistency" in figures.draw(run_of(problem, answer(problem, "isam2"), estimate))


def test_frame_ranges() -> None:
    assert frame_ranges(np.array([], dtype=np.int64)) == ""
    assert frame_ranges(np.array([4])) == "4"
    assert frame_ranges(np.array([0, 1, 2, 7, 9, 10])) == "0 to 2, 7, 9 to 10"


def test_the_command_takes_a_share(tmp_path: Path) -> None:
    data.write_npz(drive(), tmp_path / "drive.npz")
    arguments = ["run", str(tmp_path / "drive.npz"), "--estimators", "dead-reckoning", "--out", str(tmp_path / "out")]
    refused = fgbaseline(*arguments, "--held-out", "2", cwd=tmp_path)
    assert refused.returncode == 2
    assert "held-out: expected a share above 0 and below 1, got 2" in refused.stderr
    assert not (tmp_path / "out").exists()
    taken = fgbaseline(*arguments, "--held-out", "0.3", "--as-recorded", cwd=tmp_path, drawing=False)
    assert taken.returncode == 0, taken.stderr
    assert "tracks held out" in taken.stderr
    settings = json.loads((tmp_path / "out" / "summary.json").read_text())["settings"]
    assert settings["held_out"] == 0.3
