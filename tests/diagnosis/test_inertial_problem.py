"""The calibrated problem of raw inertial data: start, noise, mask, truth in its world; units, and what is refused."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data, diagnosis
from fgbaseline.data.axis_conventions import axes_matrix
from fgbaseline.data.imu import ASSUMED_NOISE, ImuSamples
from fgbaseline.data.problem import Problem
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
from fgbaseline.diagnosis.conventions.rate_units import DEGREE
from fgbaseline.diagnosis.inertial.imu_spikes import without_spikes
from fgbaseline.diagnosis.inertial.sensor_findings import sensor_findings
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings
from fgbaseline.geometry import FloatArray, InputError, se3, so3, strapdown

from ..builders import inertial_paths
from ..builders.commands import fgbaseline
from ..builders.inertial import simulated_problem
from ..builders.inertial_paths import PIXEL, inertial_recording, trembling, turn, upside_down


@pytest.fixture(scope="module")
def recording() -> data.Sequence:
    return inertial_recording(turn, seed=1, n_frames=60)


@pytest.fixture(scope="module")
def problem(recording: data.Sequence) -> Problem:
    return diagnosis.calibrated(recording)


def faults(problem: Problem) -> list[str]:
    """Codes of the findings but for biases, which every unit has and the builder draws."""
    return [f.code for f in problem.findings if f.code not in ("gyro_bias", "accelerometer_bias", "gravity")]


def test_a_clean_recording_has_its_noise_and_no_findings(problem: Problem, recording: data.Sequence) -> None:
    assert faults(problem) == []
    # Noise may look like a jump by chance.
    assert all(repair.startswith("tracks split where they jump") for repair in problem.repairs)
    assert np.sqrt(problem.pixel_variance) == pytest.approx(PIXEL, rel=0.3)
    assert float(problem.mask.mean()) > 0.95
    assert problem.imu is not None
    assert recording.imu is not None
    assert problem.imu.noise == recording.imu.noise
    assert problem.increment.shape == (0, 6)
    assert any("as given" in remark for remark in problem.remarks)


def test_wrong_matches_are_masked(recording: data.Sequence) -> None:
    """A tenth of the observations moved by 40 px: nearly all of them are excluded, and few others."""
    o = recording.observations
    wrong = np.random.default_rng(5).random(len(o)) < 0.1
    pixel = o.pixel.copy()
    pixel[wrong, 0] += 40.0
    pixel[wrong, 2] += 40.0
    found = diagnosis.calibrated(replace(recording, observations=replace(o, pixel=pixel)))
    order = np.lexsort((*o.pixel.T, o.frame)), np.lexsort((*found.sequence.observations.pixel.T, o.frame))
    moved = set(pixel[wrong, 0].tolist())
    is_wrong = np.isin(found.sequence.observations.pixel[:, 0], list(moved))
    assert len(order[0]) == len(order[1])
    assert float(found.mask[is_wrong].mean()) < 0.05
    assert float(found.mask[~is_wrong].mean()) > 0.8


def moved_truth(recording: data.Sequence, first: int, motion: FloatArray, up: FloatArray | None) -> data.Sequence:
    """The recording with its truth in another world, and without its first frames."""
    truth = recording.truth
    assert truth is not None
    late = replace(truth.transformed(motion), up=up)
    poses = late.world_T_imu.copy()
    poses[:first] = np.nan
    return recording.with_truth(replace(late, world_T_imu=poses))


@pytest.mark.parametrize("first", [0, 7])
def test_truth_of_any_world_is_tied_to_the_start(first: int, recording: data.Sequence) -> None:
    """Turned by 70 degrees, tilted by 10 and shifted; the tie takes it back by the start and the samples alone."""
    motion = se3.exp(np.array([5.0, -3.0, 2.0, 0.1, 0.14, 1.2]))
    found = diagnosis.calibrated(moved_truth(recording, first, motion, None))
    reference = diagnosis.calibrated(recording)
    tied, expected = found.sequence.truth, reference.sequence.truth
    assert tied is not None
    assert expected is not None
    assert not tied.known[:first].any()
    apart = se3.log(se3.inverse(expected.world_T_imu[first:]) @ tied.world_T_imu[first:])
    assert np.linalg.norm(apart[:, 3:], axis=1).max() < np.deg2rad(1.0)
    assert np.linalg.norm(apart[:, :3], axis=1).max() < 0.3
    if first == 0:
        np.testing.assert_allclose(tied.world_T_imu[0, :3, 3], 0.0, atol=1e-9)
        heading = so3.log_so3(found.initial_pose[:3, :3] @ tied.world_T_imu[0, :3, :3].T)[2]
        assert heading == pytest.approx(0.0, abs=1e-9)


def test_a_world_that_is_nearly_level_is_leveled_by_the_samples(recording: data.Sequence) -> None:
    """Tilted by 2 degrees, as the frame of a car at its first pose is, where frames before it were cut."""
    tilted = moved_truth(recording, 0, se3.exp(np.array([0.0, 0.0, 0.0, 0.035, 0.0, 0.4])), None)
    found, reference = (diagnosis.calibrated(s).sequence.truth for s in (tilted, recording))
    assert found is not None
    assert reference is not None
    up = found.world_T_imu[:, 2, :3], reference.world_T_imu[:, 2, :3]
    assert np.rad2deg(np.arccos(np.einsum("ni,ni->n", *up))).max() < 1.0


def test_the_simulated_truth_defines_up_and_keeps_its_tilt() -> None:
    """The measured up of this start is off by 1.6 degrees."""
    imu = SimulatedImu(accelerometer_bias=(0.1, -0.2, 0.0))
    drive = simulate(Simulation(path="town", duration=4.0, features_per_frame=30.0, wrong_share=0.0, seed=2, imu=imu))
    found = diagnosis.calibrated(drive).sequence.truth
    assert found is not None
    assert drive.truth is not None
    np.testing.assert_allclose(found.world_T_imu[:, 2, :3], drive.truth.world_T_imu[:, 2, :3], atol=1e-9)


def test_true_velocities_turn_with_the_world(problem: Problem, recording: data.Sequence) -> None:
    tied, given = problem.sequence.truth, recording.truth
    assert tied is not None
    assert given is not None
    assert tied.velocity is not None
    assert given.velocity is not None
    before = np.einsum("nji,nj->ni", given.world_T_imu[:, :3, :3], given.velocity)
    after = np.einsum("nji,nj->ni", tied.world_T_imu[:, :3, :3], tied.velocity)
    np.testing.assert_allclose(after, before, atol=1e-9)
    start = problem.start
    assert start is not None
    deviation = np.sqrt(np.diag(start.covariance))
    assert (np.abs(tied.velocity[0] - start.velocity) < 4.0 * deviation[strapdown.VELOCITY]).all()


def in_units(imu: ImuSamples, rate: float, force: float) -> ImuSamples:
    return replace(imu, angular_velocity=imu.angular_velocity / rate, specific_force=imu.specific_force / force)


UNITS = {"angular_velocity_unit": (np.pi / 180.0, 1.0, "°/s"), "accelerometer_unit": (1.0, 9.80665, "in g and")}


@pytest.mark.parametrize("code", UNITS)
def test_other_units_are_found_and_repaired_or_refused(code: str, recording: data.Sequence, problem: Problem) -> None:
    rate, force, name = UNITS[code]
    assert recording.imu is not None
    wrong = replace(recording, imu=in_units(recording.imu, rate, force))
    found = diagnosis.calibrated(wrong)
    assert faults(found) == [code]
    assert name in found.findings[0].sentence
    assert found.start is not None
    assert problem.start is not None
    np.testing.assert_allclose(found.start.velocity, problem.start.velocity, atol=1e-6)
    with pytest.raises(InputError, match=name):
        diagnosis.calibrated(wrong, settings=diagnosis.AsRecordedSettings())


@pytest.mark.parametrize(("unit", "name"), [(1e-3, "in mm"), (1e3, "in km")])
def test_a_baseline_in_another_unit_is_found_by_the_accelerometer(unit: float, name: str) -> None:
    """The camera's place is in m, or far from the IMU and then in the unit of the baseline."""
    recording = inertial_recording(upside_down, seed=2, n_frames=80)
    expected = diagnosis.calibrated(recording)
    wrong = replace(recording, camera=replace(recording.camera, baseline=recording.camera.baseline / unit))
    found = diagnosis.calibrated(wrong)
    assert [code for code in faults(found) if code not in faults(expected)] == ["baseline_unit"]
    assert name in found.findings[0].sentence
    assert found.repairs[0] == f"baseline multiplied by {unit:g}"
    assert found.start is not None
    assert expected.start is not None
    assert found.sequence.camera.baseline == pytest.approx(recording.camera.baseline, rel=1e-12)
    np.testing.assert_allclose(found.start.velocity, expected.start.velocity, atol=1e-6)
    with pytest.raises(InputError, match=name):
        diagnosis.calibrated(wrong, settings=diagnosis.AsRecordedSettings())


