"""Updates eliminate what came first first; that changes what they cost, and not what they find."""

from itertools import pairwise

import gtsam
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import diagnosis, smoother
from fgbaseline.data import Problem
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.diagnosis import NoiseSettings
from fgbaseline.smoother.graph.keys import AUXILIARY_POSE, distance_key, landmark_of, pose_key, state_keys
from fgbaseline.smoother.isam2 import estimator
from fgbaseline.smoother.isam2.elimination_ordering import GROUP_FRAMES, MANY_LANDMARKS, N_GROUPS, EliminationOrdering

LIFE = 3
"""frames that a landmark of these drives is seen"""


def key(landmark: int) -> int:
    return distance_key(landmark, 20.0)


def seen_at(frame: int) -> list[int]:
    """One new landmark a frame."""
    return [key(j) for j in range(max(0, frame - LIFE + 1), frame + 1)]


def test_older_variables_are_eliminated_first() -> None:
    ordering = EliminationOrdering()
    frame = 0
    for frame in range(2 * GROUP_FRAMES * N_GROUPS):
        groups = ordering.groups(frame, seen_at(frame))
    ages = [groups.get(pose_key(k), 0) for k in range(frame + 1)]
    assert all(a <= b for a, b in pairwise(ages))
    assert ages[0] == 0
    # A landmark goes with the frame that saw it last, and what the newest frame sees with that.
    last_sight = [groups.get(key(j), 0) for j in range(frame - LIFE + 1)]
    assert last_sight == ages[LIFE - 1 : frame]
    assert [groups[k] for k in seen_at(frame)] == [groups[pose_key(frame)]] * LIFE
    assert groups[pose_key(frame)] == max(ages) > ages[frame - 1]
    assert groups[AUXILIARY_POSE] == max(groups.values()) > groups[pose_key(frame)]


@pytest.mark.parametrize("inertial", [False, True])
def test_older_variables_are_those_of_frames_and_the_landmarks_last_seen_there(inertial: bool) -> None:
    ordering, n, first, frame = EliminationOrdering(inertial), 12, 3, 8
    for k in range(n):
        ordering.groups(k, seen_at(k))
    states = [key for k in range(first, frame) for key in state_keys(k, inertial)]
    landmarks = [key(j) for j in range(n) if first <= j + LIFE - 1 < frame]
    assert set(ordering.older(first, frame)) == {*states, *landmarks}
    assert ordering.older(frame, frame) == []


@given(st.lists(st.tuples(st.integers(0, 6), st.booleans()), min_size=1, max_size=60))
def test_no_group_is_beyond_the_number_of_variables(frames: list[tuple[int, bool]]) -> None:
    ordering, fresh_landmark = EliminationOrdering(), 0
    for frame, (n, all_new) in enumerate(frames):
        observed = [key(fresh_landmark + i) for i in range(n)]
        fresh_landmark += n
        groups = ordering.groups(frame, observed, all_new=all_new)
        variables = 2 + (frame > 0) + n
        assert max(groups.values()) < variables
        assert groups[AUXILIARY_POSE] > max(group for k, group in groups.items() if k != AUXILIARY_POSE)


def test_among_many_new_landmarks_only_the_pose_is_eliminated_last() -> None:
    crowd = list(map(key, range(MANY_LANDMARKS + 1)))
    assert EliminationOrdering().groups(5, crowd) == {pose_key(5): 1, AUXILIARY_POSE: 2}
    assert EliminationOrdering().groups(5, crowd, all_new=True) == {pose_key(5): 1, AUXILIARY_POSE: 2}


def test_where_all_landmarks_are_new_the_previous_frame_is_eliminated_late() -> None:
    groups = EliminationOrdering().groups(5, [key(0)], all_new=True)
    assert groups == {pose_key(4): 1, pose_key(5): 1, key(0): 1, AUXILIARY_POSE: 2}


def test_the_auxiliary_pose_is_no_landmark() -> None:
    assert landmark_of(AUXILIARY_POSE) is None


