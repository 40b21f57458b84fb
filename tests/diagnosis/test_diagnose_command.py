"""`fgbaseline diagnose` as its users start it, and diagnosis.json."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline.data import Sequence, write_npz
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate

from ..builders.commands import everything_in, fgbaseline


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A clean drive, one with reversed and biased rates, and one that shows too little."""
    folder = tmp_path_factory.mktemp("recordings")
    made: dict[str, Sequence] = {
        "clean": simulate(Simulation(duration=20.0, seed=4)),
        "biased": simulate(
            Simulation(path="handheld", duration=15.0, angular_axes="x,-y,-z", gyro_bias=(0.02, 0.0, 0.0), seed=4)
        ),
        "blind": simulate(Simulation(duration=10.0, blackouts=((0.5, 9.9),))),
        "blind samples": simulate(Simulation(duration=5.0, blackouts=((0.15, 4.9),), imu=SimulatedImu())),
    }
    for name, sequence in made.items():
        write_npz(sequence, folder / f"{name}.npz")
    return {name: folder / f"{name}.npz" for name in made}


def strict(text: str) -> dict[str, Any]:
    """The JSON; NaN and Infinity are no JSON."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    read: dict[str, Any] = json.loads(text, parse_constant=refuse)
    return read


def test_a_clean_drive_exits_with_zero(files: dict[str, Path], tmp_path: Path) -> None:
    result = fgbaseline("diagnose", files["clean"], cwd=tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "No fault detected" in result.stdout
    assert "Noise (1-sigma)" in result.stdout
    assert everything_in(tmp_path) == set()


def test_findings_exit_with_one_and_are_in_the_table(files: dict[str, Path], tmp_path: Path) -> None:
    result = fgbaseline("diagnose", files["biased"], "--out", "out/d", cwd=tmp_path)
    assert result.returncode == 1, result.stdout + result.stderr
    assert "angular_axes" in result.stdout
    assert "w_y and w_z are recorded with the opposite sign" in result.stdout
    assert "gyro_bias" in result.stdout
    report = strict((tmp_path / "out/d/diagnosis.json").read_text())
    assert [finding["code"] for finding in report["findings"]] == ["angular_axes", "gyro_bias"]
    assert report["axes"]["angular_velocity"] == np.diag([1.0, -1.0, -1.0]).tolist()
    assert report["axes"]["linear_velocity"] == np.eye(3).tolist()
    assert np.allclose(report["gyro_bias"], [0.02, 0.0, 0.0], atol=0.002)
    for finding in report["findings"]:
        assert finding["after"] < finding["before"]
    again = fgbaseline("diagnose", files["biased"], "--out", "out/d", cwd=tmp_path)
    assert again.returncode == 2
    assert "--force" in again.stderr


def test_json_is_alone_on_standard_output(files: dict[str, Path], tmp_path: Path) -> None:
    result = fgbaseline("diagnose", files["clean"], "--json", cwd=tmp_path)
    report = strict(result.stdout)
    assert report["schema"] == "fgbaseline/diagnosis/1"
    assert report["findings"] == []
    assert set(report["sigma"]) >= {"linear_velocity", "angular_velocity", "pixel", "pixel_white", "pixel_inflation"}
    assert len(report["wrong_matches"]) == report["sequence"]["frames"]
    assert report["wrong_matches"][0] is None
    assert "wrong_matches" in report["notes"]


def test_an_undetermined_motion_exits_with_two_and_the_reason(files: dict[str, Path], tmp_path: Path) -> None:
    finished = fgbaseline("diagnose", files["blind"], cwd=tmp_path)
    assert finished.returncode == 2
    assert "the cameras determine the motion of only" in finished.stdout
    assert "Traceback" not in finished.stderr
    report = strict(fgbaseline("diagnose", files["blind"], "--json", cwd=tmp_path).stdout)
    assert "the cameras determine the motion of only" in report["cannot_tell"]
    assert report["sigma"]["pixel"] is None
    assert "sigma.pixel" in report["notes"]
    assert report["gyro_bias"] == [None, None, None]


def test_recordings_of_both_kinds_get_the_same_sentences(files: dict[str, Path], tmp_path: Path) -> None:
    for name, measured in (("blind", "velocities"), ("blind samples", "inertial samples")):
        finished = fgbaseline("diagnose", files[name], "--out", name, cwd=tmp_path)
        assert finished.returncode == 2, finished.stderr
        assert f"The {measured} cannot be diagnosed: " in finished.stdout
        assert finished.stdout.endswith(f"\n\nThe diagnosis is in {name}\n")
    refused = fgbaseline("diagnose", files["blind samples"], "--write-repairs", "repairs.toml", cwd=tmp_path)
    assert refused.returncode == 2
    assert "raw inertial samples has no repairs" in refused.stderr


def test_bad_input_is_one_sentence(tmp_path: Path) -> None:
    result = fgbaseline("diagnose", "nowhere.npz", cwd=tmp_path)
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    assert "nowhere.npz" in result.stderr


def test_force_without_a_folder_is_refused(files: dict[str, Path], tmp_path: Path) -> None:
    result = fgbaseline("diagnose", files["clean"], "--force", cwd=tmp_path)
    assert result.returncode == 2
    assert "--out" in result.stderr
