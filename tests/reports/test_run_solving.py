"""Whatever an estimator does, the others go on, and its row says what happened."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fgbaseline import ekf
from fgbaseline.compare.estimate_comparison import compare_all
from fgbaseline.data import Estimate, Innovations, Landmarks, Problem, Progress, Status
from fgbaseline.data.estimators import runner
from fgbaseline.data.estimators.runner import solve_all
from fgbaseline.geometry import InputError
from fgbaseline.reports.problem.construction import read_sequence
from fgbaseline.reports.problem.settings import RunSettings, check_estimators
from fgbaseline.reports.run.estimation import batch_is_added, solve

from ..builders.runs import as_dict
from ..builders.synthetic import Scene, plain_problem

PROBLEM = plain_problem(Scene().sequence())


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What `find_estimator` finds, beside dead reckoning."""
    estimators: dict[str, Any] = {"dead-reckoning": ekf.dead_reckoning}
    monkeypatch.setattr(runner, "find_estimator", estimators.__getitem__)
    return estimators


def with_changes(**changes: Any) -> Callable[[Problem, Progress | None], Estimate]:
    return lambda problem, _: replace(ekf.dead_reckoning(problem), **changes)


@pytest.mark.parametrize(
    "error",
    [TypeError("no"), KeyError("x"), MemoryError(), ZeroDivisionError("z"), np.linalg.LinAlgError("singular")],
    ids=repr,
)
def test_a_crash_is_a_failed_row_with_its_reason_and_the_line_it_came_from(
    installed: dict[str, Any], error: Exception
) -> None:
    def crash(problem: Problem, progress: Progress | None) -> Estimate:
        raise error

    installed["crash"] = crash
    answers = solve_all(PROBLEM, ["crash", "dead-reckoning"])
    assert list(answers) == ["crash", "dead-reckoning"]
    assert answers["crash"].status is Status.FAILED
    assert type(error).__name__ in answers["crash"].reason
    assert "test_run_solving.py, line" in answers["crash"].reason
    assert answers["dead-reckoning"].status is Status.OK
    run = compare_all(PROBLEM, answers, {})
    assert run.reference == "dead-reckoning"
    assert [result.name for result in run.answered] == ["dead-reckoning"]


def test_an_interruption_is_no_failure(installed: dict[str, Any]) -> None:
    def interrupt(problem: Problem, progress: Progress | None) -> Estimate:
        raise KeyboardInterrupt

    installed["interrupt"] = interrupt
    with pytest.raises(KeyboardInterrupt):
        solve_all(PROBLEM, ["interrupt", "dead-reckoning"])


BENT = ekf.dead_reckoning(PROBLEM).world_T_imu.copy()
BENT[4, :3, :3] *= 1.01
INFINITE = ekf.dead_reckoning(PROBLEM).world_T_imu.copy()
INFINITE[6, 0, 3] = np.inf
T, N, M = PROBLEM.n_frames, len(PROBLEM.excluded), PROBLEM.sequence.n_landmarks
ANSWERS = {
    "it returned NoneType": lambda _, __: None,
    "world_T_imu is (9, 4, 4)": with_changes(world_T_imu=np.tile(np.eye(4), (T - 1, 1, 1))),
    "world_T_imu is list": with_changes(world_T_imu=np.tile(np.eye(4), (T, 1, 1)).tolist()),
    "used is (3,)": with_changes(used=np.zeros(3, dtype=bool)),
    "used has the type int64": with_changes(used=np.zeros(N, dtype=np.int64)),
    "covariance is (10, 3, 3)": with_changes(covariance=np.zeros((T, 3, 3))),
    "seconds is (3,)": with_changes(seconds=np.zeros(3)),
    "landmarks.position is (2, 2)": with_changes(landmarks=Landmarks(np.arange(2), np.zeros((2, 2)))),
    "landmarks.covariance is (2, 3)": with_changes(
        landmarks=Landmarks(np.arange(2), np.zeros((2, 3)), np.zeros((2, 3)))
    ),
    "innovations.nis is (3,)": with_changes(innovations=Innovations.none(3)),
    "landmarks.index must rise": with_changes(landmarks=Landmarks(np.array([1, 0]), np.zeros((2, 3)))),
    "0 to 11": with_changes(landmarks=Landmarks(np.array([M]), np.zeros((1, 3)))),
    "frame 4 is not a rigid motion": with_changes(world_T_imu=BENT),
    "frame 6 is not a rigid motion": with_changes(world_T_imu=INFINITE),
    "no pose at all": with_changes(world_T_imu=np.full((T, 4, 4), np.nan)),
}


