"""What a diagnosis finds in simulated recordings whose faults are known, and that it never looks at truth."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fgbaseline.data import Excluded, Observations, Sequence, Truth
from fgbaseline.data.finding import UNITS
from fgbaseline.data.simulate import AXIS_CONVENTIONS, Simulation, simulate
from fgbaseline.data.velocity_increments import dead_reckoned_path, increments
from fgbaseline.diagnosis import Diagnosis, diagnose, findings_of, not_identifiable, repair, to_json
from fgbaseline.diagnosis.findings.frame_spans import spans
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings
from fgbaseline.diagnosis.window_adjustment.selection import spread_spans
from fgbaseline.geometry import FloatArray


def diagnosed(**settings: Any) -> Diagnosis:
    return diagnose(simulate(Simulation(**settings)))


def codes(diagnosis: Diagnosis) -> list[str]:
    return [finding.code for finding in findings_of(diagnosis)]


@pytest.mark.parametrize("path", ["town", "loop", "highway", "handheld"])
@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_found_in_clean_recordings(path: str, seed: int) -> None:
    found = findings_of(diagnosed(path=path, duration=20.0, seed=seed))
    assert not found, found


CHANGES = UNITS | {
    "angular_axes",
    "linear_axes",
    "gyro_bias",
    "time_offset",
    "extrinsic",
    "disparity_offset",
    "linear_velocity_outliers",
    "angular_velocity_outliers",
}
"""codes of findings that change a recording"""
SHORT = {
    (path, seed): {"duration": (3.2, 4.0, 5.0)[seed % 3], "features_per_frame": (15.0, 70.0)[seed % 2]}
    for path in ("town", "loop", "highway", "handheld", "drone")
    for seed in (0, 3, 5, 6, 10, 14)
} | {("handheld", 32): {"duration": 8.0}, ("drone", 94): {"duration": 3.2}, ("loop", 11): {"duration": 5.0}}


@pytest.mark.parametrize(("path", "seed"), SHORT)
def test_no_finding_changes_a_clean_short_recording(path: str, seed: int) -> None:
    d = diagnosed(path=path, seed=seed, wrong_share=0.0, **SHORT[path, seed])
    assert not CHANGES & set(codes(d)), findings_of(d)
    assert d.shift == 0.0


def test_windows_share_no_interval_and_leave_none_out() -> None:
    for n in (2, 3, 25, 26, 32, 49, 50, 120, 1153):
        intervals = [k for first, size in spread_spans(n) for k in range(first, first + size - 1)]
        assert intervals == list(range(n - 1))
        assert all(size <= 25 for _, size in spread_spans(n))
    long = [k for first, size in spread_spans(5000) for k in range(first, first + size - 1)]
    assert len(long) == len(set(long)) == 48 * 24


@pytest.mark.parametrize("seed", range(2))
def test_a_handheld_rig_shows_axes_bias_and_delay(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angular, linear = rng.choice(AXIS_CONVENTIONS, 2)
    bias, offset = rng.uniform(-0.03, 0.03, 3), 0.05
    d = diagnosed(
        path="handheld",
        duration=30.0,
        seed=seed,
        angular_axes=str(angular),
        linear_axes=str(linear),
        gyro_bias=tuple(bias),
        time_offset=offset,
    )
    assert (d.angular.name, d.linear.name) == (angular, linear)
    assert d.angular.determined == d.linear.determined == (True, True, True)
    assert np.abs(d.gyro_bias - bias).max() < 3.0 * d.gyro_bias_deviation.max()
    assert abs(d.timing.shift - offset) < 0.2 * 0.1
    found = codes(d)
    assert ("angular_axes" in found) == (angular != "x,y,z")
    assert ("linear_axes" in found) == (linear != "x,y,z")
    assert "gyro_bias" in found


def test_a_car_shows_only_which_axis_is_forward() -> None:
    d = diagnosed(duration=40.0, seed=3, angular_axes="x,-y,-z", linear_axes="-y,x,z")
    assert d.linear.name.split(",")[0] == "-y"
    assert d.linear.determined == (True, False, False)
    sentences = " ".join(not_identifiable(d))
    assert "the y and z axes of the linear velocity" in sentences
    assert "Determined: recorded -y is along x of the IMU frame of imu_T_cam" in sentences
    assert codes(d) == ["angular_axes", "linear_axes"]


def test_a_wrong_speed_is_detected_and_not_repaired() -> None:
    d = diagnosed(duration=20.0, velocity_scale=1.06, seed=5)
    (finding,) = findings_of(d)
    assert finding.code == "velocity_scale"
    assert finding.before == pytest.approx(1.06, abs=0.01)
    assert "the recording does not show which of the two is wrong" in finding.sentence
    assert np.array_equal(repair(d, MaskSettings()).sequence.linear_velocity, d.sequence.linear_velocity)


def test_spans_of_frames_hold_no_frame_that_was_not_counted() -> None:
    frames = np.array([3, 4, 6, 10, 11, 12, 20])
    assert spans(frames) == "3 to 4, 6, 10 to 12, 20"
    assert spans(frames, most=2) == "3 to 4, 10 to 12 and 2 more spans"


def test_bursts_and_blackouts_and_gaps_are_dated() -> None:
    sequence = simulate(Simulation(duration=20.0, bursts=((8.0, 9.0, 0.6),), blackouts=((14.0, 14.5),), seed=6))
    t = sequence.t.copy()
    t[40:] += 0.5
    found = {finding.code: finding for finding in findings_of(diagnose(replace(sequence, t=t)))}
    assert {"bursts", "few_features", "gaps"} <= set(found)
    assert "14" in found["few_features"].sentence
    assert "after frame 39" in found["gaps"].sentence
    assert found["bursts"].after < 0.05 < found["bursts"].before


def with_copies(sequence: Sequence, frames: tuple[int, ...]) -> Sequence:
    """The tracks of these frames repeat the frame before, as the course's tracker did when it looked for new ones."""
    o = sequence.observations
    pixel: FloatArray = o.pixel.copy()
    for k in frames:
        now, before = np.flatnonzero(o.frame == k), np.flatnonzero(o.frame == k - 1)
        _, i, j = np.intersect1d(o.landmark[now], o.landmark[before], return_indices=True)
        pixel[now[i]] = pixel[before[j]]
    return replace(sequence, observations=Observations(o.frame.copy(), o.landmark.copy(), pixel))