def test_an_unusual_baseline_that_the_accelerometer_confirms_stays() -> None:
    """A rig of 6 m, far apart beside the rigs that are usual."""
    recording = inertial_recording(upside_down, seed=2, n_frames=80)
    camera, o = recording.camera, recording.observations
    wide = replace(camera, baseline=6.0)
    pixel = o.pixel.copy()
    pixel[:, 2] = pixel[:, 0] - (pixel[:, 0] - pixel[:, 2]) * wide.baseline / camera.baseline
    found = diagnosis.calibrated(replace(recording, camera=wide, observations=replace(o, pixel=pixel)))
    assert "baseline_unit" not in faults(found)
    assert found.sequence.camera.baseline == 6.0


def test_a_baseline_that_neither_unit_explains_is_refused(recording: data.Sequence) -> None:
    """A hundred times too large: in m the cameras' accelerations are 100 times too large, in mm 10 times too small."""
    wrong = replace(recording, camera=replace(recording.camera, baseline=100.0 * recording.camera.baseline))
    with pytest.raises(InputError, match=r"the stereo baseline, 30 m, is in doubt.*0\.03 m; write b in m"):
        diagnosis.calibrated(wrong)
    with pytest.raises(InputError, match=r"the stereo baseline, 30 m, is in doubt.*0\.03 m; write b in m"):
        diagnosis.calibrated(wrong, settings=diagnosis.AsRecordedSettings())


