"""Recordings of people: other units, lost digits, zeros for unobserved, swapped cameras, inverted extrinsics.

The law: the answer is that of the recording without the fault, the factor being reported, or there is none and the
cause is named; `diagnose` never passes. What is right is never repaired.
"""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data import Sequence, TimeUnit
from fgbaseline.data.finding import AS_GIVEN, UNITS
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
from fgbaseline.data.time_unit import unit_of_stamps
from fgbaseline.diagnosis import Diagnosis, Repairs, calibrated, diagnose, findings_of, known_units, unusable
from fgbaseline.diagnosis.conventions.rate_units import COUNTS
from fgbaseline.diagnosis.repair_overrides.settings import UnitOverrides
from fgbaseline.geometry import InputError, se3, so3
from fgbaseline.reports.problem.construction import build_problem
from fgbaseline.reports.problem.settings import RunSettings

from ..builders.commands import fgbaseline
from .test_real_recordings import UTIAS

Recordings = Callable[[str], Path]
EPOCH = 1.4e9
UNIT_CODES = UNITS
FILE_CODES = UNIT_CODES | {"repeated_stamps", "stamps_rounded", "zero_for_unobserved", "extrinsic_inverse"}


@cache
def drive(path: Any = "loop", seed: int = 3) -> Sequence:
    return simulate(Simulation(path=path, duration=12.0, features_per_frame=25.0, seed=seed, wrong_share=0.0))


@cache
def arrays_of(path: Any = "loop") -> dict[str, Any]:
    from ..builders.hostile import recorded

    return recorded(drive(path))


def written(tmp_path: Path, **changed: Any) -> Path:
    """The file of a simulated drive with other arrays."""
    file = tmp_path / "drive.npz"
    np.savez(file, **{**arrays_of(), **changed})
    return file


def codes(diagnosis: Diagnosis) -> set[str]:
    return {finding.code for finding in findings_of(diagnosis)}


def scaled(s: Sequence, what: str, factor: float) -> Sequence:
    """The recording with one of its fields multiplied."""
    if what == "baseline":
        return replace(s, camera=replace(s.camera, baseline=s.camera.baseline * factor))
    if what == "extrinsic":
        return replace(s, imu_T_cam=with_arm(s.imu_T_cam, s.imu_T_cam[:3, 3] * factor))
    field = {"stamps": "t", "velocity": "linear_velocity", "gyroscope": "angular_velocity"}[what]
    return replace(s, **{field: getattr(s, field) * factor})


def with_arm(imu_T_cam: np.ndarray, arm: np.ndarray) -> np.ndarray:
    turned = imu_T_cam.copy()
    turned[:3, 3] = arm
    return turned