def test_copied_frames_are_found_and_their_stale_observations_masked() -> None:
    frames = (20, 41, 42, 90)
    d = diagnose(with_copies(simulate(Simulation(duration=15.0, seed=7)), frames))
    assert np.flatnonzero(d.repeated).tolist() == [k - 1 for k in frames]
    (copied,) = [finding for finding in findings_of(d) if finding.code == "copied_frames"]
    repaired = repair(d, MaskSettings())
    masked = repaired.sequence.observations.frame[repaired.excluded == Excluded.COPIED]
    assert set(masked.tolist()) == set(frames)
    assert copied.before > 100
    assert copied.after == 0


def test_ground_truth_is_never_used() -> None:
    sequence = simulate(Simulation(path="handheld", duration=10.0, gyro_bias=(0.02, 0.0, 0.0), seed=8))
    absurd = np.tile(np.eye(4), (sequence.n_frames, 1, 1))
    absurd[1:, 0, 3] = np.nan
    truths = (sequence.truth, None, Truth(absurd, np.full((sequence.n_landmarks, 3), np.nan), "nonsense"))
    files = {json.dumps(to_json(diagnose(replace(sequence, truth=truth))), allow_nan=False) for truth in truths}
    assert len(files) == 1


def test_a_repaired_recording_dead_reckons_as_a_clean_one() -> None:
    faults: dict[str, Any] = {"angular_axes": "-y,x,z", "linear_axes": "z,x,y", "gyro_bias": (0.01, -0.02, 0.015)}

    def end_error(recording: Sequence, shift: float) -> float:
        path = dead_reckoned_path(increments(recording, shift))
        assert recording.truth is not None
        return float(np.linalg.norm(path[-1, :3, 3] - recording.truth.world_T_imu[-1, :3, 3]))

    clean = simulate(Simulation(path="handheld", duration=20.0, seed=9))
    faulty = diagnosed(path="handheld", duration=20.0, seed=9, velocity_of_interval="before", **faults)
    repaired = repair(faulty, MaskSettings()).sequence
    unrepaired = end_error(faulty.sequence, 0.0)
    assert end_error(repaired, faulty.shift) < end_error(clean, 0.0) + 0.1 * unrepaired