@pytest.mark.parametrize("reason", ANSWERS)
def test_an_invalid_estimate_is_a_failed_row_with_its_reason(installed: dict[str, Any], reason: str) -> None:
    installed["odd"] = ANSWERS[reason]
    answers = solve_all(PROBLEM, ["odd", "dead-reckoning"])
    assert answers["odd"].status is Status.FAILED
    assert reason in answers["odd"].reason
    compare_all(PROBLEM, answers, {})


def test_an_estimate_has_the_name_it_was_requested_by(installed: dict[str, Any]) -> None:
    installed["mine"] = ekf.dead_reckoning
    assert solve_all(PROBLEM, ["mine"])["mine"].name == "mine"


def test_landmarks_and_covariances_that_are_no_numbers_stop_no_comparison(installed: dict[str, Any]) -> None:
    position = ekf.dead_reckoning(PROBLEM).landmarks.position.copy()
    position[0], position[1] = np.nan, np.inf
    wild = np.full((M, 3, 3), 1e300)
    wild[:4] = [np.full((3, 3), value) for value in (np.nan, np.inf, 0.0, -1.0)]
    covariance = np.full((T, 6, 6), 1e300)
    covariance[1:4] = [np.full((6, 6), value) for value in (np.inf, 0.0, -1.0)]
    installed["wild"] = with_changes(landmarks=Landmarks(np.arange(M), position, wild), covariance=covariance)
    run = compare_all(PROBLEM, solve_all(PROBLEM, ["wild", "dead-reckoning"]), {})
    assert run.results["wild"].answered
    assert run.results["wild"].evidence.map is not None
    assert len(run.results["wild"].evidence.map) == M - 1


def test_poses_from_a_frame_on_may_be_missing(installed: dict[str, Any]) -> None:
    poses = ekf.dead_reckoning(PROBLEM).world_T_imu.copy()
    poses[7:] = np.nan
    installed["short"] = with_changes(world_T_imu=poses)
    answers = solve_all(PROBLEM, ["short", "dead-reckoning"])
    assert answers["short"].status is Status.OK
    divergence = compare_all(PROBLEM, answers, {}).results["short"].divergence
    assert divergence is not None
    assert divergence["position"].notna().sum() == 7


def test_an_estimator_that_requests_them_receives_earlier_estimates(installed: dict[str, Any]) -> None:
    received: list[list[str]] = []

    def asking(problem: Problem, progress: Progress | None, given: Mapping[str, Estimate] | None = None) -> Estimate:
        received.append(list(given or {}))
        answer = ekf.dead_reckoning(problem)
        return replace(answer, by_products={"other": answer})

    installed["asking"] = asking
    installed["asking too"] = asking
    solve_all(PROBLEM, ["dead-reckoning", "asking", "asking too"])
    assert received[0] == ["dead-reckoning"]
    assert set(received[1]) == {"dead-reckoning", "asking", "other"}


def test_no_estimator_gets_the_ground_truth(installed: dict[str, Any]) -> None:
    received: list[Problem] = []

    def looking(problem: Problem, progress: Progress | None) -> Estimate:
        received.append(problem)
        return ekf.dead_reckoning(problem)

    installed["looking"] = looking
    assert PROBLEM.sequence.truth is not None
    solve_all(PROBLEM, ["looking", "mine"], functions={"mine": looking})
    assert [problem.sequence.truth for problem in received] == [None, None]
    assert PROBLEM.sequence.truth is not None


