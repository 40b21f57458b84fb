"""EuRoC's samples and truth: from a true state with its true biases, a second of samples ends where the truth is."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fgbaseline.data.formats.inertial.imu_csv import read_imu_csv
from fgbaseline.data.formats.inertial.imu_yaml import read_imu_calibration
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.geometry import so3, strapdown

SPAN = 1.0
"""s"""
STARTS = 100


@pytest.mark.parametrize("name", ["V1_02_medium", "MH_04_difficult"])
def test_a_second_of_samples_ends_at_the_truth(name: str, recordings: Callable[[str], Path]) -> None:
    """The medians are within 4 cm and 0.15 degrees."""
    mav0 = f"euroc/{name}/mav0"
    calibration = read_imu_calibration(recordings(f"{mav0}/imu0/sensor.yaml"))
    imu = read_imu_csv(recordings(f"{mav0}/imu0/data.csv"), calibration.noise, calibration.gravity).samples
    truth = np.loadtxt(recordings(f"{mav0}/state_groundtruth_estimate0/data.csv"), delimiter=",")
    t = truth[:, 0] / 1e9
    poses = np.tile(np.eye(4), (len(truth), 1, 1))
    poses[:, :3, 3] = truth[:, 1:4]
    poses[:, :3, :3] = so3.rotation_from_quaternion(truth[:, [5, 6, 7, 4]])
    shift, turn = [], []
    for a in np.linspace(0, np.searchsorted(t, t[-1] - SPAN) - 1, STARTS).astype(int).tolist():
        b = int(np.searchsorted(t, t[a] + SPAN))
        cut = imu_intervals(imu, t[[a, b]])
        motion = cut.motion(0, truth[a, 11:14], truth[a, 14:17])
        pose, _ = strapdown.predict(poses[a], truth[a, 8:11], motion, cut.gravity_vector)
        shift.append(np.linalg.norm(pose[:3, 3] - poses[b, :3, 3]))
        turn.append(float(so3.rotation_angle(pose[:3, :3].T @ poses[b, :3, :3])))
    assert np.median(shift) < 0.04
    assert np.rad2deg(np.median(turn)) < 0.15
