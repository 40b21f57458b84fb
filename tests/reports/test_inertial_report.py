"""A run on raw inertial data reports velocity and biases; no other run has anything of them."""

import json
from base64 import b64decode
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pandas as pd
import pytest

from fgbaseline import compare, ekf
from fgbaseline.compare.consistency.state_nees import QUANTITIES
from fgbaseline.compare.estimate_comparison import Run, compare_all
from fgbaseline.data import Truth
from fgbaseline.geometry import InputError
from fgbaseline.geometry.strapdown import BLOCKS
from fgbaseline.reports.accuracy_check.evaluation import evaluate
from fgbaseline.reports.accuracy_check.limits import read_limits
from fgbaseline.reports.figures.over_time import velocity_and_biases
from fgbaseline.reports.figures.run import figure_functions
from fgbaseline.reports.figures.run_data import of_run
from fgbaseline.reports.figures.style import in_style
from fgbaseline.reports.html.plot_data import page_data
from fgbaseline.reports.html.run_page import render
from fgbaseline.reports.results.estimator import EstimatorSummary, InertialEstimatorSummary
from fgbaseline.reports.results.glossary import INERTIAL_TERMS
from fgbaseline.reports.results.metric_registry import METRICS
from fgbaseline.reports.results.reader import INERTIAL, NOT_INERTIAL, read_folder
from fgbaseline.reports.run.folder import write_numbers
from fgbaseline.reports.tables.run import evidence_table, main_table, terminal_table

from ..builders.inertial import inertial_problem
from ..builders.runs import as_dict, standard_run

SCHEMA = Path(__file__).parents[2] / "docs" / "summary.schema.json"


@cache
def inertial_run(truth: str = "all") -> Run:
    """A filter and dead reckoning on raw inertial data; truth has `all`, `poses` only, or is there for `none`."""
    problem = inertial_problem(3, n_frames=25)
    known = problem.sequence.truth
    assert known is not None
    chosen = {"all": known, "poses": Truth(known.world_T_imu), "none": None}[truth]
    problem = replace(problem, sequence=replace(problem.sequence, truth=chosen))
    estimates = {"joint-ekf": ekf.joint_ekf(problem), "dead-reckoning": ekf.dead_reckoning(problem)}
    return compare_all(problem, estimates, {})


@pytest.mark.parametrize("truth", ["all", "poses", "none"])
def test_the_summary_keeps_to_the_schema_and_gives_a_reason_for_every_null(truth: str) -> None:
    summary = as_dict(inertial_run(truth))
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8"))).validate(summary)
    for estimator in summary["estimators"].values():
        assert estimator.keys() >= INERTIAL
        for key in INERTIAL:
            assert estimator[key] is not None or key in estimator["notes"]
    notes = summary["estimators"]["joint-ekf"]["notes"]
    assert notes["velocity_divergence"] == "it is the reference"
    missing = {"all": None, "poses": "the ground truth has no velocity", "none": "the recording has no ground truth"}
    assert notes.get("velocity") == missing[truth]


def test_figures_are_those_of_the_comparison() -> None:
    run = inertial_run()
    truth = run.problem.sequence.truth
    assert truth is not None
    rotation = compare.truth_alignment(
        run.results["dead-reckoning"].estimate, truth, compare.Align.YAW, run.problem.sequence.up
    ).rotation
    dead = as_dict(run)["estimators"]["dead-reckoning"]
    estimate = run.results["dead-reckoning"].estimate
    unaligned = compare.velocity_and_bias_errors(estimate, truth)
    aligned = compare.velocity_and_bias_errors(estimate, truth, rotation)
    away = compare.velocity_and_bias_errors(estimate, run.results["joint-ekf"].estimate)
    assert dead["velocity_unaligned"] == pytest.approx(compare.quantity_summary(unaligned, "velocity"))
    for name in QUANTITIES:
        assert dead[name] == pytest.approx(compare.quantity_summary(aligned, name))
        expected = compare.quantity_summary(away, name)
        del expected["inside_3_sigma"]
        assert dead[f"{name}_divergence"] == pytest.approx(expected)
    nees = compare.state_nees(estimate, truth)
    assert dead["nees_state"]["mean"] == pytest.approx(nees["state"].mean())
    for name in BLOCKS:
        assert dead["nees_state"][name]["mean"] == pytest.approx(nees[name].mean())
        assert dead["samples"][f"nees_state.{name}"]["n"] == dead["nees_state"][name]["frames"]


