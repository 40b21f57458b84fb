"""KITTI drive 09_30_0027 as its left camera sees it, 52 s and 327 m with its IMU: started by its own initialization."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data, diagnosis, ekf, smoother
from fgbaseline.data import Observations, Problem, Sequence, Status
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.diagnosis.inertial.monocular import initialization_window
from fgbaseline.geometry.monocular_camera import left_of

from .test_one_camera_real import errors


@pytest.fixture(scope="module")
def sequence(recordings: Callable[[str], Path]) -> Sequence:
    both = data.read(
        recordings("utias/2011_09_30_drive_0027_sync_KLT.mat"),
        imu=recordings("imu/2011_09_30_drive_0027_imu0.csv"),
        imu_calibration=recordings("imu/oxts_sensor.yaml"),
    )
    o, pixel = both.observations, both.observations.pixel.copy()
    pixel[:, 2:] = np.nan
    return replace(both, camera=left_of(both.camera), observations=Observations(o.frame, o.landmark, pixel))


@pytest.fixture(scope="module")
def problem(sequence: Sequence) -> Problem:
    return diagnosis.calibrated(sequence)


def test_gravity_points_down_however_little_the_body_turns(sequence: Sequence) -> None:
    """Where the body turns about the vertical only, a bias of 2 g and gravity upside down fit the samples as well."""
    assert sequence.imu is not None
    imu = imu_intervals(sequence.imu, sequence.t)
    for frames in initialization_window._windows(sequence, 0):
        states = initialization_window._solved(sequence, imu, frames, None).solution.states
        assert np.abs(states.accelerometer_bias).max() < 1.0


def test_the_joint_filter_finishes(problem: Problem) -> None:
    answer = ekf.joint_ekf(problem)
    assert answer.status is Status.OK
    rmse, scale = errors(answer, problem)
    assert rmse < 15.0
    assert abs(scale - 1.0) < 0.15


@pytest.mark.full
def test_isam2_finishes_and_finds_the_scale(problem: Problem) -> None:
    answer = smoother.isam2(problem)
    assert answer.status is Status.OK
    for estimate, most in ((answer, 3.0), (answer.by_products["isam2-online"], 8.0)):
        rmse, scale = errors(estimate, problem)
        assert rmse < most
        assert abs(scale - 1.0) < 0.05