def test_rates_in_thousandths_of_degrees_are_found(recording: data.Sequence) -> None:
    assert recording.imu is not None
    found = diagnosis.calibrated(replace(recording, imu=in_units(recording.imu, 1e-3 * DEGREE, 1.0)))
    assert "in m°/s" in found.findings[0].sentence


@pytest.mark.parametrize("counts", [131.0, 65.5, 32.8, 16.4, 14.3])
def test_raw_counts_of_a_gyroscope_are_refused_by_their_factor(counts: float, recording: data.Sequence) -> None:
    """16.4 per °/s are 940 per rad/s, and no mrad/s."""
    assert recording.imu is not None
    wrong = replace(recording, imu=in_units(recording.imu, DEGREE / counts, 1.0))
    for settings in (None, diagnosis.AsRecordedSettings()):
        with pytest.raises(InputError, match=rf"raw counts of a gyroscope, .*{counts:.3g} per °/s; write rad/s$") as e:
            diagnosis.calibrated(wrong, settings=settings)
        measured = re.search(r"are ([\d.e+]+) times those that the cameras see", str(e.value))
        assert measured is not None
        assert float(measured.group(1)) == pytest.approx(counts / DEGREE, rel=0.03)


def test_a_factor_of_no_unit_and_no_gyroscope_is_refused(recording: data.Sequence) -> None:
    assert recording.imu is not None
    wrong = replace(recording, imu=in_units(recording.imu, 1.0 / 300.0, 1.0))
    with pytest.raises(InputError, match=r"are [\d.]+ times those that .* the factor of no unit; write rad/s$"):
        diagnosis.calibrated(wrong)


@pytest.mark.parametrize("counts", [16384, 8192, 4096, 2048])
def test_raw_counts_of_an_accelerometer_are_refused(counts: int, recording: data.Sequence) -> None:
    """8192 per g are no mm/s^2, in which gravity is 9807."""
    assert recording.imu is not None
    wrong = replace(recording, imu=in_units(recording.imu, 1.0, 9.80665 / counts))
    with pytest.raises(InputError, match=rf"imu_linear_acceleration: .*\(raw counts, {counts} per g\?\)"):
        diagnosis.calibrated(wrong)