def test_tables_have_the_metrics_where_a_run_has_them() -> None:
    run = inertial_run()
    estimators = as_dict(run)["estimators"]
    headings = [c.heading for c in main_table(run, estimators).columns]
    assert sum("RMSE" in h and h.split(", ")[-1] in ("m/s", "rad/s", "m/s^2") for h in headings) == 3
    assert {"velocity", "gyroscope bias", "accelerometer bias", "NEES of the state"} <= {
        c.term for c in evidence_table(run, estimators).columns
    }
    assert any(c.heading == "velocity, m/s" for c in terminal_table(run, estimators).columns)
    inertial = [m for m in METRICS if m.path[0] in INERTIAL]
    for e in estimators.values():
        assert all(bool(m.value(e)) for m in inertial if "divergence" not in m.path[0])
    page = render(run, as_dict(run), {})
    for term in INERTIAL_TERMS:  # the scale error is that of one camera
        assert (f"<dt>{term}</dt>" in page) is (term != "scale error")


def test_the_series_have_values_sigmas_and_errors_by_frame(tmp_path: Path) -> None:
    run = inertial_run()
    write_numbers(run, tmp_path)
    series = pd.read_csv(tmp_path / "series" / "dead-reckoning.csv")
    estimate, truth = run.results["dead-reckoning"].estimate, run.problem.sequence.truth
    assert truth is not None
    for name in QUANTITIES:
        value = np.stack([series[f"{name}_{axis}"] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(value, getattr(estimate, name), rtol=1e-8)
        error = np.stack([series[f"truth_{name}_{axis}"] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(error, value - getattr(truth, name), atol=1e-7)
        np.testing.assert_allclose(series[f"truth_{name}"], np.linalg.norm(error, axis=1), rtol=1e-6)
        assert (series[[f"{name}_sigma_{axis}" for axis in "xyz"]] > 0.0).all(axis=None)
        assert series[f"divergence_{name}"].notna().all()
    np.testing.assert_allclose(series["nees_state"], compare.state_nees(estimate, truth)["state"], rtol=1e-7)
    metrics = pd.read_csv(tmp_path / "metrics.csv").set_index(["estimator", "metric"])["value"]
    dead = json.loads((tmp_path / "summary.json").read_text())["estimators"]["dead-reckoning"]
    assert metrics["dead-reckoning", "velocity.rmse"] == pytest.approx(dead["velocity"]["rmse"])


def single(text: str) -> np.ndarray:
    """Numbers of a line of a chart."""
    return np.frombuffer(b64decode(text), dtype="<f4")


def test_charts_have_the_biases_within_three_sigmas_beside_the_truth() -> None:
    run = inertial_run()
    drawn = {one["name"]: one for one in page_data(run)["charts"]}
    estimate, truth = run.results["joint-ekf"].estimate, run.problem.sequence.truth
    assert truth is not None
    assert estimate.state_covariance is not None
    for name, block in ((name, BLOCKS[name]) for name in QUANTITIES[1:]):
        sigma = np.sqrt(np.einsum("tii->ti", estimate.state_covariance[:, block, block]))
        for i, axis in enumerate("xyz"):
            one = drawn[f"{name.replace('_', '-')}-{axis}"]
            np.testing.assert_allclose(single(one["lines"]["0"]), getattr(estimate, name)[:, i], rtol=1e-5)
            np.testing.assert_allclose(single(one["lines"]["truth"]), getattr(truth, name)[:, i], rtol=1e-5)
            np.testing.assert_allclose(single(one["bounds"]["0"]), 3.0 * sigma[:, i], rtol=1e-5)
    assert {"velocity", "velocity-divergence", "nees-state"} <= drawn.keys()
    assert (
        "truth"
        not in {one["name"]: one for one in page_data(inertial_run("poses"))["charts"]}["gyroscope-bias-x"]["lines"]
    )
    assert not any(
        "bounds" in one or one["group"] == "Velocity and biases" for one in page_data(standard_run())["charts"]
    )


def test_a_figure_of_each_estimator_has_the_errors_between_three_sigmas() -> None:
    run = inertial_run()
    with in_style():
        figure = velocity_and_biases(of_run(run), "dead-reckoning")
        assert figure is not None
        assert velocity_and_biases(of_run(inertial_run("poses")), "dead-reckoning") is None
        assert velocity_and_biases(of_run(standard_run()), "ekf") is None
    assert len(figure.axes) == 9
    errors = run.results["dead-reckoning"].inertial
    assert errors is not None
    assert errors.errors is not None
    drawn = {a.get_title(loc="left").partition(":")[0]: a.get_lines()[0].get_ydata() for a in figure.axes}
    np.testing.assert_array_equal(drawn["velocity y, m/s"], errors.errors["velocity_y"])
    np.testing.assert_array_equal(drawn["gyro bias z, rad/s"], errors.errors["gyroscope_bias_z"])
    assert "velocity_and_biases_joint-ekf" in figure_functions(of_run(run))


def limits(path: Path, *lines: str) -> Path:
    """A limits file with one limit for each line."""
    path.write_text("smallest_sample = 1\nsmallest_coverage = 0.0\n" + "\n".join(f"[[limit]]\n{x}" for x in lines))
    return path


def checked(run: Run, folder: Path, *lines: str) -> Any:
    """Outcomes of limits on a run, by metric and estimator, as (outcome, reason)."""
    folder.mkdir()
    write_numbers(run, folder)
    result = evaluate(read_limits(limits(folder / "limits.toml", *lines)), read_folder(folder), None)
    return {(line.metric, line.estimator): (line.outcome.value, line.reason) for line in result.lines}


def test_limits_judge_velocity_and_biases(tmp_path: Path) -> None:
    run = inertial_run()
    rmse = as_dict(run)["estimators"]["joint-ekf"]["velocity"]["rmse"]
    metric = 'metric = "velocity.rmse"\nestimators = "joint-ekf"'
    assert (
        checked(run, tmp_path / "a", f"{metric}\nat_most = {1.01 * rmse}")["velocity.rmse", "joint-ekf"][0] == "holds"
    )
    short = checked(run, tmp_path / "b", f"{metric}\nat_most = {0.99 * rmse}")
    assert short["velocity.rmse", "joint-ekf"][0] == "violated"
    every = checked(
        run,
        tmp_path / "c",
        *(
            f'metric = "{m}"\nestimators = "dead-reckoning"\nat_least = 0.0'
            for m in ("gyroscope_bias.final", "velocity_unaligned.rmse_x", "nees_state.velocity.mean")
        ),
    )
    assert {outcome for outcome, _ in every.values()} == {"holds"}
    away = checked(
        run, tmp_path / "e", 'metric = "velocity_divergence.rmse"\nestimators = "dead-reckoning"\nat_least = 0.0'
    )
    trust = run.trust.verdict.name.lower()
    assert away["velocity_divergence.rmse", "dead-reckoning"] == ("undecided", f"the reference is {trust}")
    with pytest.raises(InputError, match=r"velocity\.rsme.*is not a number"):
        checked(run, tmp_path / "d", 'metric = "velocity.rsme"\nat_most = 1.0')


def test_limits_on_a_run_without_inertial_data_are_undecided_with_the_reason(tmp_path: Path) -> None:
    outcomes = checked(standard_run(), tmp_path / "a", 'metric = "velocity.rmse"\nat_most = 1.0')
    assert set(outcomes.values()) == {("undecided", NOT_INERTIAL)}
    poses = checked(inertial_run("poses"), tmp_path / "b", 'metric = "velocity.rmse"\nat_most = 1.0')
    assert set(poses.values()) == {("undecided", "the ground truth has no velocity")}


def test_a_run_without_inertial_data_has_none_of_it(tmp_path: Path) -> None:
    run = standard_run()
    added = InertialEstimatorSummary.model_fields.keys() - EstimatorSummary.model_fields.keys()
    assert added == INERTIAL
    write_numbers(run, tmp_path)
    for path in [*tmp_path.rglob("*.csv"), tmp_path / "summary.json", tmp_path / "table.md"]:
        text = path.read_text(encoding="utf-8")
        assert not any(word in text for word in ("velocity", "gyroscope", "accelerometer", "nees_state", "of 15")), path
    page = render(run, as_dict(run), {})
    assert not any(f"<dt>{term}</dt>" in page for term in INERTIAL_TERMS)
    assert not any(word in page for word in ("gyroscope", "accelerometer", "state NEES", "elocity error"))
