"""More landmarks than the joint filter has places for: it ends, says what it left out, and knows its errors."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import ekf
from fgbaseline.data import Estimate, LandmarkPrior, Problem, Sequence, Status
from fgbaseline.ekf import JointSettings
from fgbaseline.ekf.joint.feature_selection import CELL, select_features
from fgbaseline.geometry import FloatArray, se3

from ..builders.hostile import CROWD, CROWD_FRAMES, HALF, base, crowd
from ..builders.synthetic import Scene, drive, matched, plain_problem

CAP = JointSettings().max_landmarks


def turned_away(estimate: Estimate) -> dict[int, int]:
    """How many observations each frame left out because the state was full."""
    full = [event for event in estimate.events if event.kind == "state full"]
    return {event.frame: int(event.reason.split(" of ")[0]) for event in full}


def sigmas(estimate: Estimate, sequence: Sequence) -> float:
    """Root of the mean NEES per degree of freedom of the pose; frame 0 is held."""
    assert estimate.covariance is not None
    assert sequence.truth is not None
    error = se3.log(se3.inverse(estimate.world_T_imu) @ sequence.truth.world_T_imu)[1:, :, None]
    return float(np.sqrt(np.mean(np.swapaxes(error, 1, 2) @ np.linalg.solve(estimate.covariance[1:], error)) / 6.0))


def most_at_once(problem: Problem) -> int:
    """The largest number of landmarks at a frame between their first observation and the last of the frames without
    one for which the filter keeps them."""
    o = problem.observations()
    first = np.unique(o.landmark, return_index=True)[1]
    last = len(o) - 1 - np.unique(o.landmark[::-1], return_index=True)[1]
    begun, ended = (np.bincount(o.frame[at], minlength=problem.n_frames) for at in (first, last))
    ended = np.append(np.zeros(JointSettings().unseen_frames, dtype=np.int64), ended)[: problem.n_frames]
    return int((np.cumsum(begun) - np.cumsum(ended) + ended).max())


@pytest.mark.parametrize("cap", [60, CAP])
def test_many_landmarks_at_once_leave_a_consistent_covariance(cap: int) -> None:
    sequence = crowd()
    problem = matched(sequence)
    estimate = ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=cap))
    alone = ekf.joint_ekf(matched(base()))
    assert sigmas(estimate, sequence) < 1.5
    # The few features of the crowd that were used improve the estimate.
    assert estimate.covariance is not None
    assert alone.covariance is not None
    last = HALF + CROWD_FRAMES - 1
    assert np.linalg.det(estimate.covariance[last]) < np.linalg.det(alone.covariance[last])
    o = problem.observations()
    used = estimate.used[problem.mask]
    assert np.bincount(o.frame[used]).max() <= cap
    assert np.bincount(o.frame).max() > CROWD
    # Nothing is left out in silence.
    left_out = turned_away(estimate)
    assert list(left_out) == [HALF, HALF + 1, HALF + 2]
    assert sum(left_out.values()) == np.count_nonzero(~used)
    assert estimate.status is Status.RECOVERED
    assert f"the state was full: {np.count_nonzero(~used)} observations were not used" in estimate.reason
    never = {e.landmark for e in estimate.events if e.reason == "the state was full while it was observed"}
    assert never == set(np.setdiff1d(o.landmark, o.landmark[used]).tolist())


def test_a_recording_below_the_cap_is_unchanged_to_the_bit() -> None:
    problem = matched(drive("town", seconds=6.0, features_per_frame=40.0, wrong=0.05))
    most = most_at_once(problem)
    assert most < CAP
    at_default, just_enough = (ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=n)) for n in (CAP, most))
    np.testing.assert_array_equal(just_enough.world_T_imu, at_default.world_T_imu)
    np.testing.assert_array_equal(just_enough.covariance, at_default.covariance)
    np.testing.assert_array_equal(just_enough.landmarks.position, at_default.landmarks.position)
    np.testing.assert_array_equal(just_enough.used, at_default.used)
    assert just_enough.events == at_default.events
    assert not turned_away(just_enough)
    observed = int(np.bincount(problem.observations().frame).max())
    assert turned_away(ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=observed - 1)))


def test_landmarks_without_an_observation_give_their_places_to_those_with_one() -> None:
    problem = matched(drive("town", seconds=6.0, features_per_frame=40.0, wrong=0.05))
    observed = int(np.bincount(problem.observations().frame).max())
    assert observed < most_at_once(problem)
    assert not turned_away(ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=observed)))


def test_deferred_landmarks_are_initialized_when_others_are_marginalized() -> None:
    sequence = drive("town", seconds=6.0, features_per_frame=40.0)
    problem = matched(sequence)
    estimate = ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=15))
    o, used = problem.observations(), estimate.used[problem.mask]
    waited = np.setdiff1d(o.landmark[~used], o.landmark[used], assume_unique=False)
    late = np.intersect1d(o.landmark[~used], o.landmark[used])
    assert len(late) > 5
    for j in late:
        mine = used[o.landmark == j]
        assert not mine[: np.argmax(mine)].any()
        assert mine[np.argmax(mine) :].all()
    assert np.isin(late, estimate.landmarks.index).mean() > 0.9
    assert not np.isin(waited, estimate.landmarks.index).any()
    assert sigmas(estimate, sequence) < 1.5


def test_landmarks_with_a_prior_are_deferred_too() -> None:
    scene = Scene().sequence()
    assert scene.truth is not None
    assert scene.truth.landmarks is not None
    prior = LandmarkPrior(scene.truth.landmarks, 0.01 * np.eye(3))
    problem = replace(plain_problem(scene), landmark_prior=prior)
    estimate = ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=5))
    assert np.bincount(scene.observations.frame[estimate.used]).tolist() == [5] * 10
    assert len(np.unique(scene.observations.landmark[estimate.used])) == 5
    assert len(estimate.landmarks) == 5
    assert sum(turned_away(estimate).values()) == 7 * 10


def sights(random: np.random.Generator, n: int) -> FloatArray:
    """Rows (n, 3) anywhere in an image."""
    left, disparity, down = random.uniform(0, 1241, n), random.uniform(0, 80, n), random.uniform(0, 376, n)
    return np.column_stack([left, left - disparity, down])


@given(st.integers(0, 10_000), st.integers(0, 300), st.integers(0, 100), st.integers(-3, 320))
def test_the_state_is_filled_to_its_capacity_and_no_further(seed: int, n: int, inside: int, places: int) -> None:
    random = np.random.default_rng(seed)
    selected = select_features(sights(random, n), sights(random, inside), places)
    assert np.count_nonzero(selected) == min(n, max(places, 0))


def test_places_go_round_the_image_and_to_the_nearest_of_each_place() -> None:
    def row(cell: int, disparity: float) -> list[float]:
        left = (cell + 0.5) * CELL
        return [left, left - disparity, 10.0]

    candidates = np.array([row(0, 40.0), row(0, 39.0), row(0, 38.0), row(1, 1.0), row(1, 2.0), row(2, 0.5)])
    none = np.empty((0, 3))
    np.testing.assert_array_equal(select_features(candidates, none, 3), [True, False, False, False, True, True])
    np.testing.assert_array_equal(select_features(candidates, none, 4), [True, True, False, False, True, True])
    # Where some of the first cell are in the state already, others come first.
    inside = np.array([row(0, 5.0), row(0, 6.0)])
    np.testing.assert_array_equal(select_features(candidates, inside, 3), [False, False, False, True, True, True])
