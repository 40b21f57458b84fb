"""The start of one camera: right within its covariance, and what it says where the motion does not excite the scale."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import diagnosis
from fgbaseline.data import Problem, Sequence
from fgbaseline.data.imu import ImuSamples
from fgbaseline.data.problem import Excluded
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
from fgbaseline.diagnosis import AsRecordedSettings
from fgbaseline.diagnosis.inertial.monocular.gyroscope_bias import epipolar_bias
from fgbaseline.diagnosis.inertial.monocular.initial_state import MonocularStart, monocular_start
from fgbaseline.diagnosis.inertial.monocular.window_tracks import keyframe_tracks, rays_of
from fgbaseline.diagnosis.inertial_initialization.states import motions_between
from fgbaseline.geometry import InputError

from ..builders.inertial import simulated_problem
from .test_inertial_start import FREE, nees

SEEDS = 10


def started(sequence: Sequence) -> MonocularStart:
    assert sequence.imu is not None
    return monocular_start(sequence, imu_intervals(sequence.imu, sequence.t))


@pytest.fixture(scope="module")
def recordings() -> list[Sequence]:
    return [simulated_problem("drone", seed, seconds=5.0, cameras="left").sequence for seed in range(SEEDS)]


def test_the_gyroscope_bias_satisfies_the_epipolar_constraint(recordings: list[Sequence]) -> None:
    for sequence in recordings[:4]:
        assert sequence.imu is not None
        assert sequence.truth is not None
        assert sequence.truth.gyroscope_bias is not None
        frames = np.arange(0, 31, 2)
        zero = motions_between(imu_intervals(sequence.imu, sequence.t), frames, np.zeros((len(frames) - 1, 6)))
        found = epipolar_bias(rays_of(keyframe_tracks(sequence, frames, 0.5)), zero)
        assert np.abs(found - sequence.truth.gyroscope_bias[0]).max() < 0.01


def test_the_start_in_motion_is_right_within_its_covariance(recordings: list[Sequence]) -> None:
    found = [started(sequence) for sequence in recordings]
    assert all(start.excited for start in found)
    values = [nees(start.start, sequence) for start, sequence in zip(found, recordings, strict=True)]
    low, high = chi2.ppf([1e-3, 1.0 - 1e-3], FREE * SEEDS) / SEEDS
    assert low < np.mean(values) < high
    pixel = np.array([start.pixel for start in found])
    assert np.abs(pixel / 0.5 - 1.0).max() < 0.15


def test_estimators_do_not_use_the_observations_of_the_start_again(recordings: list[Sequence]) -> None:
    problem, o = diagnosis.calibrated(recordings[0]), recordings[0].observations
    assert problem.start is not None
    of_start = problem.excluded == Excluded.START
    early = problem.sequence.observations.frame <= problem.sequence.observations.frame[of_start].max()
    tracks = np.unique(problem.sequence.observations.landmark[of_start])
    assert 0.3 < np.mean(of_start[early]) < 0.6
    assert f"these {of_start.sum()} of {len(o)} observations" in problem.start.source
    own = np.isin(problem.sequence.observations.landmark, tracks) & early & (problem.excluded == Excluded.NO)
    assert np.mean(own[early]) < 0.05  # in the frame that is no keyframe
    standing = simulate(Simulation(path="drone", duration=8.0, standing=3.0, imu=SimulatedImu(), cameras="left"))
    assert not (diagnosis.calibrated(standing).excluded == Excluded.START).any()


def test_a_standing_start_finds_its_scale_in_the_motion_that_follows() -> None:
    sequence = simulate(
        Simulation(path="drone", duration=10.0, standing=3.0, imu=SimulatedImu(), cameras="left", wrong_share=0.0)
    )
    found = started(sequence)
    assert 2.5 < found.start.standing < 6.0
    assert found.excited
    assert np.abs(found.start.state.velocity).max() < 0.01
    assert nees(found.start, sequence) < chi2.ppf(0.9999, FREE)


def unexcited() -> Sequence:
    """The camera of a vehicle that moves at a constant velocity, so that the accelerometer shows gravity only."""
    sequence = simulate(
        Simulation(path="drone", duration=4.0, imu=SimulatedImu(), cameras="left", wrong_share=0.0, seed=1)
    )
    truth, imu = sequence.truth, sequence.imu
    assert truth is not None
    assert truth.landmarks is not None
    assert imu is not None
    o, T = sequence.observations, sequence.n_frames
    poses = np.tile(truth.world_T_imu[0], (T, 1, 1))
    ahead = truth.world_T_imu[0, :3, :3] @ np.array([0.0, 1.0, 0.0])
    poses[:, :3, 3] += (sequence.t - sequence.t[0])[:, None] * 0.4 * ahead
    cam_T_world = np.linalg.inv(poses @ sequence.imu_T_cam)[o.frame]
    p = np.einsum("nij,nj->ni", cam_T_world[:, :3, :3], truth.landmarks[o.landmark]) + cam_T_world[:, :3, 3]
    noise = 0.5 * np.random.default_rng(0).normal(size=(len(o), 4))
    seen = p[:, 2] > 0.5
    pixel = np.ascontiguousarray((sequence.camera.project(p) + noise)[seen])
    observations = type(o)(o.frame[seen], o.landmark[seen], pixel)
    force = truth.world_T_imu[0, :3, :3].T @ [0.0, 0.0, imu.gravity]
    samples = np.random.default_rng(1).normal(size=(len(imu), 6)) * np.sqrt(200.0)
    still = ImuSamples(
        imu.t,
        imu.noise.gyroscope_density * samples[:, :3],
        force + imu.noise.accelerometer_density * samples[:, 3:],
        imu.noise,
        imu.gravity,
    )
    return replace(sequence, observations=observations, imu=still, truth=None)


def test_motion_that_does_not_excite_the_accelerometer_is_named_with_its_figure() -> None:
    problem = diagnosis.calibrated(unexcited())
    (finding,) = [each for each in problem.findings if each.code == "scale_not_excited"]
    assert "does not excite the accelerometer" in finding.sentence
    assert finding.before > 0.1
    assert f"{100.0 * finding.before:.2g} %" in finding.sentence


def test_the_calibrated_problem_has_start_noise_depths_and_remarks(recordings: list[Sequence]) -> None:
    problem: Problem = diagnosis.calibrated(recordings[0])
    assert problem.start is not None
    assert problem.inverse_depth_prior is not None
    assert problem.diagnosed
    assert problem.pixel_variance**0.5 == pytest.approx(0.5, rel=0.15)
    assert any("determines the scale to" in remark for remark in problem.remarks)
    given = diagnosis.calibrated(recordings[0], settings=AsRecordedSettings())
    assert not given.diagnosed
    assert given.pixel_variance == 1.5**2


def test_too_few_tracks_are_refused_in_a_sentence(recordings: list[Sequence]) -> None:
    sequence = recordings[0]
    few = sequence.observations.select(sequence.observations.landmark < 4)
    with pytest.raises(InputError, match="the start of one camera is not found"):
        diagnosis.calibrated(replace(sequence, observations=few))


def test_a_camera_far_from_the_imu_is_refused_in_a_sentence(recordings: list[Sequence]) -> None:
    imu_T_cam = recordings[0].imu_T_cam.copy()
    imu_T_cam[:3, 3] *= 1000.0
    with pytest.raises(InputError, match=r"imu_T_cam places the camera .* m from the IMU, and nothing confirms that"):
        diagnosis.calibrated(replace(recordings[0], imu_T_cam=imu_T_cam))
