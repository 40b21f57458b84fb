"""Recordings of one camera: observations [uL, vL, NaN, NaN] in files, in simulation, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data.problem_export import read_problem, write_problem
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
from fgbaseline.geometry import InputError, MonocularCamera

from ..builders.commands import fgbaseline
from ..builders.inertial import simulated_problem

IMU_KEYS = ("imu_time_stamps", "imu_angular_velocity", "imu_linear_acceleration", "imu_noise", "gravity")


def recording() -> data.Sequence:
    return simulate(Simulation(path="drone", duration=2.0, imu=SimulatedImu(), cameras="left", seed=3))


def arrays_of(path: Path, sequence: data.Sequence) -> dict[str, np.ndarray]:
    data.write_npz(sequence, path)
    with np.load(path) as stored:
        return dict(stored)


def test_one_camera_is_the_left_one_of_the_simulated_pair() -> None:
    one, two = recording(), simulate(Simulation(path="drone", duration=2.0, imu=SimulatedImu(), seed=3))
    np.testing.assert_array_equal(one.observations.pixel[:, :2], two.observations.pixel[:, :2])
    assert np.isnan(one.observations.pixel[:, 2:]).all()
    assert one.monocular
    assert not two.monocular
    assert one.camera == MonocularCamera(two.camera.fu, two.camera.fv, two.camera.cu, two.camera.cv)


@pytest.mark.parametrize("flat", [False, True])
def test_it_is_written_without_a_baseline_and_read_back(tmp_path: Path, flat: bool) -> None:
    sequence = recording()
    data.write_npz(sequence, tmp_path / "one.npz", tracks=sequence.observations if flat else None)
    with np.load(tmp_path / "one.npz") as stored:
        assert "b" not in stored.files
    back = data.read(tmp_path / "one.npz")
    assert back.camera == sequence.camera
    for name in ("frame", "landmark", "pixel"):
        np.testing.assert_array_equal(getattr(back.observations, name), getattr(sequence.observations, name))


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_baseline_that_is_given_is_ignored_with_a_remark(tmp_path: Path, order: str) -> None:
    arrays = arrays_of(tmp_path / "one.npz", recording())
    arrays["features"] = np.asarray(arrays["features"], order=order)  # type: ignore[call-overload]
    np.savez(tmp_path / "b.npz", **arrays, b=0.1)
    back = data.read(tmp_path / "b.npz")
    assert back.monocular
    assert any("b is ignored" in remark for remark in back.remarks)


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_mixture_and_half_an_observation_are_refused_by_landmark_and_frame(tmp_path: Path, order: str) -> None:
    arrays = arrays_of(tmp_path / "one.npz", recording())
    o = data.read(tmp_path / "one.npz").observations
    features, j, k = np.asarray(arrays.pop("features"), order=order), o.landmark[5], o.frame[5]  # type: ignore[call-overload]
    for pixel, said in (
        ([100.0, 90.0, 80.0, 90.0], "by two"),
        ([100.0, np.nan, np.nan, np.nan], f"vL of landmark {j} in frame {k} is nan"),
        ([100.0, 90.0, np.nan, 90.0], f"uR of landmark {j} in frame {k} is nan"),
        ([100.0, 90.0, np.nan, np.inf], f"vR of landmark {j} in frame {k} is inf"),
    ):
        changed = features.copy(order="K")
        changed[:, j, k] = pixel
        np.savez(tmp_path / "bad.npz", **arrays, features=changed, b=0.1)
        with pytest.raises(InputError, match=said):
            data.read(tmp_path / "bad.npz")


def test_without_inertial_samples_it_is_refused_in_a_sentence(tmp_path: Path) -> None:
    arrays = arrays_of(tmp_path / "one.npz", recording())
    T = arrays["time_stamps"].size
    arrays = {key: value for key, value in arrays.items() if key not in IMU_KEYS and not key.startswith("true_")}
    arrays |= {"linear_velocity": np.ones((3, T)), "angular_velocity": np.zeros((3, T))}
    np.savez(tmp_path / "velocities.npz", **arrays)
    with pytest.raises(InputError, match="only raw inertial samples determine the scale of the trajectory") as refused:
        data.read(tmp_path / "velocities.npz")
    assert "velocities.npz" in str(refused.value)
    answer = fgbaseline("run", "velocities.npz", "--out", "out", cwd=tmp_path)
    assert answer.returncode == 2
    assert answer.stderr.count("\n") == 1
    with pytest.raises(InputError, match="cameras"):
        Simulation(cameras="left")


def test_the_commands_simulate_and_solve_it(tmp_path: Path) -> None:
    options = ("--path", "drone", "--duration", "4", "--features-per-frame", "30")
    answer = fgbaseline("simulate", "one.npz", "--imu", "--cameras", "left", *options, cwd=tmp_path)
    assert answer.returncode == 0, answer.stderr
    assert data.read(tmp_path / "one.npz").monocular
    answer = fgbaseline("run", "one.npz", "--out", "out/one", cwd=tmp_path, drawing=False)
    assert answer.returncode == 0, answer.stderr
    summary = json.loads((tmp_path / "out" / "one" / "summary.json").read_text())
    assert set(summary["estimators"]) == {"dead-reckoning", "joint-ekf", "isam2", "isam2-online", "batch"}
    found = summary["estimators"]["isam2"]
    assert found["ate"]["rmse"] < 0.05
    assert found["ate_sim3"] <= found["ate_se3"] < 0.05
    assert abs(found["scale_error"]) < 0.05
    assert "scale" in answer.stdout
    assert any("determines the scale to" in remark for remark in summary["problem"]["remarks"])
    answer = fgbaseline("diagnose", "one.npz", "--out", "out/found", cwd=tmp_path, drawing=False)
    assert answer.returncode == 0, answer.stderr
    assert "No fault detected" in answer.stdout
    assert "one camera measures no length" in " ".join(answer.stdout.split())
    found = json.loads((tmp_path / "out" / "found" / "diagnosis.json").read_text())
    assert found["start"]["source"]
    assert abs(found["sensors"]["time_offset_s"]) < 0.02
    assert found["sigma"]["pixel"] == pytest.approx(0.5, rel=0.15)
    assert '"baseline":null' in (tmp_path / "out" / "one" / "report.html").read_text()


def test_an_exported_problem_comes_back(tmp_path: Path) -> None:
    problem = simulated_problem("drone", 1, seconds=2.0, cameras="left")
    (tmp_path / "out").mkdir()
    write_problem(problem, tmp_path / "out")
    back = read_problem(tmp_path / "out")
    assert back.sequence.camera == problem.sequence.camera
    assert back.inverse_depth_prior == problem.inverse_depth_prior
    np.testing.assert_array_equal(back.sequence.observations.pixel, problem.sequence.observations.pixel)