def short_drive() -> Problem:
    simulation = Simulation(duration=4.0, features_per_frame=15.0, seed=4, wrong_share=0.0)
    noise = NoiseSettings(simulation.sigma_pixel, simulation.sigma_linear, simulation.sigma_angular)
    return diagnosis.calibrated(simulate(simulation), settings=diagnosis.AsRecordedSettings(noise, shift=Shift.AFTER))


def test_the_order_does_not_change_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = short_drive()
    ours = smoother.isam2(problem)
    calls = []

    def last(_: EliminationOrdering, frame: int, __: list[int], **___: int) -> dict[int, int]:
        calls.append(frame)
        return {pose_key(frame): min(frame, 1), AUXILIARY_POSE: 1 + min(frame, 1)}

    monkeypatch.setattr(EliminationOrdering, "groups", last)
    other = smoother.isam2(problem)
    assert calls == list(range(problem.n_frames))
    np.testing.assert_allclose(ours.world_T_imu, other.world_T_imu, atol=1e-6)
    assert ours.covariance is not None
    assert other.covariance is not None
    np.testing.assert_allclose(ours.covariance, other.covariance, rtol=1e-4, atol=1e-12)
    a, b = ours.by_products["isam2-online"], other.by_products["isam2-online"]
    np.testing.assert_allclose(a.world_T_imu, b.world_T_imu, atol=2e-3)
    assert a.covariance is not None
    assert b.covariance is not None
    sigmas = [np.sqrt(np.einsum("nii->ni", covariance)) for covariance in (a.covariance, b.covariance)]
    np.testing.assert_allclose(*sigmas, rtol=0.01)


def test_the_tail_leaves_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    graphs = []
    final = estimator._final_solution

    def kept(*arguments: object) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        graphs.append(final(*arguments))
        return graphs[-1]

    monkeypatch.setattr(estimator, "_final_solution", kept)
    smoother.isam2(short_drive())
    ((graph, values),) = graphs
    assert not values.exists(AUXILIARY_POSE)
    keys = {key for i in range(graph.size()) for key in list(graph.at(i).keys())}
    assert pose_key(0) in keys
    assert AUXILIARY_POSE not in keys


@given(st.lists(st.tuples(st.integers(0, 9), st.booleans(), st.booleans()), min_size=1, max_size=70), st.booleans())
def test_a_variable_is_in_the_group_of_the_frame_that_observed_it_last(
    frames: list[tuple[int, bool, bool]], inertial: bool
) -> None:
    """Landmarks of one frame stay, come back or are removed; velocities and biases are in the group of their pose."""
    ordering, fresh = EliminationOrdering(inertial), 0
    alive: list[int] = []
    last_frame: dict[int, int] = {}
    for frame, (n, remove, back) in enumerate(frames):
        observed = [*alive[-n // 2 :], *(alive[:2] if back else []), *(key(fresh + i) for i in range(n))]
        observed, fresh = list(dict.fromkeys(observed)), fresh + n
        if remove and frame > 0:
            ordering.remove(observed[:1])
            last_frame.pop(next(iter(observed), -1), None)
            observed = observed[1:]
        alive = observed
        last_frame |= dict.fromkeys([*state_keys(frame, inertial), *observed], frame)
        last = min(N_GROUPS, len(observed) + (frame > 0))
        age = {k: (frame - 1) // GROUP_FRAMES - k // GROUP_FRAMES for k in range(frame)}
        groups = {name: last - 1 - age[k] for name, k in last_frame.items() if k < frame}
        groups |= dict.fromkeys(observed, last) | dict.fromkeys(state_keys(frame, inertial), last + inertial)
        groups[AUXILIARY_POSE] = last + 1 + inertial
        listed = ordering.groups(frame, observed)  # those that are not listed are in group 0
        assert positive(listed) == positive(groups)


def positive(groups: dict[int, int]) -> dict[int, int]:
    """Groups that are eliminated after the first."""
    return {name: group for name, group in groups.items() if group > 0}
