"""Consistency of the joint filter on drives with known noise, and the effect of its linearization.

`pytest -s tests/ekf/test_joint_ekf_consistency.py` prints the mean NEES (6 if all is right) over 10 seeds.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fgbaseline import ekf
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.ekf import JointSettings, LandmarkRepresentation, Linearization
from fgbaseline.geometry import FloatArray, se3

from ..builders.synthetic import matched

SEEDS = 10
FRAMES = (1, 5, 10, 20, 50, 100, 199)
WAYS = {f"{c}, {way}": JointSettings(c, way) for c in LandmarkRepresentation for way in Linearization}


@cache
def mean_nees(path: PathName, way: str) -> FloatArray:
    """(T,) the mean over seeds of e^T P^-1 e of the pose; NaN at frame 0, which is held."""
    total = np.zeros(200)
    for seed in range(SEEDS):
        sequence = simulate(Simulation(path=path, duration=20.0, features_per_frame=30.0, seed=seed, wrong_share=0.0))
        estimate = ekf.joint_ekf(replace(matched(sequence), kernel=None), settings=WAYS[way])
        assert estimate.covariance is not None
        assert sequence.truth is not None
        error = se3.log(se3.inverse(estimate.world_T_imu) @ sequence.truth.world_T_imu)[1:]
        total[0] = np.nan
        total[1:] += np.einsum("ni,ni->n", error, np.linalg.solve(estimate.covariance[1:], error[:, :, None])[:, :, 0])
    return total / SEEDS


@pytest.mark.slow
@pytest.mark.parametrize("path", ["town", "handheld"])
def test_the_invariant_filter_is_consistent_and_the_textbook_one_overconfident(path: PathName) -> None:
    print(f"\n{path:38s}" + "".join(f"{f'frame {k}':>11s}" for k in FRAMES) + f"{'all':>11s}")
    for way in (
        "inverse-depth, invariant",
        "inverse-depth, textbook",
        "inverse-depth, first-estimate",
        "world, textbook",
    ):
        nees = mean_nees(path, way)
        print(f"{way:38s}" + "".join(f"{nees[k]:11.1f}" for k in FRAMES) + f"{np.nanmean(nees):11.1f}")
    ours = mean_nees(path, "inverse-depth, invariant")
    # 60 degrees of freedom over 10: 99.9 % of chi-square lie in 3.2 to 10.2; the times of one run hang together.
    assert np.all((ours[list(FRAMES)] > 2.5) & (ours[list(FRAMES)] < 12.0))
    assert 4.0 < np.nanmean(ours) < 9.0
    textbook = mean_nees(path, "world, textbook")
    assert np.nanmean(textbook) > np.nanmean(ours)
    assert np.nanmean(textbook[100:]) > np.nanmean(ours[100:])
    first_estimate = mean_nees(path, "inverse-depth, first-estimate")
    assert np.nanmean(first_estimate) < np.nanmean(mean_nees(path, "inverse-depth, textbook"))


def test_all_linearizations_agree_in_a_nearly_linear_problem() -> None:
    # With a fiftieth of the noise the updates are small, and all ways of linearizing say the same.
    sequence = simulate(
        Simulation(
            path="handheld",
            duration=3.0,
            features_per_frame=20.0,
            wrong_share=0.0,
            sigma_pixel=0.02,
            sigma_linear=0.002,
            sigma_angular=0.0002,
        )
    )
    assumed = matched(sequence)  # of 0.1 m/s and 0.01 rad/s
    problem = replace(
        assumed, kernel=None, pixel_variance=0.02**2, increment_covariance=assumed.increment_covariance * 0.02**2
    )
    answers = [ekf.joint_ekf(problem, settings=how) for how in WAYS.values()]
    for other in answers[1:]:
        assert other.covariance is not None
        assert answers[0].covariance is not None
        apart = se3.log(se3.inverse(answers[0].world_T_imu[1:]) @ other.world_T_imu[1:])
        sigma = np.sqrt(np.einsum("nii->ni", answers[0].covariance[1:]))
        assert np.abs(apart / sigma).max() < 0.1