AXES = {
    "angular_axes": ("(-y,x,z)", np.eye(3), axes_matrix("-y,x,z")),
    "accelerometer_axes": ("opposite sign", -np.eye(3), np.eye(3)),
}


@pytest.mark.parametrize("code", AXES)
def test_other_axes_are_found_and_repaired(code: str) -> None:
    """Recorded is what the convention takes to the axes of imu_T_cam."""
    recording = inertial_recording(upside_down, seed=2, n_frames=80)
    name, force, rate = AXES[code]
    imu = recording.imu
    assert imu is not None
    turned = replace(imu, angular_velocity=imu.angular_velocity @ rate, specific_force=imu.specific_force @ force)
    found = diagnosis.diagnose_inertial(replace(recording, imu=turned))
    codes = {finding.code: finding.sentence for finding in diagnosis.inertial_findings(found)}
    assert set(AXES) & set(codes) == {code}
    assert name in codes[code]
    assert found.sequence.imu is not None
    np.testing.assert_allclose(found.sequence.imu.specific_force, imu.specific_force, atol=1e-12)
    np.testing.assert_allclose(found.sequence.imu.angular_velocity, imu.angular_velocity, atol=1e-12)


def test_as_recorded_repairs_nothing(recording: data.Sequence) -> None:
    found = diagnosis.calibrated(recording, settings=diagnosis.AsRecordedSettings())
    assert np.sqrt(found.pixel_variance) == 1.5
    assert not found.diagnosed
    assert found.repairs == ()
    assert found.start is not None


def test_a_diagnosis_that_is_given_is_the_one_that_is_used(recording: data.Sequence, problem: Problem) -> None:
    found = diagnosis.diagnose_inertial(recording)
    given = diagnosis.calibrated(recording, diagnosis=found)
    np.testing.assert_array_equal(given.excluded, problem.excluded)
    assert given.pixel_variance == problem.pixel_variance
    other = replace(found, fit=None)  # without an estimate of the noise, which is then assumed
    assert diagnosis.calibrated(recording, diagnosis=other).pixel_variance == diagnosis.NoiseSettings().pixel ** 2


def test_no_argument_is_ignored(recording: data.Sequence) -> None:
    velocities = simulate(Simulation(duration=3.0))
    of_velocities, of_samples = diagnosis.diagnose(velocities), diagnosis.diagnose_inertial(recording)
    as_recorded = diagnosis.AsRecordedSettings()
    late, masked = replace(as_recorded, shift=-0.5), replace(as_recorded, mask=MaskSettings(min_track=5))
    one_camera = simulated_problem("drone", 1, seconds=3.0, cameras="left").sequence
    for sequence, found, settings, sentence in (
        (recording, of_velocities, None, "diagnosis: it is one of body velocities"),
        (velocities, of_samples, None, "diagnosis: it is one of raw inertial samples"),
        (one_camera, of_samples, None, "diagnosis: it is one of another number of cameras"),
        (recording, of_samples, as_recorded, "diagnosis: a recording that is taken as it is has none"),
        (velocities, of_velocities, as_recorded, "diagnosis: a recording that is taken as it is has none"),
        (recording, None, late, "settings: a shift is one of body velocities"),
        (one_camera, None, masked, "settings: a mask of one camera needs the diagnosis"),
    ):
        with pytest.raises(InputError, match=sentence):
            diagnosis.calibrated(sequence, diagnosis=found, settings=settings)


def test_a_time_offset_is_found(recording: data.Sequence) -> None:
    """Stamps 12 ms late: the gyroscope at full rate shows it to a millisecond or two."""
    imu = recording.imu
    assert imu is not None
    late = replace(recording, imu=replace(imu, t=imu.t + 0.012))
    found = diagnosis.diagnose_inertial(late)
    assert found.sensors is not None
    assert found.sensors.time_offset[0] == pytest.approx(0.012, abs=max(0.002, 4.0 * found.sensors.time_offset[1]))