def test_by_products_of_a_run_are_not_solved_again(installed: dict[str, Any]) -> None:
    def both(problem: Problem, progress: Progress | None) -> Estimate:
        answer = ekf.dead_reckoning(problem)
        return replace(answer, by_products={"other": replace(answer, name="other", reason="given along")})

    installed["both"] = both
    assert solve_all(PROBLEM, ["both", "other"])["other"].reason == "given along"


@pytest.mark.parametrize("stated", [np.nan, 0.0])
def test_an_answer_without_seconds_and_its_by_product_have_the_time_of_the_call(
    installed: dict[str, Any], stated: float
) -> None:
    def slow(problem: Problem, progress: Progress | None) -> Estimate:
        time.sleep(0.05)
        answer = replace(ekf.dead_reckoning(problem), seconds_total=stated)
        return replace(answer, by_products={"other": answer})

    installed["slow"] = slow
    start = time.perf_counter()
    answers = solve_all(PROBLEM, ["slow", "other"])
    took = time.perf_counter() - start
    assert 0.05 <= answers["slow"].seconds_total == answers["other"].seconds_total <= took
    results = as_dict(compare_all(PROBLEM, answers, {}))["estimators"]
    assert results["slow"]["seconds"] == answers["slow"].seconds_total


def test_an_answer_that_states_its_seconds_keeps_them(installed: dict[str, Any]) -> None:
    installed["stated"] = with_changes(seconds_total=1.5)
    assert solve_all(PROBLEM, ["stated"])["stated"].seconds_total == 1.5


def test_an_estimator_that_failed_midway_does_not_narrow_the_common_observations(installed: dict[str, Any]) -> None:
    some = np.arange(N) < N // 2
    installed["failing"] = with_changes(status=Status.FAILED, reason="frame 3", used=np.arange(N) < 3)
    installed["half"] = with_changes(used=some)
    run = compare_all(PROBLEM, solve_all(PROBLEM, ["failing", "half"]), {})
    assert run.common is not None
    np.testing.assert_array_equal(run.common, some)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ((), "name at least one of"),
        (("kalman",), "there is no 'kalman'; installed are .*dead-reckoning.*isam2"),
        (("ekf", "isam2", "ekf"), "'ekf' is named twice"),
    ],
)
def test_estimators_are_checked_before_anything_runs(names: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        check_estimators(names)


@pytest.mark.parametrize("name", ["a/b", "..", ".hidden", "c\\d"])
def test_an_impossible_file_name_is_refused(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr("fgbaseline.reports.problem.settings.estimator_names", lambda: [name])
    with pytest.raises(InputError, match="cannot be a file name"):
        check_estimators((name,))


def test_the_simulated_drive_is_another_one_with_another_seed() -> None:
    one, other = (read_sequence(RunSettings(seed=seed)) for seed in (0, 1))
    assert one.n_frames == other.n_frames == 600
    assert not np.array_equal(one.linear_velocity, other.linear_velocity)


@pytest.mark.parametrize("estimators", [("isam2",), ("isam2", "batch"), ("ekf",)])
def test_batch_is_added_up_to_a_number_of_observations_where_it_has_the_answer_of_isam2(
    estimators: tuple[str, ...],
) -> None:
    n = int(PROBLEM.mask.sum())
    asked = RunSettings(estimators=estimators, batch_up_to=n)
    assert batch_is_added(PROBLEM, asked) == (estimators == ("isam2",))
    assert not batch_is_added(PROBLEM, replace(asked, batch_up_to=n - 1))
    run = solve(PROBLEM, asked)
    expected = ["isam2", "batch"] if "isam2" in estimators else ["ekf"]
    assert list(run.results) == expected
    assert run.settings["estimators"] == ",".join(expected)
    events = {str(event.kind) for event in run.results["batch"].estimate.events} if "batch" in run.results else set()
    assert ("started at isam2's solution only" in events) == (estimators == ("isam2",))
