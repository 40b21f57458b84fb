"""What must come out of the real recordings with default settings: iSAM2 is not worse than what it starts from."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, smoother
from fgbaseline.data import Estimate, Problem, find_estimator, read
from fgbaseline.diagnosis import calibrated
from fgbaseline.geometry import disparity

from ..builders.synthetic import first_frames

Recordings = Callable[[str], Path]


def ate(problem: Problem, estimate: Estimate) -> float:
    truth = problem.sequence.truth
    assert truth is not None
    return compare.summarized(compare.truth_errors(estimate, truth, aligned=True)["position"])["rmse"]


def errors(problem: Problem) -> tuple[float, float]:
    """m: of dead reckoning and of iSAM2."""
    return ate(problem, find_estimator("dead-reckoning")(problem, None)), ate(problem, smoother.isam2(problem))


@pytest.mark.parametrize("drive", ["0001", "0005", "0036"])
def test_isam2_is_not_worse_than_dead_reckoning_where_that_is_very_good(recordings: Recordings, drive: str) -> None:
    problem = calibrated(read(recordings(f"utias/2011_09_26_drive_{drive}_sync_KLT.mat")))
    driven, smoothed = errors(problem)
    assert smoothed <= 1.05 * driven + 0.05


@pytest.mark.slow
def test_isam2_errs_a_fifth_as_much_as_dead_reckoning_on_noisy_velocities(recordings: Recordings) -> None:
    truth = recordings("ground_truth/kitti_odometry_07.txt")
    problem = calibrated(first_frames(read(recordings("ece276a_2020/0027.npz"), truth, "camera"), 550))
    driven, smoothed = errors(problem)
    assert smoothed <= 0.2 * driven


@pytest.mark.slow
def test_isam2_fits_03_and_ends_at_its_initial_height(recordings: Recordings) -> None:
    sequence = read(recordings("03.npz"))
    far = disparity(sequence.observations.pixel) > 1.0
    assert far.sum() == 64945
    problem = calibrated(sequence)
    assert problem.mask.sum() >= 0.75 * far.sum()
    estimate = smoother.isam2(problem)
    table = compare.reprojection(problem.sequence, estimate)
    assert (table["error"] < 3.0).sum() >= 0.70 * far.sum()
    assert table["error"][table["used"]].median() <= 1.1
    assert abs(estimate.world_T_imu[-1, :3, 3] @ problem.sequence.up) < 40.0
    assert np.isfinite(estimate.world_T_imu).all()
