"""Over a gap the velocity is as unknown as it is elsewhere after such a time."""

from dataclasses import replace

import numpy as np
import pytest

from fgbaseline import data, diagnosis
from fgbaseline.data.problem.velocity_gaps import gaps, inflate_gap_covariance, random_walk_density
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.geometry import se3

from ..builders.hostile import gap
from ..builders.synthetic import DT, Scene, plain_problem


def wandering_problem(q: float, frames: int = 4000, hole: float = 0.0) -> data.Problem:
    """Velocities that wander with density q, under noise of 0.1 m/s and 0.01 rad/s; a hole in the middle."""
    random = np.random.default_rng(0)
    scene = Scene(frames=frames, n_points=1).sequence()
    walk = np.cumsum(np.sqrt(q * DT) * random.normal(size=(frames, 6)), axis=0)
    u = walk + np.repeat([0.1, 0.01], 3) * random.normal(size=walk.shape)
    t = scene.t + hole * (np.arange(frames) >= frames // 2)
    return plain_problem(replace(scene, t=t, linear_velocity=u[:, :3], angular_velocity=u[:, 3:], truth=None))


@pytest.mark.parametrize("q", [0.01, 1.0])
def test_the_density_of_a_random_walk_is_found(q: float) -> None:
    problem = wandering_problem(q, hole=1.0)
    found = random_walk_density(problem, gaps(problem.sequence.dt))
    assert (found > 0.5 * q).all()
    assert (found < 2.0 * q).all()


def test_noise_alone_is_no_wandering() -> None:
    problem = wandering_problem(0.0, hole=1.0)
    assert (random_walk_density(problem, gaps(problem.sequence.dt)) < 3e-3).all()


def test_a_recording_without_gaps_is_unchanged() -> None:
    problem = wandering_problem(1.0, frames=50)
    assert inflate_gap_covariance(problem) is problem


def test_only_the_gap_is_made_uncertain_and_a_longer_one_more_so() -> None:
    before, short, long = (wandering_problem(0.01, 400, hole) for hole in (0.0, 2.0, 8.0))
    k = int(np.argmax(gaps(short.sequence.dt)))
    added = []
    for problem in (short, long):
        admitted = inflate_gap_covariance(problem)
        extra = admitted.increment_covariance - problem.increment_covariance
        assert np.array_equal(np.flatnonzero(np.abs(extra).max(axis=(1, 2))), [k])
        assert (np.linalg.eigvalsh(extra[k]) > 0.0).all()
        assert "the velocity may have changed" in admitted.remarks[-1]
        added.append(np.trace(extra[k][:3, :3]))
    assert added[1] > 30.0 * added[0]
    assert len(before.increment) == len(short.increment)


@pytest.mark.parametrize("settings", [None, diagnosis.AsRecordedSettings(shift=Shift.AFTER)])
def test_the_calibrated_problem_allows_for_gaps_diagnosed_or_not(settings: diagnosis.AsRecordedSettings | None) -> None:
    sequence = gap()
    problem = diagnosis.calibrated(sequence, settings=settings)
    sigma = np.sqrt(problem.increment_covariance[29, 0, 0])
    assert sequence.dt[29] == pytest.approx(10.1)
    assert sigma > 5.0
    assert any("gaps between frames" in remark for remark in problem.remarks)


def test_its_jacobian_is_the_derivative_of_the_motion_however_far_that_goes() -> None:
    twist, step = np.array([80.0, 3.0, -2.0, 0.1, -0.2, 2.5]), 1e-6
    there = se3.inverse(se3.exp(twist))
    columns = [
        (se3.log(there @ se3.exp(twist + d)) - se3.log(there @ se3.exp(twist - d))) / (2 * step)
        for d in step * np.eye(6)
    ]
    np.testing.assert_allclose(se3.right_jacobian(twist), np.column_stack(columns), atol=1e-5)
