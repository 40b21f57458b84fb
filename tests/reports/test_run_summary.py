"""`summary.json` keeps to its published schema, says why a value is null, and `metrics.csv` is the same in rows."""

import csv
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from fgbaseline import compare
from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data import Landmarks, Observations, Status
from fgbaseline.reports.results.run import Summary, summarize
from fgbaseline.reports.tables.run import metrics_table

from ..builders.runs import answer, as_dict, failed, partly_known, run_of, scene, standard_run
from ..builders.synthetic import plain_problem

SCHEMA = Path(__file__).parents[2] / "docs" / "summary.schema.json"


def unfinished() -> Run:
    """Truth that ends early, a filter that stops early and has no covariance, one that failed on the way."""
    sequence = scene()
    assert sequence.truth is not None
    problem = plain_problem(sequence)
    asked = plain_problem(sequence.with_truth(partly_known(sequence.truth, 5)))
    stopping = answer(problem, "ekf", (1.0, 0.0, 0.0), covariance=None)
    poses = stopping.world_T_imu.copy()
    poses[40:] = np.nan
    return run_of(
        asked,
        replace(stopping, world_T_imu=poses),
        answer(problem, "isam2"),
        failed(problem, "crash", "TypeError: no"),
        answer(problem, "half", status=Status.FAILED, reason="the pose cannot be updated at frame 30"),
        answer(problem, "blind", landmarks=Landmarks.none(), used=np.zeros(len(problem.excluded), dtype=np.bool_)),
        answer(problem, "instant", seconds_total=0.0),
    )


def without_observations() -> Run:
    problem = plain_problem(scene(observations=Observations.none(), truth=None))
    return run_of(problem, answer(problem, "dead-reckoning"), failed(problem, "isam2", "no observations"))


def nothing_answered() -> Run:
    problem = plain_problem(scene())
    return run_of(problem, failed(problem, "isam2", "no observations"))


def at_the_camera_plane() -> Run:
    problem = plain_problem(scene())
    base = answer(problem, "isam2")
    position = base.landmarks.position.copy()
    position[0] = (base.world_T_imu[3] @ problem.sequence.imu_T_cam)[:3, 3]
    return run_of(problem, replace(base, landmarks=Landmarks(base.landmarks.index, position)))


RUNS = {
    "standard": standard_run,
    "without truth": lambda: standard_run(truth=None),
    "unfinished": unfinished,
    "without observations": without_observations,
    "nothing answered": nothing_answered,
    "at the camera plane": at_the_camera_plane,
}


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}.{key}" if path else key)
    else:
        yield path, value


def test_the_published_schema_is_up_to_date() -> None:
    assert json.loads(SCHEMA.read_text(encoding="utf-8")) == json.loads(Summary.json_schema()), "run `make schema`"


@pytest.mark.parametrize("kind", RUNS)
def test_a_summary_keeps_to_the_published_schema_and_is_strict_json(kind: str) -> None:
    summary = as_dict(RUNS[kind]())
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8"))).validate(summary)
    json.dumps(summary, allow_nan=False)
    assert summary["schema"] == "fgbaseline/summary/1"


@pytest.mark.parametrize("kind", RUNS)
def test_every_null_has_its_reason_beside_it_and_nothing_else_has(kind: str) -> None:
    for name, estimator in as_dict(RUNS[kind]())["estimators"].items():
        notes = estimator["notes"]
        nulls = {path for path, value in leaves(estimator) if value is None}
        covering = {key for key in notes if key == "*" or any(n == key or n.startswith(f"{key}.") for n in nulls)}
        assert covering == set(notes), name
        for null in nulls:
            assert "*" in notes or any(null == key or null.startswith(f"{key}.") for key in notes), (name, null)


def test_the_reasons_are_the_right_ones() -> None:
    estimators = as_dict(unfinished())["estimators"]
    assert estimators["ekf"]["notes"]["ate_unaligned.final"] == "it did not reach the last frame"
    assert estimators["isam2"]["notes"]["ate_unaligned.final"] == "the last frame has no ground truth"
    assert estimators["ekf"]["notes"]["nees"] == "it gives no covariance"
    assert estimators["blind"]["notes"]["reprojection_used"] == "it uses no observations"
    assert estimators["blind"]["notes"]["components"] == "it estimated no landmarks"
    for cost in ("seconds", "frames_per_second"):  # no answer takes 0 s
        assert estimators["instant"][cost] is None
        assert estimators["instant"]["notes"][cost] == "not measured"
    assert estimators["crash"]["notes"] == {"*": "the estimator failed: TypeError: no"}
    assert estimators["ekf"]["truth"] == {"frames": 40, "missing": 20}
    assert estimators["isam2"]["truth"] == {"frames": 55, "missing": 5}


@pytest.mark.parametrize("kind", RUNS)
def test_metrics_csv_is_every_number_of_the_summary(kind: str, tmp_path: Path) -> None:
    summary = summarize(RUNS[kind]())
    metrics_table(summary).to_csv(tmp_path / "metrics.csv", index=False)
    with (tmp_path / "metrics.csv").open(newline="", encoding="utf-8") as file:
        header, *table = csv.reader(file)
    assert header == ["estimator", "metric", "value"]
    rows = {(name, metric): float(value) if value else None for name, metric, value in table}
    other = ("notes", "events", "samples")  # events are below, samples say what the numbers are over
    expected = {
        (name, path): value
        for name, estimator in summary.model_dump(mode="json")["estimators"].items()
        for path, value in leaves(estimator)
        if (value is None or isinstance(value, int | float)) and path.partition(".")[0] not in other
    } | {
        (name, f"events.{kind}"): n
        for name, estimator in summary.model_dump(mode="json")["estimators"].items()
        for kind, n in estimator["events"].items()
    }
    assert rows == expected


def test_the_figures_are_those_of_the_comparison() -> None:
    run = standard_run()
    summary = as_dict(run)
    for name, result in run.results.items():
        assert result.divergence is not None
        e = summary["estimators"][name]
        assert e["divergence"] == pytest.approx(compare.divergence_summary(result.divergence))
        assert e["reprojection"]["median"] == pytest.approx(result.reprojection["error"].median())
        assert e["observations"]["used"] == result.estimate.used.sum()
        assert e["reprojection_used"]["n"] == result.estimate.used.sum()
    assert summary["reference"]["name"] == "isam2"
    assert summary["estimators"]["isam2"]["divergence"]["rmse"] == 0.0
    assert summary["estimators"]["dead-reckoning"]["ate_unaligned"]["final"] == pytest.approx(6.0)


def test_the_common_observations_are_the_same_for_all() -> None:
    problem = plain_problem(scene())
    n = len(problem.excluded)
    a, b = np.arange(n) % 2 == 0, np.arange(n) % 3 == 0
    run = run_of(problem, answer(problem, "ekf", used=a), answer(problem, "isam2", used=b))
    common = {name: e["reprojection_common"]["n"] for name, e in as_dict(run)["estimators"].items()}
    assert common == {"ekf": int((a & b).sum()), "isam2": int((a & b).sum())}


def test_settings_and_versions_are_recorded() -> None:
    summary = as_dict(standard_run())
    assert summary["settings"] == {"seed": 0}
    assert {"python", "fgbaseline", "gtsam", "numpy"} <= set(summary["versions"])
    assert summary["machine"]["cores"] >= 1
