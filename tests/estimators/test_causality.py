"""Filters are causal: what they report up to frame k does not depend on what is recorded after it.

The problem's mask, noise, features and priors are held; velocities and observations after frame k change.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from fgbaseline import data, diagnosis, ekf, smoother
from fgbaseline.data import Estimate, Excluded, Observations, Problem
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.ekf import JointSettings
from fgbaseline.smoother import FixedLagSettings, ISAM2Settings

from ..builders.synthetic import drive, matched

TOLERANCE = 1e-9
LAG = 1.0
"""s, of the fixed-lag smoother on simulated drives"""
SHORT = ISAM2Settings(tree_frames=50, kept_frames=20)
"""a tree that is exchanged several times in a short drive"""


@dataclass(frozen=True)
class Filter:
    """An estimator, and how many seconds behind the newest frame it reports."""

    solve: Callable[[Problem], Estimate]
    lag: float = 0.0


def online(problem: Problem, settings: ISAM2Settings | None = None) -> Estimate:
    return smoother.isam2(problem, settings=settings).by_products["isam2-online"]


FILTERS = {
    "ekf": Filter(ekf.ekf),
    "joint-ekf": Filter(ekf.joint_ekf),
    "joint-ekf-ungated": Filter(ekf.joint_ekf_ungated),
    "joint-ekf-bias": Filter(ekf.joint_ekf_bias),
    "joint-ekf-textbook": Filter(ekf.joint_ekf_textbook),
    "joint-ekf-first-estimate": Filter(ekf.joint_ekf_first_estimate),
    "joint-ekf, few places": Filter(lambda problem: ekf.joint_ekf(problem, settings=JointSettings(max_landmarks=15))),
    "isam2-online": Filter(online),
    "isam2-online, short trees": Filter(lambda problem: online(problem, SHORT)),
    "fixed-lag": Filter(lambda problem: smoother.fixed_lag(problem, settings=FixedLagSettings(LAG)), LAG),
}
RECORDED = {name: FILTERS[name] for name in ("ekf", "joint-ekf", "isam2-online", "isam2-online, short trees")} | {
    "fixed-lag": Filter(smoother.fixed_lag, FixedLagSettings().lag)
}


def other_future(problem: Problem, k: int, seed: int, ends: float, moved: float) -> Problem:
    """The problem with other velocities and observations after frame k: a share `ends` of the tracks ends there,
    twice as many others come back, and pixels are off by `moved` px."""
    random, width = np.random.default_rng(seed), problem.sequence.n_landmarks
    o = problem.sequence.observations
    increment = problem.increment.copy()
    increment[k:] += 0.02 * random.normal(size=increment[k:].shape)
    future = o.frame > k
    pixel = o.pixel + moved * random.normal(size=o.pixel.shape) * future[:, None]
    ended = problem.features[random.random(len(problem.features)) < ends]
    stays = ~(future & np.isin(o.landmark, ended))
    frame, landmark, pixel, excluded = (a[stays] for a in (o.frame, o.landmark, pixel, problem.excluded))
    old = np.flatnonzero((frame <= k) & (excluded == Excluded.NO))
    if k + 1 < problem.n_frames and len(old) > 0:
        back = random.choice(old, 2 * len(ended) + 3)
        again = random.integers(k + 1, problem.n_frames, len(back))
        new = ~np.isin(again * width + landmark[back], frame * width + landmark)
        back, again = back[new], again[new]
        _, first = np.unique(again * width + landmark[back], return_index=True)
        back, again = back[first], again[first]
        frame, landmark = np.append(frame, again), np.append(landmark, landmark[back])
        pixel, excluded = np.concatenate([pixel, pixel[back]]), np.append(excluded, excluded[back])
    order = np.lexsort((landmark, frame))
    observations = Observations(frame[order], landmark[order], pixel[order])
    sequence = replace(problem.sequence, observations=observations)
    return replace(problem, sequence=sequence, increment=increment, excluded=excluded[order])


def assert_same_until(k: int, filter_: Filter, a: Estimate, other: Problem) -> None:
    """The answer `a` up to frame k is that to a problem with another future."""
    b, t = filter_.solve(other), other.sequence.t
    known = t[: k + 1] <= t[k] - filter_.lag
    n = int(np.count_nonzero(known))
    np.testing.assert_allclose(a.world_T_imu[:n], b.world_T_imu[:n], rtol=0, atol=TOLERANCE)
    assert a.covariance is not None
    assert b.covariance is not None
    np.testing.assert_allclose(a.covariance[:n], b.covariance[:n], rtol=0, atol=TOLERANCE)


def with_gaps(path: str, seed: int) -> Problem:
    """A drive of 6 s where half of the landmarks are lost for a while and found again."""
    simulation = Simulation(
        path=path,  # type: ignore[arg-type]
        duration=6.0,
        features_per_frame=15.0,
        returning_share=0.5,
        return_after=0.5,
        track_length=6.0,
        wrong_share=0.02,
        seed=seed,
    )
    return matched(simulate(simulation))


PROBLEMS = {path: with_gaps(path, seed) for seed, path in enumerate(("town", "handheld"), 1)}


@cache
def answer(name: str, path: str) -> Estimate:
    return FILTERS[name].solve(PROBLEMS[path])


@pytest.mark.parametrize("name", FILTERS)
@settings(
    max_examples=5, derandomize=True, deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)
@given(
    path=st.sampled_from(sorted(PROBLEMS)),
    k=st.integers(2, 58),
    seed=st.integers(0, 1000),
    ends=st.sampled_from([0.0, 0.5, 1.0]),
    moved=st.sampled_from([0.0, 1.0, 100.0]),
)
def test_online_estimates_are_causal(name: str, path: str, k: int, seed: int, ends: float, moved: float) -> None:
    problem = PROBLEMS[path]
    assert_same_until(k, FILTERS[name], answer(name, path), other_future(problem, k, seed, ends, moved))


def test_the_tree_is_exchanged_causally() -> None:
    problem, filter_ = matched(drive(seconds=12.0, features_per_frame=15.0)), FILTERS["isam2-online, short trees"]
    assert_same_until(100, filter_, filter_.solve(problem), other_future(problem, 100, 0, 0.5, 1.0))


@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize(
    ("recording", "frames"),
    [("utias/dataset3.mat", 300), ("utias/2011_09_26_drive_0001_sync_KLT.mat", 70), ("03.npz", 90)],
)
def test_nor_on_real_recordings(recordings: Callable[[str], Path], recording: str, frames: int, name: str) -> None:
    problem, k = recorded(recordings(recording), frames), frames // 2
    filter_ = RECORDED[name]
    assert_same_until(k, filter_, filter_.solve(problem), other_future(problem, k, 0, 0.5, 1.0))


@cache
def recorded(path: Path, frames: int) -> Problem:
    return truncated(diagnosis.calibrated(data.read(path), settings=diagnosis.AsRecordedSettings()), frames)


def truncated(problem: Problem, frames: int) -> Problem:
    """Its first frames."""
    sequence, o = problem.sequence, problem.sequence.observations
    early = o.frame < frames
    shorter = replace(
        sequence,
        t=sequence.t[:frames],
        linear_velocity=sequence.linear_velocity[:frames],
        angular_velocity=sequence.angular_velocity[:frames],
        observations=o.select(early),
        truth=None,
    )
    return replace(
        problem,
        sequence=shorter,
        increment=problem.increment[: frames - 1],
        increment_covariance=problem.increment_covariance[: frames - 1],
        excluded=problem.excluded[early],
    )
