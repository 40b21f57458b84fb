"""Diagnosis with one camera: what it finds and repairs is what a stereo pair would, and what it cannot is named."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fgbaseline.data import Sequence
from fgbaseline.data.axis_conventions import axes_matrix
from fgbaseline.data.problem import Excluded, Problem
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
from fgbaseline.diagnosis import AsRecordedSettings, InertialDiagnosis, calibrated, diagnose_inertial, inertial_findings
from fgbaseline.diagnosis.odometry import epipolar_motion
from fgbaseline.diagnosis.odometry.epipolar_motion import Motion, RayMatches, epipolar_motions
from fgbaseline.diagnosis.odometry.monocular_odometry import monocular_odometry, rays, track_pairs
from fgbaseline.geometry import FloatArray, InputError, se3, so3

SETTINGS = Simulation(path="handheld", duration=8.0, imu=SimulatedImu(), cameras="left", wrong_share=0.0, seed=3)


@cache
def clean() -> Sequence:
    return simulate(SETTINGS)


@cache
def problem_of_clean() -> Problem:
    return calibrated(clean())


def with_samples(**changed: FloatArray) -> Sequence:
    imu = clean().imu
    assert imu is not None
    return replace(clean(), imu=replace(imu, **changed))


def samples() -> tuple[FloatArray, FloatArray, FloatArray]:
    imu = clean().imu
    assert imu is not None
    return imu.t, imu.angular_velocity, imu.specific_force


def codes(found: InertialDiagnosis) -> set[str]:
    return {finding.code for finding in inertial_findings(found)}


def test_jacobians_of_the_epipolar_residual_are_its_finite_differences() -> None:
    rng = np.random.default_rng(0)
    first = rng.normal(size=(8, 3))
    second = first + 0.1 * rng.normal(size=first.shape)
    first, second = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (first, second))
    matches, t = RayMatches(np.zeros(8, np.int64), first, second), np.array([[0.6, 0.0, 0.8]])
    R = so3.exp_so3(0.3 * rng.normal(size=(1, 3)))

    def residuals(delta: FloatArray) -> FloatArray:
        moved = t + (epipolar_motion._basis(t) @ delta[3:, None])[:, :, 0]
        motion = Motion(R @ so3.exp_so3(delta[None, :3]), moved / np.linalg.norm(moved))
        return epipolar_motion._residuals(matches, motion)[0]

    slopes = [(residuals(1e-6 * e) - residuals(-1e-6 * e)) / 2e-6 for e in np.eye(5)]
    for i, weight in enumerate(np.eye(8)):
        _, gradient = epipolar_motion._normal_equations(matches, Motion(R, t), weight, 1)
        assert np.allclose(-gradient[0], residuals(np.zeros(5))[i] * np.array(slopes)[:, i], atol=1e-8)


def test_rotations_and_directions_are_those_of_the_truth() -> None:
    sequence, truth = clean(), clean().truth
    assert truth is not None
    seen = monocular_odometry(sequence)
    assert seen.known.all()
    assert np.isnan(seen.motion[:, :3, 3]).all()
    motion = se3.relative(truth.world_T_imu)
    error = so3.log_so3(np.swapaxes(motion[:, :3, :3], 1, 2) @ seen.motion[:, :3, :3])
    assert np.median(np.abs(error)) < 2.5e-3
    before, after = track_pairs(sequence, 1)
    ray = rays(sequence)
    matches = RayMatches(sequence.observations.frame[before], ray[before], ray[after])
    found = epipolar_motions(matches, sequence.n_frames - 1).motion
    camera = se3.relative(truth.world_T_imu @ sequence.imu_T_cam)[:, :3, 3] @ sequence.imu_T_cam[:3, :3].T
    cosine = (camera * found.direction).sum(axis=1) / np.linalg.norm(camera, axis=1)
    assert np.median(cosine) > 0.98


def test_a_clean_recording_has_no_finding() -> None:
    found = diagnose_inertial(clean())
    assert not found.failure_reason
    assert codes(found) == set()
    assert found.pixel == pytest.approx(0.5, rel=0.15)


@pytest.mark.parametrize("axes", ["y,-x,z", "z,x,y"])
def test_exchanged_axes_of_both_sensors_are_found_and_turned_back(axes: str) -> None:
    _, rate, force = samples()
    matrix = axes_matrix(axes)
    found = diagnose_inertial(with_samples(angular_velocity=rate @ matrix, specific_force=force @ matrix))
    assert codes(found) == {"angular_axes", "accelerometer_axes"}
    assert found.axes.gyroscope is not None
    assert found.axes.gyroscope.name == found.axes.accelerometer == axes
    problem = calibrated(found.recorded)
    assert np.allclose(problem.initial_pose, problem_of_clean().initial_pose)
    assert any("turned from the axes they were recorded in" in repair for repair in problem.repairs)


def test_a_specific_force_of_the_opposite_sign_is_found_and_turned_back() -> None:
    found = diagnose_inertial(with_samples(specific_force=-samples()[2]))
    assert codes(found) == {"accelerometer_axes"}
    assert found.axes.sign == -1.0


@pytest.mark.parametrize(
    ("name", "factor", "code"),
    [
        ("angular_velocity", 180.0 / np.pi, "angular_velocity_unit"),
        ("specific_force", 1.0 / 9.80665, "accelerometer_unit"),
    ],
)
def test_other_units_are_converted_or_refused_as_recorded(name: str, factor: float, code: str) -> None:
    values = dict(zip(("angular_velocity", "specific_force"), samples()[1:], strict=True))
    wrong = with_samples(**{name: factor * values[name]})
    found = diagnose_inertial(wrong)
    assert codes(found) == {code}
    assert found.sequence.imu is not None
    assert np.allclose(getattr(found.sequence.imu, name), values[name])
    with pytest.raises(InputError, match="run without --as-recorded, which repairs them"):
        calibrated(wrong, settings=AsRecordedSettings())


@pytest.mark.parametrize("late", [0.095, -0.095])
def test_a_delay_is_found_and_named(late: float) -> None:
    """As with a stereo pair it is not repaired, which its sentence says."""
    t, *values = samples()
    rate, force = (np.stack([np.interp(t - late, t, x) for x in each.T], axis=1) for each in values)
    found = diagnose_inertial(with_samples(angular_velocity=rate, specific_force=force))
    assert "time_offset" in codes(found)
    assert found.sensors is not None
    offset, deviation = found.sensors.time_offset
    assert abs(offset - late) < max(0.01, 3.0 * deviation)
    (finding,) = [each for each in inertial_findings(found) if each.code == "time_offset"]
    assert "Estimators take the stamps as they are" in finding.sentence


def test_wrong_tracks_are_masked_and_right_ones_are_not() -> None:
    sequence = simulate(replace(SETTINGS, wrong_share=0.05))
    problem = calibrated(sequence)
    o, now = sequence.observations, problem.sequence.observations
    was, is_now = (np.lexsort((*x.pixel[:, :2].T, x.frame)) for x in (o, now))
    seen = np.empty_like(o.pixel)
    seen[was] = now.pixel[is_now]
    assert np.array_equal(seen[:, :2], o.pixel[:, :2])
    excluded, piece = np.empty(len(o), np.uint8), np.empty(len(o), np.int64)
    excluded[was], piece[was] = problem.excluded[is_now], now.landmark[is_now]
    before, after = track_pairs(sequence, 1)
    moved = o.pixel[:, :2] - clean().observations.pixel[:, :2]
    jump = np.abs(moved[after, 1] - moved[before, 1]) > 10.0  # across most epipolar lines
    kept = (excluded[before] == Excluded.NO) & (excluded[after] == Excluded.NO) & (piece[before] == piece[after])
    assert jump.sum() > 30
    assert kept[jump].mean() < 0.2
    right = (moved == 0.0).all(axis=1)
    assert (excluded[right] == Excluded.PREDICTION).mean() < 0.003
    assert problem.pixel_variance**0.5 == pytest.approx(0.5, rel=0.2)


def test_intrinsics_of_other_images_are_refused() -> None:
    camera = clean().camera
    other = replace(camera, fu=3.0 * camera.fu, fv=3.0 * camera.fv, cu=3.0 * camera.cu, cv=3.0 * camera.cv)
    wrong = replace(clean(), camera=other)
    assert "scale K or features" in diagnose_inertial(wrong).failure_reason
    for settings in (None, AsRecordedSettings()):
        with pytest.raises(InputError, match="scale K or features"):
            calibrated(wrong, settings=settings)
