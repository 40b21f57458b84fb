"""Every estimator with the true noise is consistent; benchmarks/consistency.py tests it on 50 longer drives."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import compare, ekf, smoother
from fgbaseline.data import Estimate, Excluded, Problem, Truth

from ..builders.synthetic import drive, matched

SEEDS = 10
FRAMES = np.arange(5, 70, 7)


def true_noise_problem(seed: int) -> Problem:
    """A drive of 7 s with its own noise, every observation taking part and none softened: there is no wrong match."""
    sequence = drive("town", seconds=7.0, features_per_frame=15.0, seed=seed)
    problem = matched(sequence)
    everything = np.full_like(problem.excluded, Excluded.NO)
    return replace(problem, kernel=None, excluded=everything, features=np.unique(sequence.observations.landmark))


@cache
def smoothed(seed: int) -> dict[str, Estimate]:
    """The three answers of the smoothers."""
    batch = smoother.batch(true_noise_problem(seed))
    return {"batch": batch, **batch.by_products}


@cache
def truth(seed: int) -> Truth:
    known = true_noise_problem(seed).sequence.truth
    assert known is not None
    return known


ESTIMATORS: dict[str, Callable[[int], Estimate]] = {
    "batch": lambda seed: smoothed(seed)["batch"],
    "isam2": lambda seed: smoothed(seed)["isam2"],
    "isam2-online": lambda seed: smoothed(seed)["isam2-online"],
    "joint-ekf": lambda seed: ekf.joint_ekf(true_noise_problem(seed)),
    "joint-ekf-first-estimate": lambda seed: ekf.joint_ekf_first_estimate(true_noise_problem(seed)),
}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_the_mean_nees_of_the_pose_is_that_of_a_consistent_estimator(name: str) -> None:
    table = compare.anees((ESTIMATORS[name](seed), truth(seed)) for seed in range(SEEDS))
    assert (table.loc[FRAMES, "runs"] == SEEDS).all()
    mean = table.loc[FRAMES, "anees"]
    low, high = chi2.ppf([5e-4, 1.0 - 5e-4], 6 * SEEDS) / SEEDS
    assert ((low < mean) & (mean < high)).all()
    assert 4.5 < table.loc[1:, "anees"].mean() < 8.0


def test_an_estimator_with_half_the_noise_is_overconfident() -> None:
    runs = []
    for seed in range(SEEDS):
        problem = true_noise_problem(seed)
        boastful = replace(
            problem,
            pixel_variance=problem.pixel_variance / 4.0,
            increment_covariance=problem.increment_covariance / 4.0,
        )
        runs.append((ekf.joint_ekf(boastful), truth(seed)))
    table = compare.anees(runs)
    high = chi2.ppf(1.0 - 5e-4, 6 * SEEDS) / SEEDS
    assert (table.loc[FRAMES, "anees"] > high).mean() > 0.8
