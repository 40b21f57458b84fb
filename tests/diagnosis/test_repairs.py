"""User-specified repairs: what the file may contain, what is done with it, and the file that a diagnosis writes."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data import Excluded
from fgbaseline.data.axis_conventions import axes_matrix
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import increments
from fgbaseline.diagnosis import (
    AsRecordedSettings,
    Diagnosis,
    Repairs,
    calibrated,
    diagnose,
    read_repairs,
    repairs_text,
)
from fgbaseline.diagnosis.repair_overrides.applied_overrides import with_overrides
from fgbaseline.diagnosis.repair_overrides.settings import MaskOverrides, SigmaOverrides
from fgbaseline.geometry import InputError, so3

from ..builders.commands import everything_in, fgbaseline

BIAS = (0.02, -0.01, 0.015)


@cache
def faulty() -> Diagnosis:
    """Hand-held recording with other axes, a bias and a delay, all of which are identifiable."""
    return diagnose(
        simulate(
            Simulation(
                path="handheld", duration=10.0, angular_axes="x,-y,-z", gyro_bias=BIAS, time_offset=0.05, seed=11
            )
        )
    )


def file_with(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "repairs.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        ("gyro_bias = [1, 2]", "gyro_bias", "gyro_bias = [1, 2]: it should be three numbers of at most 10 rad/s"),
        ("\ngyro_bias = [nan, 0, 0]", "gyro_bias", "three numbers"),
        ('linear_axes = "x,y,-z"', "linear_axes", "none of the 24 right-handed axis conventions"),
        ("angular_axes = 3", "angular_axes", "none of the 24"),
        ("time_offset_s = 0.1\nshift_intervals = 1", "shift_intervals", "time_offset_s says the same in seconds"),
        ("velocity_scale = 0", "velocity_scale", "a number from 0.01 to 100, or 'as-recorded'"),
        ("velocity_scale = true", "velocity_scale", "a number from 0.01"),
        ("[sigma]\npixel = -1", "sigma.pixel", "sigma.pixel = -1"),
        ("[mask]\nmin_track = 2.5", "mask.min_track", "whole number"),
        ("[mask]\nmin_track = 1", "mask.min_track", "whole number"),
        ("bias = [0, 0, 0]", "there is no key", "did you mean 'gyro_bias'?"),
        ('sigma.pixel = "as-recorded"', "sigma.pixel", "a number from"),
    ],
)
def test_an_invalid_setting_is_refused_with_its_key_path(tmp_path: Path, text: str, place: str, said: str) -> None:
    with pytest.raises(InputError) as raised:
        read_repairs(file_with(tmp_path, text))
    assert f"repairs.toml: {place}" in str(raised.value)
    assert said in str(raised.value)


def test_the_problem_has_the_user_specified_repairs() -> None:
    found = faulty()
    repairs = Repairs(
        angular_axes="-y,x,z",
        linear_axes="z,x,y",
        gyro_bias=(0.001, 0.0, -0.0005),
        velocity_scale=1.25,
        shift_intervals=-0.25,
        misalignment_deg=(0.0, 0.1, -2.0),
        sigma=SigmaOverrides(linear_velocity=0.7, pixel=2.5),
    )
    problem, recorded = calibrated(found.sequence, diagnosis=found, repairs=repairs), found.sequence
    rate = (recorded.angular_velocity - [0.001, 0.0, -0.0005]) @ axes_matrix("-y,x,z").T
    velocity = recorded.linear_velocity @ axes_matrix("z,x,y").T / 1.25
    np.testing.assert_allclose(problem.sequence.angular_velocity, rate, atol=1e-12)
    np.testing.assert_allclose(problem.sequence.linear_velocity, velocity, atol=1e-12)
    np.testing.assert_array_equal(problem.increment, increments(problem.sequence, -0.25))
    turned = so3.exp_so3(np.deg2rad([0.0, 0.1, -2.0])) @ recorded.imu_T_cam[:3, :3]
    np.testing.assert_allclose(problem.sequence.imu_T_cam[:3, :3], turned, atol=1e-12)
    assert problem.pixel_variance == pytest.approx(2.5**2)
    sigma = np.sqrt(np.diagonal(problem.increment_covariance, axis1=1, axis2=2)) / recorded.dt[:, None]
    np.testing.assert_allclose(sigma[:, :3], 0.7)
    assert np.ptp(sigma[:, 3:]) < 1e-12
    specified = [sentence for sentence in problem.repairs if sentence.startswith("user-specified: ")]
    assert [sentence.split()[1] for sentence in specified] == [
        "angular_axes",
        "linear_axes",
        "gyro_bias",
        "velocity_scale",
        "shift_intervals",
        "misalignment_deg",
        "sigma.linear_velocity",
        "sigma.pixel",
    ]
    assert "user-specified in part" in problem.remarks[0]


def test_as_recorded_turns_one_repair_off_and_leaves_the_others(tmp_path: Path) -> None:
    found = faulty()
    repairs = read_repairs(file_with(tmp_path, 'gyro_bias = "as-recorded"'))
    problem = calibrated(found.sequence, diagnosis=found, repairs=repairs)
    rate = found.sequence.angular_velocity @ axes_matrix("x,-y,-z").T
    np.testing.assert_allclose(problem.sequence.angular_velocity, rate, atol=1e-12)
    assert [finding.code for finding in problem.findings] == ["angular_axes", "gyro_bias", "time_offset"]
    assert not any("gyroscope bias" in sentence for sentence in problem.repairs)
    everything_off = 'angular_axes = "as-recorded"\nlinear_axes = "as-recorded"\ngyro_bias = "as-recorded"\n'
    everything_off += 'shift_intervals = "as-recorded"\nmisalignment_deg = "as-recorded"\n'
    off = calibrated(found.sequence, diagnosis=found, repairs=read_repairs(file_with(tmp_path, everything_off)))
    np.testing.assert_array_equal(off.increment, increments(found.sequence))


def test_the_bias_is_found_for_the_axes_that_are_given() -> None:
    found = faulty()
    wrong = with_overrides(found, Repairs(angular_axes="x,y,z", linear_axes="x,y,z"))
    right = with_overrides(replace(wrong, overrides=frozenset()), Repairs(angular_axes="x,-y,-z"))
    assert np.abs(right.gyro_bias - BIAS).max() < 0.004
    np.testing.assert_allclose(right.gyro_bias, found.gyro_bias, atol=1e-6)
    assert right.shift == found.shift


def test_empty_user_specified_repairs_change_nothing() -> None:
    assert with_overrides(faulty(), Repairs()) is faulty()


def test_a_shift_beyond_the_recording_is_refused() -> None:
    with pytest.raises(InputError, match="time_offset_s: velocities shifted by 150 intervals leave the recording"):
        with_overrides(faulty(), Repairs(time_offset_s=15.0))


def test_the_written_repairs_give_the_problem_of_the_diagnosis(tmp_path: Path) -> None:
    found = faulty()
    repairs = read_repairs(file_with(tmp_path, repairs_text(found)))
    specified, by_itself = (calibrated(found.sequence, diagnosis=found, repairs=r) for r in (repairs, None))
    np.testing.assert_allclose(specified.increment, by_itself.increment, atol=1e-6)
    np.testing.assert_allclose(specified.increment_covariance, by_itself.increment_covariance, rtol=1e-4)
    np.testing.assert_allclose(specified.sequence.imu_T_cam, by_itself.sequence.imu_T_cam, atol=1e-6)
    np.testing.assert_array_equal(specified.excluded, by_itself.excluded)
    assert specified.pixel_variance == pytest.approx(by_itself.pixel_variance, rel=1e-4)


def test_a_user_specified_mask_is_the_mask() -> None:
    found = faulty()
    loose = calibrated(found.sequence, diagnosis=found, repairs=Repairs(mask=MaskOverrides(prediction_gate=1000.0)))
    whole = calibrated(found.sequence, diagnosis=found, repairs=Repairs(mask=MaskOverrides(split_tracks=False)))
    usual = calibrated(found.sequence, diagnosis=found)
    assert int((loose.excluded == Excluded.PREDICTION).sum()) == 0
    assert usual.sequence.n_landmarks > found.sequence.n_landmarks == whole.sequence.n_landmarks
    assert whole.mask.sum() < usual.mask.sum()
    deep = Repairs(mask=MaskOverrides(min_disparity=8.0, min_track=6))
    strict = calibrated(found.sequence, diagnosis=found, repairs=deep)
    pixel = strict.observations().pixel
    assert (pixel[:, 0] - pixel[:, 2]).min() > 8.0
    assert np.bincount(strict.observations().landmark)[strict.features].min() >= 6


def test_a_recording_that_determines_nothing_takes_the_given_values() -> None:
    blind = simulate(Simulation(duration=5.0, blackouts=((0.3, 4.9),)))
    found = diagnose(blind)
    assert found.failure_reason
    problem = calibrated(blind, diagnosis=found, repairs=Repairs(angular_axes="x,-y,-z", gyro_bias=(0.01, 0.0, 0.0)))
    np.testing.assert_allclose(
        problem.sequence.angular_velocity, (blind.angular_velocity - [0.01, 0.0, 0.0]) * [1.0, -1.0, -1.0], atol=1e-12
    )
    assert problem.remarks[0].startswith("not diagnosed")
    assert "assumed" in problem.remarks[1]
    assert not problem.diagnosed


def test_repairs_beside_what_takes_the_recording_as_it_is_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not both"):
        calibrated(faulty().sequence, settings=AsRecordedSettings(), repairs=Repairs())
    data.write_npz(simulate(Simulation(duration=3.0)), tmp_path / "drive.npz")
    file_with(tmp_path, "velocity_scale = 1.1")
    for refused in ("--as-recorded", "--preset=documented"):
        result = fgbaseline("run", "drive.npz", "--repairs", "repairs.toml", refused, cwd=tmp_path)
        assert result.returncode == 2
        assert "repairs" in result.stderr
    assert everything_in(tmp_path) == {"drive.npz", "repairs.toml"}


def test_from_the_diagnosis_to_a_file_to_a_run(tmp_path: Path) -> None:
    data.write_npz(faulty().sequence, tmp_path / "rig.npz")
    written = fgbaseline("diagnose", "rig.npz", "--write-repairs", "found.toml", cwd=tmp_path)
    assert written.returncode == 1, written.stderr
    text = (tmp_path / "found.toml").read_text()
    assert 'angular_axes = "x,-y,-z"' in text
    again = fgbaseline("diagnose", "rig.npz", "--write-repairs", "found.toml", cwd=tmp_path)
    assert again.returncode == 2
    assert "--force" in again.stderr
    (tmp_path / "found.toml").write_text(text.replace("velocity_scale = 1 ", "velocity_scale = 1.5 "))
    asked = ("--repairs", "found.toml", "--estimators", "dead-reckoning", "--out", "out")
    run = fgbaseline("run", "rig.npz", *asked, cwd=tmp_path, drawing=False)
    assert run.returncode == 0, run.stderr
    summary = json.loads((tmp_path / "out/summary.json").read_text())
    assert summary["settings"]["repairs"] == "found.toml"
    assert "user-specified: velocity_scale = 1.5" in summary["problem"]["repairs"]
    codes = [finding["code"] for finding in summary["problem"]["findings"]]
    assert codes == ["angular_axes", "gyro_bias", "time_offset"]
    page = (tmp_path / "out/report.html").read_text()
    assert "User-specified: velocity_scale = 1.5." in page
    assert "w_y and w_z are recorded with the opposite sign" in page
