"""A sequence made in Python is held to what the readers hold files to: what cannot be estimated from is refused."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fgbaseline.data import Observations, Sequence, Truth
from fgbaseline.geometry import InputError, StereoCamera
from fgbaseline.geometry.monocular_camera import left_of

from ..builders.synthetic import Scene

GOOD = Scene(frames=6).sequence()
assert GOOD.truth is not None
assert GOOD.truth.landmarks is not None
POSES, POINTS = GOOD.truth.world_T_imu, GOOD.truth.landmarks


def one_off(frame: int = 0, landmark: int = 0, pixel: float | tuple[float, ...] = 1.0) -> Observations:
    return Observations(np.array([frame]), np.array([landmark]), np.full((1, 4), pixel))


def skewed(T: np.ndarray, entry: tuple[int, ...], by: float) -> np.ndarray:
    changed = T.copy()
    changed[entry] += by
    return changed


WRONG: dict[str, Callable[[], Sequence]] = {
    "time_stamps: a sequence needs at least 2 frames, this one has 1": lambda: replace(GOOD, t=GOOD.t[:1]),
    "linear_velocity: expected 3 values for each of the 6": lambda: replace(
        GOOD, linear_velocity=GOOD.linear_velocity[:5]
    ),
    "angular_velocity: row 2 has a number that is not finite": lambda: replace(
        GOOD, angular_velocity=skewed(GOOD.angular_velocity, (2, 1), np.nan)
    ),
    "time_stamps: row 5 has a number that is not finite": lambda: replace(GOOD, t=skewed(GOOD.t, (5,), np.inf)),
    "time_stamps: stamps must rise, but frame 4": lambda: replace(GOOD, t=GOOD.t[[0, 1, 2, 3, 3, 5]]),
    "imu_T_cam: its upper left 3x3 is not a rotation": lambda: replace(
        GOOD, imu_T_cam=skewed(GOOD.imu_T_cam, (0, 0), 0.01)
    ),
    r"imu_T_cam: expected shape \(4, 4\) with finite numbers, got": lambda: replace(GOOD, imu_T_cam=GOOD.imu_T_cam[:3]),
    "imu_T_cam: its last row is": lambda: replace(GOOD, imu_T_cam=skewed(GOOD.imu_T_cam, (3, 0), 0.5)),
    "b: expected a number above 0 and at most .*, got -0.5": lambda: replace(
        GOOD, camera=StereoCamera(500.0, 500.0, 320.0, 240.0, -0.5)
    ),
    "features: row 0 has a number that is not finite": lambda: replace(GOOD, observations=one_off(pixel=np.nan)),
    r"features: uR and vR must be NaN for one camera, but row 0 is \[1.0, 1.0, 1.0, nan\]": lambda: replace(
        GOOD, camera=left_of(GOOD.camera), observations=one_off(pixel=(1.0, 1.0, 1.0, np.nan))
    ),
    "features: observation 0 is of landmark .* in frame 6, but the sequence has 12 landmarks and 6 frames": lambda: (
        replace(GOOD, observations=one_off(frame=6))
    ),
    "features: observation 0 is of landmark 12": lambda: replace(GOOD, observations=one_off(landmark=12)),
    "features: observation 0 is of landmark .* in frame -1": lambda: replace(GOOD, observations=one_off(frame=-1)),
    "ground_truth: expected poses of shape .6, 4, 4., got .5, 4, 4.": lambda: GOOD.with_truth(Truth(POSES[:5], POINTS)),
    "ground_truth: the pose of frame 3 is not a rigid motion": lambda: GOOD.with_truth(
        Truth(skewed(POSES, (3, 1, 1), 0.1), POINTS)
    ),
    "landmarks: expected shape .12, 3., got .11, 3.": lambda: GOOD.with_truth(Truth(POSES, POINTS[:11])),
}


@pytest.mark.parametrize("sentence", WRONG)
def test_an_unusable_sequence_is_refused_by_field(sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        WRONG[sentence]()


def test_a_frame_without_truth_is_no_wrong_one() -> None:
    unknown = POSES.copy()
    unknown[4] = np.nan
    assert not GOOD.with_truth(Truth(unknown, POINTS)).truth.known[4]  # type: ignore[union-attr]
