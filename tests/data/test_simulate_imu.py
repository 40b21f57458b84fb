"""Simulated inertial samples are the derivatives of the simulated path, with the noise that the settings state."""

from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
from fgbaseline.geometry import InputError, se3, so3, strapdown

from ..builders.commands import fgbaseline

QUIET = {"gyroscope_density": 0.0, "gyroscope_walk": 0.0, "accelerometer_density": 0.0, "accelerometer_walk": 0.0}


def integrated_error(path: str, rate: float, standing: float = 0.0) -> tuple[float, float]:
    """Error of position, m, and rotation, rad, after integrating 10 s of samples without noise."""
    imu = SimulatedImu(rate=rate, **QUIET)
    sequence = simulate(
        Simulation(path=path, duration=10.0, standing=standing, imu=imu, features_per_frame=5.0)  # type: ignore[arg-type]
    )
    assert sequence.imu is not None
    assert sequence.truth is not None
    assert sequence.truth.velocity is not None
    intervals, zero = imu_intervals(sequence.imu, sequence.t), np.zeros(3)
    pose, velocity = sequence.truth.world_T_imu[0], sequence.truth.velocity[0]
    for k in range(sequence.n_frames - 1):
        pose, velocity = strapdown.predict(pose, velocity, intervals.motion(k, zero, zero), intervals.gravity_vector)
    error = se3.log(se3.inverse(pose) @ sequence.truth.world_T_imu[-1])
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))


@pytest.mark.parametrize(("path", "standing"), [("town", 0.0), ("town", 3.0), ("handheld", 0.0), ("drone", 2.0)])
def test_integrated_samples_give_the_true_path_to_second_order_of_the_sample_period(path: str, standing: float) -> None:
    coarse, fine = integrated_error(path, 100.0, standing), integrated_error(path, 400.0, standing)
    assert fine[0] < 0.003
    assert fine[1] < 1e-5
    for at_100, at_400 in zip(coarse, fine, strict=True):
        assert at_400 < at_100 / 12.0 or at_100 < 1e-9  # a quarter of the period: a sixteenth of the error


def test_noise_and_walks_have_the_stated_densities() -> None:
    common = {"path": "drone", "duration": 50.0, "features_per_frame": 2.0, "seed": 3}
    imu = SimulatedImu(gyroscope_density=1e-3, gyroscope_walk=1e-4, accelerometer_density=2e-2, accelerometer_walk=3e-3)
    noisy = simulate(Simulation(**common, imu=imu))  # type: ignore[arg-type]
    exact = simulate(Simulation(**common, imu=SimulatedImu(**QUIET)))  # type: ignore[arg-type]
    assert noisy.imu is not None
    assert exact.imu is not None
    assert noisy.truth is not None
    for name, density in (("angular_velocity", 1e-3), ("specific_force", 2e-2)):
        error = getattr(noisy.imu, name) - getattr(exact.imu, name)
        white = np.diff(error, axis=0)  # the walk hardly shows between neighbors
        assert white.std() == pytest.approx(np.sqrt(2.0 * 200.0) * density, rel=0.02)
    for bias, walk in ((noisy.truth.gyroscope_bias, 1e-4), (noisy.truth.accelerometer_bias, 3e-3)):
        assert bias is not None
        steps = np.diff(bias, axis=0) / np.sqrt(noisy.dt)[:, None]
        assert steps.std() == pytest.approx(walk, rel=0.06)
        assert np.all(bias[0] == 0.0)


def test_a_body_at_rest_senses_gravity_upward_and_its_biases() -> None:
    imu = SimulatedImu(**QUIET, accelerometer_bias=(0.1, -0.2, 0.3), gravity=9.79)
    sequence = simulate(Simulation(path="handheld", duration=4.0, standing=3.0, gyro_bias=(0.01, 0.02, -0.03), imu=imu))
    assert sequence.imu is not None
    at_rest = sequence.imu.t < 2.0
    np.testing.assert_allclose(sequence.imu.angular_velocity[at_rest] - [0.01, 0.02, -0.03], 0.0, atol=1e-6)
    np.testing.assert_allclose(
        sequence.imu.specific_force[at_rest] - [0.1, -0.2, 0.3],
        9.79 * np.tile(sequence.up, (at_rest.sum(), 1)),
        atol=1e-4,
    )


def test_the_world_is_upright_and_begins_at_the_first_frame() -> None:
    sequence = simulate(Simulation(path="drone", duration=3.0, imu=SimulatedImu(), seed=2))
    assert sequence.truth is not None
    first = sequence.truth.world_T_imu[0]
    np.testing.assert_allclose(first[:3, 3], 0.0, atol=1e-12)
    np.testing.assert_allclose(first[:3, :3], so3.rotation_to_z(sequence.up), atol=1e-9)


def test_without_imu_a_recording_has_velocities_and_the_same_observations() -> None:
    one = simulate(Simulation(duration=3.0, wrong_share=0.0, sigma_pixel=0.0))
    other = simulate(Simulation(duration=3.0, wrong_share=0.0, sigma_pixel=0.0, imu=SimulatedImu()))
    assert one.imu is None
    assert len(other.linear_velocity) == 0
    np.testing.assert_allclose(one.observations.pixel, other.observations.pixel, atol=1e-6)


@pytest.mark.parametrize("vector", [[0.0, 0.0, 1.0], [0.0, 0.0, -2.0], [1.0, 2.0, 0.5], [1e-13, 0.0, -1.0]])
def test_the_smallest_rotation_to_z_takes_a_direction_there_and_turns_about_no_vertical(vector: list[float]) -> None:
    R = so3.rotation_to_z(vector)
    np.testing.assert_allclose(R @ vector / np.linalg.norm(vector), [0.0, 0.0, 1.0], atol=1e-12)
    assert abs(so3.log_so3(R)[2]) < 1e-12
    assert so3.rotation_defect(R) < 1e-12


def test_the_command_writes_inertial_samples_and_reads_them_back(tmp_path: Path) -> None:
    asked = ("--path", "drone", "--duration", "3", "--imu", "--imu-rate", "100", "--standing", "1")
    done = fgbaseline("simulate", "drone.npz", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    sequence = data.read(tmp_path / "drone.npz")
    assert sequence.imu is not None
    assert sequence.imu.period == pytest.approx(0.01)
    assert sequence.truth is not None
    assert sequence.truth.velocity is not None
    refused = fgbaseline("simulate", "other.npz", "--imu-rate", "100", cwd=tmp_path)
    assert refused.returncode == 2
    assert "--imu" in refused.stderr


def test_impossible_settings_are_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"imu\.rate"):
        SimulatedImu(rate=0.0)
    with pytest.raises(InputError, match=r"imu\.gyroscope_density"):
        SimulatedImu(gyroscope_density=-1.0)