def assert_same_problem(problem: data.Problem, expected: data.Problem) -> None:
    np.testing.assert_allclose(problem.increment, expected.increment, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(problem.sequence.camera.baseline, expected.sequence.camera.baseline, rtol=1e-9)
    np.testing.assert_allclose(problem.sequence.imu_T_cam, expected.sequence.imu_T_cam, atol=1e-9)
    np.testing.assert_array_equal(problem.excluded, expected.excluded)
    np.testing.assert_allclose(problem.increment_covariance, expected.increment_covariance, rtol=1e-3, atol=1e-12)


FACTORS = [1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9]
MUTATIONS = [
    *((what, factor) for what in ("stamps", "velocity", "baseline") for factor in FACTORS),
    ("gyroscope", 180.0 / np.pi),
    ("velocity", 100.0),
    ("baseline", 100.0),
    ("extrinsic", 1e3),
    ("extrinsic", 100.0),
]


@pytest.mark.parametrize(("what", "factor"), MUTATIONS)
@pytest.mark.parametrize("path", ["loop", "handheld"])
def test_a_field_in_another_unit_gives_the_same_problem_and_the_factor_is_reported(
    path: str, what: str, factor: float
) -> None:
    found = diagnose(scaled(drive(path), what, factor))
    assert not found.units.doubt
    ours = [finding for finding in findings_of(found) if finding.code in UNIT_CODES]
    assert len(ours) == 1
    assert ours[0].before == pytest.approx(factor)
    assert f"multiplied by {1.0 / factor:.6g}" in ours[0].sentence
    problem = calibrated(found.sequence, diagnosis=found)
    assert_same_problem(problem, calibrated(drive(path)))
    assert any("multiplied by" in sentence for sentence in problem.repairs)


def test_a_rig_in_millimeters_is_repaired_as_a_whole() -> None:
    found = diagnose(scaled(scaled(drive(), "baseline", 1e3), "extrinsic", 1e3))
    assert {f.code for f in findings_of(found)} & UNIT_CODES == {"baseline_unit", "extrinsic_unit"}
    assert_same_problem(calibrated(found.sequence, diagnosis=found), calibrated(drive()))


@pytest.mark.parametrize("arm", [0.005, 0.07, 0.5])
def test_the_unit_of_a_short_lever_arm_is_found_or_the_arm_stays(arm: float) -> None:
    drawn = simulate(Simulation(path="handheld", duration=12.0, features_per_frame=25.0, seed=4))
    direction = np.array([0.6, -0.48, 0.64])
    moved = replace(  # the IMU's velocity with the camera elsewhere: v_imu = v_camera - w x p
        drawn,
        imu_T_cam=with_arm(drawn.imu_T_cam, arm * direction),
        linear_velocity=drawn.linear_velocity
        + np.cross(drawn.angular_velocity, drawn.imu_T_cam[:3, 3] - arm * direction),
    )
    assert known_units(moved).wrong == 0
    in_millimeters = known_units(scaled(moved, "extrinsic", 1e3))
    assert in_millimeters.extrinsic == 1e-3


def test_a_camera_far_from_the_imu_is_in_doubt_where_no_unit_explains_it() -> None:
    doubt = known_units(scaled(drive(), "extrinsic", 20.0)).doubt
    assert "places the camera 27.82 m from the IMU" in doubt
    assert known_units(scaled(drive(), "extrinsic", 20.0), {"extrinsic": 0.05}).doubt == ""


def with_intrinsics(s: Sequence, focal: float, principal: float) -> Sequence:
    c = s.camera
    K = {"fu": c.fu * focal, "fv": c.fv * focal, "cu": c.cu * principal, "cv": c.cv * principal}
    return replace(s, camera=replace(c, **K))


@pytest.mark.parametrize("path", ["loop", "handheld", "town", "highway"])
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_intrinsics_of_images_of_another_size_is_the_first_finding(path: str, factor: float) -> None:
    assert "intrinsics" not in codes(diagnose(drive(path)))
    first = findings_of(diagnose(with_intrinsics(drive(path), factor, factor)))[0]
    assert first.code == "intrinsics"
    assert first.before == pytest.approx(factor, rel=0.35)


@pytest.mark.parametrize(
    ("focal", "principal", "cause"),
    [
        (0.2, 0.2, "K is of images about 0.2"),
        (4.0, 4.0, "K is of images about 4"),
        (1e9, 1e9, "no camera has such a field of view"),
        (1e-3, 1e-3, "no camera has such a field of view"),
        (1e4, 1.0, "no camera has such a field of view"),
    ],
)
def test_intrinsics_that_cannot_be_that_of_the_images_is_the_cause(focal: float, principal: float, cause: str) -> None:
    other = with_intrinsics(drive(), focal, principal)
    assert cause in known_units(other).doubt
    with pytest.raises(InputError, match=cause):
        calibrated(other)


def test_normalized_coordinates_in_place_of_pixels_are_named() -> None:
    drawn, c = drive(), drive().camera
    center, focal = np.array([c.cu, c.cv, c.cu, c.cv]), np.array([c.fu, c.fv, c.fu, c.fv])
    normalized = replace(drawn.observations, pixel=(drawn.observations.pixel - center) / focal)
    assert "no camera has such a field of view" in known_units(replace(drawn, observations=normalized)).doubt


@pytest.mark.parametrize("motion", ["velocities", "samples"])
def test_a_gap_that_nothing_bridges_is_refused_by_its_length(motion: str) -> None:
    drawn = drive()
    if motion == "samples":
        drawn = simulate(Simulation(path="drone", duration=8.0, imu=SimulatedImu(), features_per_frame=25.0, seed=3))
        assert drawn.imu is not None
        cut = replace(drawn, imu=replace(drawn.imu, t=drawn.imu.t + 3e8 * (drawn.imu.t > 4.0)))
        assert "imu_time_stamps: 3e+08 s pass between sample" in unusable(cut)
    drawn = replace(drawn, t=drawn.t + 3e8 * (np.arange(len(drawn.t)) >= 60))
    assert "time_stamps: 3e+08 s pass between frame 59 and frame 60" in unusable(drawn)


@pytest.mark.parametrize("value", [-999.0, 1e6, 65535.0])
@pytest.mark.parametrize("order", ["C", "F"])
def test_another_number_for_unobserved_is_refused_with_it(tmp_path: Path, value: float, order: Any) -> None:
    features = np.array(arrays_of()["features"], dtype=float, order=order)
    features[:, (features == -1.0).all(axis=0)] = value
    with pytest.raises(InputError, match=re.escape(f"the same number in all four rows, such as {value:g}")):
        data.read(written(tmp_path, features=features))


def test_an_hour_between_two_slow_keyframes_is_no_such_gap() -> None:
    assert unusable(scaled(drive(), "stamps", 36_000.0)) == ""


@pytest.mark.parametrize(
    ("what", "factor", "cause"),
    [
        *(("gyroscope", n * 180.0 / np.pi, f"they may be raw counts of a gyroscope, {n:g} per °/s") for n in COUNTS),
        ("gyroscope", 300.0, "the factor of no unit; write rad/s"),
        ("gyroscope", 1.0 / 30.0, "the factor of no unit; write rad/s"),
        ("velocity", 3.281, "the factor of no unit; write m/s and m"),
        ("velocity", 30.0, "the factor of no unit; write m/s and m"),
        ("baseline", 39.37, "the factor of no unit; write m/s and m"),
    ],
)
def test_a_factor_of_no_unit_is_refused_with_its_value(what: str, factor: float, cause: str) -> None:
    recording = scaled(drive(), what, factor)
    doubt = known_units(recording).doubt
    found = re.search(rf"are ([\d.e-]+) times those that the cameras see.*{cause}", doubt)
    assert found is not None, doubt
    assert float(found.group(1)) == pytest.approx(1.0 / factor if what == "baseline" else factor, rel=0.03)
    with pytest.raises(InputError, match="times those that the cameras see"):
        calibrated(recording)


@pytest.mark.parametrize("unit", [60.0, 3600.0])
def test_stamps_in_minutes_or_hours_are_the_cause_named(unit: float) -> None:
    doubt = known_units(scaled(drive(), "stamps", 1.0 / unit)).doubt
    found = re.search(r"turns and distances are both .* as with stamps in a unit of ([\d.]+) s; write seconds", doubt)
    assert found is not None, doubt
    assert float(found.group(1)) == pytest.approx(unit, rel=0.03)


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_rates_twice_as_fast_as_seen_are_a_finding(factor: float) -> None:
    found = [f for f in findings_of(diagnose(scaled(drive(), "gyroscope", factor))) if f.code == "gyro_scale"]
    assert len(found) == 1
    assert found[0].before == pytest.approx(factor, rel=0.03)
    assert f"{found[0].before:.3g} times" in found[0].sentence


@pytest.mark.parametrize("preset", ["as-recorded", "documented"])
@pytest.mark.parametrize(("what", "factor"), [("stamps", 1e3), ("gyroscope", 180.0 / np.pi), ("baseline", 1e3)])
def test_where_nothing_is_repaired_another_unit_is_refused(preset: str, what: str, factor: float) -> None:
    settings = RunSettings(preset="documented") if preset == "documented" else RunSettings(as_recorded=True)
    with pytest.raises(InputError, match="times too large"):
        build_problem(scaled(drive(), what, factor), settings)
    build_problem(drive(), settings)


@pytest.mark.parametrize("unit", [TimeUnit.MS, TimeUnit.US, TimeUnit.NS])
def test_stamps_of_a_clock_since_1970_show_their_unit(tmp_path: Path, unit: TimeUnit) -> None:
    file = written(tmp_path, time_stamps=(EPOCH + drive().t[None, :]) / unit.seconds)
    for sequence in (data.read(file), data.read(file, time_unit=unit)):
        np.testing.assert_allclose(sequence.dt, drive().dt, rtol=1e-4)
    (finding,) = data.read(file).findings
    assert finding.code == "time_unit"
    assert unit.noun in finding.sentence
    assert f"multiplied by {unit.seconds:g}" in finding.sentence
    assert data.documented(data.read(file)).findings == (finding,)


def test_a_user_specified_unit_is_not_diagnosed(tmp_path: Path) -> None:
    slow = written(tmp_path, time_stamps=drive().t[None, :] * 1e3)
    assert codes(diagnose(data.read(slow, time_unit=TimeUnit.MS))).isdisjoint(UNIT_CODES)
    as_given = known_units(data.read(slow, time_unit=TimeUnit.S))
    assert as_given.time == 1.0


@pytest.mark.parametrize("interval", [0.5, 2.0, 10.0])
def test_slow_keyframes_are_legitimate(interval: float) -> None:
    s = drive()
    slow = replace(
        s,
        t=s.t * (interval / 0.1),
        linear_velocity=s.linear_velocity * (0.1 / interval),
        angular_velocity=s.angular_velocity * (0.1 / interval),
    )
    assert known_units(slow).wrong == 0
    assert not known_units(slow).doubt
    assert unit_of_stamps(slow.t) is None


def test_where_units_are_in_doubt_nothing_is_changed_and_an_option_settles_it() -> None:
    s = drive()
    blind = replace(s, t=s.t * 1e3, observations=data.Observations.none())
    found = diagnose(blind)
    assert "--time-unit" in found.failure_reason
    with pytest.raises(InputError, match="in doubt"):
        calibrated(blind)
    settled = calibrated(blind, repairs=Repairs(units=UnitOverrides(time="ms")))
    np.testing.assert_allclose(settled.sequence.t, s.t)


def test_an_extrinsic_recorded_as_its_inverse_is_inverted() -> None:
    expected = drive()
    found = diagnose(replace(expected, imu_T_cam=se3.inverse(expected.imu_T_cam)))
    assert codes(found) == {"extrinsic_inverse"}
    np.testing.assert_allclose(found.sequence.imu_T_cam, expected.imu_T_cam, atol=1e-12)
    kept = calibrated(found.sequence, diagnosis=found, repairs=Repairs(extrinsic_inverted=False))
    assert not any("inverted" in sentence for sentence in kept.repairs if "user-specified" not in sentence)


def test_a_zero_in_all_four_rows_is_unobserved(tmp_path: Path) -> None:
    features = arrays_of()["features"].copy()
    unseen = (features == -1.0).all(axis=0)
    for order in ("C", "F"):
        marked = np.asarray(np.where(unseen, 0.0, features), order=order)
        sequence = data.read(written(tmp_path, features=marked))
        np.testing.assert_array_equal(sequence.observations.pixel, data.read(written(tmp_path)).observations.pixel)
        (finding,) = sequence.findings
        assert (finding.code, finding.before) == ("zero_for_unobserved", unseen.sum())
    features[:, 0, 0] = [0.0, -1.0, 0.0, -1.0]
    with pytest.raises(InputError, match="-1 in some rows only"):
        data.read(written(tmp_path, features=features))


def test_a_coordinate_that_is_zero_is_kept(tmp_path: Path) -> None:
    features = arrays_of()["features"].copy()
    landmark, frame = (int(i[0]) for i in np.nonzero((features != -1.0).all(axis=0)))
    features[2, landmark, frame] = 0.0
    for order in ("C", "F"):
        sequence = data.read(written(tmp_path, features=np.asarray(features, order=order)))
        o = sequence.observations
        assert o.pixel[(o.frame == frame) & (o.landmark == landmark), 2].tolist() == [0.0]
        assert len(o) == len(drive().observations)
        assert sequence.findings == ()


@pytest.mark.parametrize("preset", ["calibrated", "as-recorded", "documented"])
def test_swapped_cameras_and_landmarks_seen_once_are_refused_by_their_cause(preset: str) -> None:
    settings = RunSettings(preset="documented" if preset == "documented" else "calibrated")
    settings = replace(settings, as_recorded=preset == "as-recorded")
    s, o = drive(), drive().observations
    swapped = replace(s, observations=replace(o, pixel=o.pixel[:, [2, 3, 0, 1]]))
    single = data.Observations(o.frame, np.arange(len(o)), o.pixel)
    for broken, cause in (
        (swapped, "left and right camera are swapped"),
        (replace(s, observations=single, n_landmarks=len(o), truth=None), "seen in one frame only"),
    ):
        assert cause in diagnose(broken).failure_reason
        with pytest.raises(InputError, match=cause):
            build_problem(broken, settings)


@pytest.mark.parametrize(
    ("stamps", "cause"),
    [
        (lambda t: (EPOCH + t).astype(np.float32), "float32"),
        (lambda t: np.array([float(f"{x:.6g}") for x in 1400123456.0 + t]), "6 significant figures"),
        (lambda t: np.floor(t), "whole numbers"),
        (lambda t: np.where(np.arange(len(t)) == 60, 0.0, t), "frame 60 alone is out of place"),
        (lambda t: np.where(np.arange(len(t)) == len(t) - 1, 0.0, t), "alone is out of place"),
        (lambda t: np.where(np.arange(len(t)) == 0, 0.0, EPOCH + t), "a value that was never set"),
        (lambda t: t[::-1], "sort the frames"),
    ],
)
def test_stamps_that_cannot_be_are_refused_by_their_cause(
    tmp_path: Path, stamps: Callable[[Any], Any], cause: str
) -> None:
    recorded = stamps(drive().t)
    with pytest.raises(InputError, match=cause):
        data.read(written(tmp_path, time_stamps=recorded[None, :]))


def test_whole_numbers_beyond_2_to_53_that_repeat_are_named(tmp_path: Path) -> None:
    t = 2.0**62 + 100.0 * np.arange(drive().n_frames)  # a float64 holds steps of 1024 there
    with pytest.raises(InputError, match=r"beyond 2\^53, which a float64 holds in steps of 1024"):
        data.read(written(tmp_path, time_stamps=t[None, :]))


def test_rounded_stamps_are_a_finding_and_steady_ones_are_not(tmp_path: Path) -> None:
    jitter = drive().t + 0.004 * np.random.default_rng(1).uniform(-1.0, 1.0, drive().n_frames)
    (finding,) = data.read(written(tmp_path, time_stamps=np.floor(jitter * 100.0)[None, :] / 100.0)).findings
    assert finding.code == "stamps_rounded"
    assert "multiples of 0.01" in finding.sentence
    float32 = (5e4 + jitter).astype(np.float32)
    assert "float32" in data.read(written(tmp_path, time_stamps=float32[None, :])).findings[0].sentence
    assert data.read(written(tmp_path, time_stamps=jitter[None, :])).findings == ()
    missing = np.round(drive().t, 1)
    missing[60:] += 0.1
    assert data.read(written(tmp_path, time_stamps=missing[None, :])).findings == ()


def test_a_frame_whose_stamp_repeats_is_left_out_and_counted(tmp_path: Path) -> None:
    t = drive().t.copy()
    t[41] = t[40]
    s = data.read(written(tmp_path, time_stamps=t[None, :]))
    assert (s.n_frames, s.left_out) == (drive().n_frames - 1, (41,))
    assert [finding.code for finding in s.findings] == ["repeated_stamps"]
    others = np.delete(np.arange(drive().n_frames), 41)
    np.testing.assert_array_equal(s.t, drive().t[others])
    np.testing.assert_array_equal(s.linear_velocity, drive().linear_velocity[others])
    assert s.truth is not None
    assert drive().truth is not None
    np.testing.assert_array_equal(s.truth.world_T_imu, drive().truth.world_T_imu[others])
    o = drive().observations
    np.testing.assert_array_equal(s.observations.pixel, o.pixel[o.frame != 41])
    kitti = tmp_path / "truth.txt"
    data.write_kitti(kitti, drive().truth.world_T_imu)
    with_lines = data.read(tmp_path / "drive.npz", kitti, "imu").truth
    assert with_lines is not None
    np.testing.assert_allclose(with_lines.world_T_imu, s.truth.world_T_imu, atol=1e-6)


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_a_truth_in_another_unit_is_named_and_read(tmp_path: Path, start: float) -> None:
    true, truth = drive().truth, tmp_path / "truth.tum"
    assert true is not None
    stamps = np.round((drive().t + start) * 1e9).astype(np.int64)
    rows = np.concatenate([true.world_T_imu[:, :3, 3], so3.quaternion_xyzw(true.world_T_imu[:, :3, :3])], axis=1)
    truth.write_text("\n".join(f"{t} {' '.join(map(repr, row.tolist()))}" for t, row in zip(stamps, rows, strict=True)))
    sequence = data.read(written(tmp_path, time_stamps=drive().t[None, :] + start), truth, "imu")
    assert any("are in nanoseconds: divided by 1,000,000,000" in remark for remark in sequence.remarks)
    assert sequence.truth is not None
    assert sequence.truth.known.all()


@pytest.mark.parametrize(
    "name", ["03.npz", "ece276a_2020/0027.npz", "10_imu_only.npz", *(f"utias/{n}.mat" for n in (*UTIAS, "dataset3"))]
)
def test_a_recording_that_is_right_is_not_repaired(recordings: Recordings, name: str) -> None:
    sequence = data.read(recordings(name))
    units = known_units(sequence)
    assert (units.wrong, units.doubt, sequence.findings) == (0, "", ())


@pytest.mark.parametrize("path", ["town", "loop", "highway", "handheld"])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_simulated_recording_that_is_right_is_not_repaired(path: str, seed: int) -> None:
    assert codes(diagnose(drive(path, seed))).isdisjoint(FILE_CODES)


CASES = {
    "36-recording-ns/v01_ns.npz": (1, "time stamps are in nanoseconds"),
    "37-recording-ms/v02_ms.npz": (1, "time stamps are in milliseconds"),
    "38-gyro-degrees/v03_gyro_deg.npz": (1, "angular velocity is in °/s and not in rad/s: 57.2958 times too large"),
    "39-left-right-swapped/v07_left_right_swapped.npz": (2, "left and right camera are swapped"),
    "42-seen-once/v13_seen_once.npz": (2, "every landmark is seen in one frame only"),
    "45-float32-stamps/v11_float32_stamps.npz": (2, "they went through a float32"),
    "46-zero-for-unseen/v16_zero_unobserved.npz": (1, "0 in all four rows"),
    "47-extrinsic-inverse/v06_extr_inverse.npz": (1, "imu_T_cam is recorded as its inverse"),
}


@pytest.mark.parametrize("name", CASES)
def test_diagnose_names_the_cause_of_each_case(recordings: Recordings, tmp_path: Path, name: str) -> None:
    code, said = CASES[name]
    result = fgbaseline("diagnose", recordings(f"cases/{name}"), cwd=tmp_path)
    assert result.returncode == code
    assert said in " ".join((result.stdout + result.stderr).split())


def test_the_stationary_case_has_no_scale(recordings: Recordings) -> None:
    assert not codes(diagnose(data.read(recordings("cases/40-stationary/v08_stationary.npz"))))


def test_case_49_a_truth_of_one_orientation_throughout_is_refused(recordings: Recordings) -> None:
    truth = recordings("cases/49-truth-one-frame/truth_ns.tum")
    with pytest.raises(InputError, match="positions without orientations"):
        data.read(recordings("cases/49-truth-one-frame/drive.npz"), truth, "imu")


@pytest.mark.parametrize("key", ["linear_velocity", "angular_velocity", "time_stamps", "b", "imu_T_cam"])
def test_numbers_that_no_sensor_measures_are_refused_by_name(tmp_path: Path, key: str) -> None:
    array = np.array(arrays_of()[key], dtype=np.float64)
    array[(0, -1) if array.ndim > 1 else ()] = 1e300
    with pytest.raises(InputError, match=rf"drive\.npz: {key}: .*1e\+?300|drive\.npz: {key}: .*beyond 1e\+60"):
        data.read(written(tmp_path, **{key: array}))


@pytest.mark.parametrize(("field", "key", "factor"), [("stamps", "time", "ms"), ("velocity", "linear_velocity", 1e-3)])
def test_a_unit_that_the_user_states_is_no_guess(field: str, key: str, factor: Any) -> None:
    recorded = scaled(drive(), field, 1e3)
    for repairs, is_given in ((Repairs(units=UnitOverrides(**{key: factor})), True), (None, False)):
        found = [each for each in calibrated(recorded, repairs=repairs).findings if each.code in UNIT_CODES]
        assert [each.certainty == AS_GIVEN for each in found] == [is_given]
