"""The tree is over the end of a long drive only: what is found, and what goes wrong, is as it would be in one tree."""

from dataclasses import replace
from typing import Any

import gtsam
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import smoother
from fgbaseline.data import Estimate, LandmarkPrior, Observations, Problem, Status
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.smoother import ISAM2Settings
from fgbaseline.smoother.errors import IndeterminateSystemError
from fgbaseline.smoother.graph.keys import landmark_of
from fgbaseline.smoother.initialization.initial_values import triangulate_along
from fgbaseline.smoother.isam2.checkpointed_isam2 import CheckpointedISAM2
from fgbaseline.smoother.isam2.incremental_smoother import IncrementalSmoother
from fgbaseline.smoother.isam2.marginalized_isam2 import UNSEEN_FRAMES, MarginalizedISAM2, marginalization_horizon

from ..builders.synthetic import drive, matched

SHORT = ISAM2Settings(tree_frames=50, kept_frames=20)
LONG = ISAM2Settings(tree_frames=10_000)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return matched(drive(seconds=15.0, features_per_frame=15.0))


@pytest.fixture(scope="module")
def whole(problem: Problem) -> Estimate:
    return smoother.isam2(problem, settings=LONG)


@pytest.fixture
def exchanged(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """For each exchange its first frame, and how many poses the new tree has."""
    windows: list[tuple[int, int]] = []
    shortened = MarginalizedISAM2.marginalize_before

    def watched(self: MarginalizedISAM2, first: int, groups: dict[int, int]) -> bool:
        done = shortened(self, first, groups)
        if done:
            point = self.tree.getLinearizationPoint()
            windows.append((first, sum(chr(key >> 56) == "x" for key in point.keys())))  # noqa: SIM118
        return done

    monkeypatch.setattr(MarginalizedISAM2, "marginalize_before", watched)
    return windows


def sigmas(estimate: Estimate) -> np.ndarray:
    assert estimate.covariance is not None
    return np.sqrt(np.einsum("nii->ni", estimate.covariance))


def assert_alike(a: Estimate, b: Estimate, online: float) -> None:
    """The same in the end; what was known online within `online` m."""
    assert a.status is b.status is Status.OK
    np.testing.assert_array_equal(a.used, b.used)
    np.testing.assert_allclose(a.world_T_imu, b.world_T_imu, atol=2e-5)  # where Gauss-Newton stops
    np.testing.assert_allclose(sigmas(a), sigmas(b), rtol=1e-4, atol=1e-12)
    np.testing.assert_array_equal(a.landmarks.index, b.landmarks.index)
    now, then = (e.by_products["isam2-online"] for e in (a, b))
    np.testing.assert_allclose(now.world_T_imu, then.world_T_imu, atol=online)
    np.testing.assert_allclose(sigmas(now), sigmas(then), rtol=0.03)


def test_short_trees_find_what_one_tree_finds(
    problem: Problem, whole: Estimate, exchanged: list[tuple[int, int]]
) -> None:
    short = smoother.isam2(problem, settings=SHORT)
    assert len(exchanged) >= 2
    assert max(poses for _, poses in exchanged) < problem.n_frames / 2
    assert_alike(short, whole, online=1e-2)


def test_a_tree_is_exchanged_for_an_equal_one(problem: Problem) -> None:
    increments = IncrementalSmoother(problem, LONG)
    increments.run(np.zeros(problem.n_frames), None)
    last, tree = problem.n_frames - 1, increments.solver.tree
    poses = [gtsam.symbol("x", k) for k in range(last - 30, last + 1)]
    before = [tree.calculateEstimatePose3(key).matrix() for key in poses], tree.marginalCovariance(poses[-1])
    first = min(last - 30, marginalization_horizon(problem.observations(), last))
    assert increments.solver.marginalize_before(first, increments._ordering.batch_groups(first, last))
    assert increments.solver.tree is not tree
    tree = increments.solver.tree
    np.testing.assert_allclose([tree.calculateEstimatePose3(key).matrix() for key in poses], before[0], atol=1e-4)
    np.testing.assert_allclose(tree.marginalCovariance(poses[-1]), before[1], rtol=1e-3, atol=1e-9)


def test_under_landmark_priors_too(problem: Problem, exchanged: list[tuple[int, int]]) -> None:
    near = triangulate_along(problem, problem.observations(), smoother.isam2(problem).world_T_imu)
    position = np.full((len(problem.features), 3), np.nan)
    position[problem.feature_row(near.index)] = near.position
    assert np.isfinite(position).all()
    known = replace(problem, landmark_prior=LandmarkPrior(position, np.eye(3)))
    short, one = (smoother.isam2(known, settings=settings) for settings in (SHORT, LONG))
    assert exchanged
    assert_alike(short, one, online=1e-2)


def test_returning_landmarks_restore_the_full_tree(
    exchanged: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    back, restored = [0], MarginalizedISAM2.restore_all

    def counted(self: MarginalizedISAM2, groups: dict[int, int]) -> bool:
        back[0] += 1
        return restored(self, groups)

    monkeypatch.setattr(MarginalizedISAM2, "restore_all", counted)
    settings = Simulation(path="handheld", duration=6.0, features_per_frame=40.0, track_length=30.0, wrong_share=0.0)
    problem = matched(simulate(settings))
    o = problem.sequence.observations
    dark = (o.frame >= 20) & (o.frame < 25)
    assert len(np.intersect1d(o.landmark[o.frame < 20], o.landmark[o.frame >= 25])) > 3
    problem = replace(problem, excluded=np.where(dark, np.uint8(1), problem.excluded))
    short = smoother.isam2(problem, settings=ISAM2Settings(tree_frames=10, kept_frames=2))
    assert exchanged
    assert 0 < back[0] < 4
    assert_alike(short, smoother.isam2(problem, settings=LONG), online=1e-2)


def test_without_a_way_back_a_landmark_that_comes_back_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = matched(drive(seconds=15.0, features_per_frame=15.0))
    o = problem.sequence.observations
    old = int(o.landmark[o.frame == 0][0])
    again = replace(problem.sequence, observations=with_sight(o, int(o.frame.max()), old))
    returning = replace(problem, sequence=again, excluded=np.append(problem.excluded, np.uint8(0)))
    monkeypatch.setattr(MarginalizedISAM2, "restore_all", lambda *_: False)
    estimate = smoother.isam2(returning, settings=SHORT)
    (event,) = (event for event in estimate.events if event.kind == "landmark dropped")
    assert (event.frame, event.landmark) == (o.frame.max(), old)
    assert estimate.status is Status.RECOVERED


def with_sight(o: Observations, frame: int, landmark: int) -> Observations:
    """One more, with the pixels of the landmark's first."""
    assert not np.any((o.frame == frame) & (o.landmark == landmark))
    pixel = o.pixel[o.landmark == landmark][:1]
    return Observations.sort(
        np.append(o.frame, frame), np.append(o.landmark, landmark), np.concatenate([o.pixel, pixel])
    )


sights = st.lists(st.tuples(st.integers(0, 11), st.integers(0, 5)), unique=True, max_size=30)


@given(sights)
def test_the_earliest_frame_is_that_of_the_tracks_that_are_alive(seen: list[tuple[int, int]]) -> None:
    frame, landmark = np.array(sorted(seen), dtype=np.int64).reshape(-1, 2).T
    o = Observations(frame, landmark, np.zeros((len(frame), 4)))
    for k in range(12):
        alive = {j for a, j in seen if k - UNSEEN_FRAMES <= a <= k}
        assert marginalization_horizon(o, k) == min((a for a, j in seen if a <= k and j in alive), default=k + 1)


def test_a_failed_exchange_changes_nothing(
    problem: Problem, whole: Estimate, exchanged: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def indeterminate(*_: object) -> None:
        raise RuntimeError("made up")

    monkeypatch.setattr(gtsam.GaussianFactorGraph, "marginal", indeterminate)
    same = smoother.isam2(problem, settings=SHORT)
    assert exchanged == []
    np.testing.assert_array_equal(same.world_T_imu, whole.world_T_imu)


@pytest.mark.parametrize(("frame", "new"), [(4, True), (4, False), (60, False)])
def test_a_failure_costs_the_landmark_that_is_named(
    problem: Problem, frame: int, new: bool, exchanged: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    # In a small tree GTSAM orders everything anew, and takes no group of a variable that it does not have; in a tree
    # that was exchanged, a prior speaks of landmarks whose factors are gone.
    update, named = CheckpointedISAM2.update, list[int]()

    def failing(
        self: CheckpointedISAM2,
        factors: gtsam.NonlinearFactorGraph,
        values: gtsam.Values,
        *rest: Any,
        **others: Any,
    ) -> gtsam.ISAM2Result:
        entering = values.keys()
        if not named and any(gtsam.symbol("x", k) in entering for k in range(frame, frame + 10)):
            seen = [key for key in factors.keyVector() if landmark_of(key) is not None]
            named.extend(sorted(key for key in seen if (key in entering) == new)[:1])
            if named:
                raise IndeterminateSystemError(named[0], "made up")
        return update(self, factors, values, *rest, **others)

    monkeypatch.setattr(CheckpointedISAM2, "update", failing)
    estimate = smoother.isam2(problem, settings=SHORT)
    (landmark,) = map(landmark_of, named)
    assert exchanged
    assert estimate.status is Status.RECOVERED
    (event,) = (event for event in estimate.events if event.kind != "landmark never determined")
    assert (event.kind, event.landmark) == ("landmark dropped", landmark)
    assert frame <= event.frame < frame + 10
    assert landmark not in estimate.landmarks.index
    o = problem.sequence.observations
    assert not estimate.used[o.landmark == landmark].any()
    monkeypatch.undo()
    without = replace(problem, excluded=np.where(o.landmark == landmark, np.uint8(1), problem.excluded))
    np.testing.assert_allclose(estimate.world_T_imu, smoother.isam2(without, settings=LONG).world_T_imu, atol=1e-4)
