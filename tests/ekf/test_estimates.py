"""What every filter's answer holds beside its path: its name, the time of each frame, progress to the end."""

from importlib.metadata import entry_points
from itertools import pairwise

import numpy as np
import pytest

from fgbaseline import data, ekf
from fgbaseline.data import Problem
from fgbaseline.ekf import JointSettings, LandmarkRepresentation, Linearization
from fgbaseline.geometry import FgbaselineError

from ..builders.synthetic import drive

OURS = {
    point.name: point.load()
    for point in entry_points(group="fgbaseline.estimators")
    if point.value.startswith("fgbaseline.ekf:")
}


@pytest.fixture(scope="module")
def problem() -> Problem:
    return data.documented(drive("town", seconds=2.0, features_per_frame=8.0), None)


@pytest.mark.parametrize("name", OURS)
def test_an_estimate_has_its_name_the_time_of_each_frame_and_reports_progress(name: str, problem: Problem) -> None:
    calls: list[tuple[int, int]] = []
    estimate = OURS[name](problem, lambda done, total: calls.append((done, total)))
    frames = problem.n_frames
    assert estimate.name == name
    assert estimate.seconds.shape == (frames,)
    assert (estimate.seconds >= 0.0).all()
    assert estimate.seconds_total >= estimate.seconds.sum()
    assert calls[-1] == (frames, frames)
    assert all(before[0] < after[0] for before, after in pairwise(calls))
    assert {total for _, total in calls} == {frames}
    assert estimate.covariance is not None
    assert estimate.covariance.shape == (frames, 6, 6)
    assert estimate.used.shape == problem.excluded.shape
    silent = OURS[name](problem)
    np.testing.assert_array_equal(silent.world_T_imu, estimate.world_T_imu)
    np.testing.assert_array_equal(silent.covariance, estimate.covariance)


def test_the_textbook_is_in_the_world_at_the_newest_estimate() -> None:
    assert JointSettings.textbook() == JointSettings(LandmarkRepresentation.WORLD, Linearization.TEXTBOOK, gate=None)
    assert ekf.joint_ekf_textbook is OURS["joint-ekf-textbook"]


def test_a_state_has_room_for_one_landmark_at_least() -> None:
    assert JointSettings(max_landmarks=1).max_landmarks == 1
    with pytest.raises(FgbaselineError, match="max_landmarks: expected at least 1, got 0"):
        JointSettings(max_landmarks=0)
