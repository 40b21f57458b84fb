"""Velocity samples that contradict the cameras and their neighbors are found, replaced, and change nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from fgbaseline.data import Sequence
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import held_samples
from fgbaseline.diagnosis import Repairs, calibrated, diagnose, findings_of, repairs_text
from fgbaseline.geometry import FloatArray, se3

RECORDINGS = (("town", 1), ("handheld", 4), ("drone", 2))
PLACES = {"one": [40], "the first": [0], "scattered": [7, 30, 31, 55, 80], "in a row": [50, 51, 52, 53]}
LINEAR = {"500 m/s": [500.0, 0.0, 0.0], "40 m/s sideways": [0.0, -40.0, 0.0]}
ANGULAR = {"-300 rad/s": [0.0, 0.0, -300.0], "30 rad/s": [17.0, 17.0, 17.0]}


def clean(path: str, seed: int) -> Sequence:
    return simulate(Simulation(path=path, seed=seed, duration=10.0, wrong_share=0.0))


def with_samples(sequence: Sequence, name: str, frames: list[int], value: list[float]) -> Sequence:
    samples = getattr(sequence, name).copy()
    samples[frames] = value
    return replace(sequence, **{name: samples})


def errors(sequence: Sequence) -> FloatArray:
    """(T-1, 6) errors of the problem's increments, in their deviations."""
    assert sequence.truth is not None
    problem = calibrated(sequence)
    pose = sequence.truth.world_T_imu
    difference = se3.log(se3.inverse(se3.exp(problem.increment)) @ se3.inverse(pose[:-1]) @ pose[1:])
    return difference / np.sqrt(np.einsum("nii->ni", problem.increment_covariance))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("path", "seed"), RECORDINGS)
def test_impossible_velocities_are_found_and_change_no_estimate(path: str, seed: int, place: str) -> None:
    sequence, frames = clean(path, seed), PLACES[place]
    before = diagnose(sequence)
    assert before.fit is not None
    assert before.outliers is None
    for name, values in (("linear_velocity", LINEAR), ("angular_velocity", ANGULAR)):
        for value in values.values():
            found = diagnose(with_samples(sequence, name, frames, value))
            assert found.outliers is not None
            assert found.fit is not None
            masks = {"linear_velocity": found.outliers.linear, "angular_velocity": found.outliers.angular}
            assert np.flatnonzero(masks.pop(name)).tolist() == frames
            assert not next(iter(masks.values())).any()
            (finding,) = findings_of(found)
            assert finding.code == f"{name}_outliers"
            assert finding.before == len(frames)
            assert found.shift == before.shift
            assert (np.abs(found.fit.calibration - before.fit.calibration) < 2.0 * before.fit.deviation).all()
            for sigma in ("pixel", "linear_velocity", "angular_velocity"):
                assert getattr(found.fit.sigmas, sigma) == pytest.approx(getattr(before.fit.sigmas, sigma), rel=0.25)


@pytest.mark.parametrize(("path", "seed"), RECORDINGS)
def test_an_interpolated_velocity_is_consistent_with_its_deviation(path: str, seed: int) -> None:
    sequence = clean(path, seed)
    for name, value in (("linear_velocity", [500.0, 0.0, 0.0]), ("angular_velocity", [0.0, 0.0, -300.0])):
        for frames in PLACES.values():
            off = errors(with_samples(sequence, name, frames, value))
            held = np.unique(np.clip(frames, 0, sequence.n_frames - 2))
            assert np.sqrt(np.mean(off[held] ** 2)) < 3.0
            assert np.sqrt(np.mean(off**2)) < 1.5


def test_samples_of_zero_in_a_moving_recording_are_outliers() -> None:
    found = diagnose(with_samples(clean("highway", 1), "linear_velocity", [20, 60, 61], [0.0, 0.0, 0.0]))
    assert found.outliers is not None
    assert np.flatnonzero(found.outliers.linear).tolist() == [20, 60, 61]


def test_a_repair_file_keeps_outliers_as_recorded() -> None:
    sequence = with_samples(clean("town", 1), "linear_velocity", [40], [500.0, 0.0, 0.0])
    assert "replace_outliers = true" in repairs_text(diagnose(sequence))
    assert calibrated(sequence).sequence.linear_velocity[40, 0] < 50.0
    kept = calibrated(sequence, repairs=Repairs(replace_outliers=False))
    assert np.linalg.norm(kept.sequence.linear_velocity[40]) == pytest.approx(500.0)
    assert not any("outliers" in finding.code for finding in kept.findings)


def test_a_held_sample_moves_the_intervals_that_it_touches() -> None:
    one = np.eye(6)[2][:, None]
    assert held_samples(one, 0.0)[:, 0].tolist() == [0, 0, 1, 0, 0]
    assert held_samples(one, -0.5)[:, 0].tolist() == [0, 0.5, 0.5, 0, 0]
    assert held_samples(one, -1.0)[:, 0].tolist() == [0, 1, 0, 0, 0]