@pytest.mark.parametrize(("density", "shortened"), [(1e-3, 0.0), (1e-4, 0.15)])
def test_without_rotation_there_is_a_bias_and_no_scale(
    density: float, shortened: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rig that stands. What moves is noise of the gyroscope, or trembling that a tracker shortens."""
    monkeypatch.setattr(inertial_paths, "NOISE", replace(inertial_paths.NOISE, gyroscope_density=density))
    still = inertial_recording(trembling, seed=3, n_frames=40, rate=20.0, pixel=0.01)
    o = still.observations
    first = np.zeros((still.n_landmarks, 4))
    first[o.landmark[::-1]] = o.pixel[::-1]
    pixel = o.pixel + shortened * (first[o.landmark] - o.pixel)
    checks = diagnosis.diagnose_inertial(replace(still, observations=replace(o, pixel=pixel))).sensors
    assert checks is not None
    assert {f.code for f in sensor_findings(checks)}.isdisjoint({"gyro_scale", "time_offset", "extrinsic"})
    assert checks.gyroscope_scale[1] > 0.1
    truth = still.truth
    assert truth is not None
    assert truth.gyroscope_bias is not None
    bias, deviation = checks.gyroscope_bias
    assert deviation.max() < 0.002
    assert (np.abs(bias - truth.gyroscope_bias.mean(axis=0)) < 4.0 * deviation).all()


def test_with_rotation_a_scale_is_found() -> None:
    """A gyroscope that reads 5 % too much on a body that sways."""
    swaying = inertial_recording(upside_down, seed=3, n_frames=60)
    imu = swaying.imu
    assert imu is not None
    wrong = replace(swaying, imu=replace(imu, angular_velocity=1.05 * imu.angular_velocity))
    checks = diagnosis.diagnose_inertial(wrong).sensors
    assert checks is not None
    scale, deviation = checks.gyroscope_scale
    assert deviation < 0.01
    assert scale == pytest.approx(1.05, abs=4.0 * deviation)
    assert "gyro_scale" in {f.code for f in sensor_findings(checks)}


def test_a_recording_without_tracks_is_refused_in_one_sentence(recording: data.Sequence) -> None:
    blind = replace(recording, observations=data.Observations.none(), n_landmarks=0)
    with pytest.raises(InputError, match="no observations"):
        diagnosis.calibrated(blind)


def test_gaps_and_dropped_samples_are_reported(recording: data.Sequence) -> None:
    imu = recording.imu
    assert imu is not None
    kept = ((imu.t < 2.02) | (imu.t > 2.33)) & (np.arange(len(imu)) % 50 != 7)
    holed = replace(
        imu, t=imu.t[kept], angular_velocity=imu.angular_velocity[kept], specific_force=imu.specific_force[kept]
    )
    found = diagnosis.inertial_findings(diagnosis.diagnose_inertial(replace(recording, imu=holed)))
    codes = {finding.code: finding.before for finding in found}
    assert codes["imu_gaps"] == 1
    assert codes["dropped_samples"] == pytest.approx(len(imu) / 50, abs=3)


@pytest.mark.slow
def test_utias_0027_starts_within_three_sigma_of_the_truth(recordings: Callable[[str], Path]) -> None:
    """Velocity by the truth over two steps, attitude by the tie; the biases are near zero, as batch solutions find."""
    sequence = data.read(
        recordings("utias/2011_09_30_drive_0027_sync_KLT.mat"),
        imu=recordings("imu/2011_09_30_drive_0027_imu0.csv"),
        imu_calibration=recordings("imu/oxts_sensor.yaml"),
    )
    assert sequence.n_frames == 500
    problem = diagnosis.calibrated(sequence)
    start, truth = problem.start, problem.sequence.truth
    assert start is not None
    assert truth is not None
    sigma = np.sqrt(np.diag(start.covariance))
    true = truth.world_T_imu
    velocity = (true[2, :3, 3] - true[0, :3, 3]) / (sequence.t[2] - sequence.t[0])
    assert (np.abs(start.velocity - velocity) < 3.0 * sigma[strapdown.VELOCITY]).all()
    tilt = so3.log_so3(problem.initial_pose[:3, :3].T @ true[0, :3, :3])
    assert (np.abs(tilt) < 3.0 * sigma[strapdown.ROTATION]).all()
    assert (np.abs(start.gyroscope_bias) < 3.0 * sigma[strapdown.GYROSCOPE_BIAS]).all()
    assert (np.abs(start.accelerometer_bias) < 3.0 * sigma[strapdown.ACCELEROMETER_BIAS]).all()


def test_the_commands_take_a_recording_with_samples(recording: data.Sequence, tmp_path: Path) -> None:
    data.write_npz(recording, tmp_path / "turn.npz")
    diagnosed = fgbaseline("diagnose", "turn.npz", "--out", "d", cwd=tmp_path)
    assert diagnosed.returncode == 1, diagnosed.stderr  # its biases are findings
    assert "gyro_bias" in diagnosed.stdout
    report = json.loads((tmp_path / "d" / "diagnosis.json").read_text())
    assert report["imu"]["samples"] == len(recording.imu or ())
    assert len(report["start"]["std"]) == strapdown.STATE
    exported = fgbaseline("export", "turn.npz", "--out", "p", cwd=tmp_path)
    assert exported.returncode == 0, exported.stderr
    assert data.read_problem(tmp_path / "p").start is not None
    refused = fgbaseline("run", "turn.npz", "--preset", "documented", "--out", "r", cwd=tmp_path)
    assert refused.returncode == 2
    assert "raw inertial data" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_upside_down_is_a_problem_like_any_other() -> None:
    found = diagnosis.calibrated(inertial_recording(upside_down, n_frames=40))
    assert found.initial_pose[2, 2] < -0.9
    assert faults(found) == []


def with_jumps(recording: data.Sequence, sensor: str, at: list[int], size: float) -> data.Sequence:
    """The recording with `size` added to all axes of one sensor at these samples."""
    assert recording.imu is not None
    values = getattr(recording.imu, sensor).copy()
    values[at] += size
    return replace(recording, imu=replace(recording.imu, **{sensor: values}))


@pytest.mark.parametrize(
    ("sensor", "size", "code"),
    [("specific_force", 400.0, "accelerometer_spikes"), ("angular_velocity", -30.0, "gyroscope_spikes")],
)
def test_single_samples_far_from_all_around_are_replaced_and_counted(
    recording: data.Sequence, problem: Problem, sensor: str, size: float, code: str
) -> None:
    found = diagnosis.calibrated(with_jumps(recording, sensor, [40, 90, 200], size))
    assert faults(found) == [code]
    assert next(f for f in found.findings if f.code == code).before == 3
    assert found.sequence.imu is not None
    assert problem.sequence.imu is not None
    ours, clean = getattr(found.sequence.imu, sensor), getattr(problem.sequence.imu, sensor)
    np.testing.assert_allclose(ours[[40, 90, 200]], clean[[40, 90, 200]], atol=abs(size) / 200.0)
    np.testing.assert_array_equal(np.delete(ours, [40, 90, 200], axis=0), np.delete(clean, [40, 90, 200], axis=0))


def test_a_shock_of_three_samples_is_no_spike(recording: data.Sequence) -> None:
    shaken = with_jumps(recording, "specific_force", [80, 81, 82], 200.0)
    assert without_spikes(shaken) == (shaken, ())


@pytest.mark.parametrize(
    "name",
    [
        "imu/2011_09_30_drive_0027_imu0.csv",
        "euroc/V1_02_medium/mav0/imu0/data.csv",
        "euroc/MH_04_difficult/mav0/imu0/data.csv",
    ],
)
def test_samples_of_real_units_have_no_spikes(recordings: Callable[[str], Path], name: str) -> None:
    rows = np.loadtxt(recordings(name), delimiter=",", comments="#", usecols=range(7))
    samples = ImuSamples((rows[:, 0] - rows[0, 0]) * 1e-9, rows[:, 1:4], rows[:, 4:7], ASSUMED_NOISE)
    drawn = inertial_recording(turn, seed=1, n_frames=10)
    assert without_spikes(replace(drawn, imu=samples))[1] == ()
