"""`fgbaseline reproduce`: the report's figures and claims, on small recordings, and on its own."""

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline.data import Observations, Sequence, Status, write_npz
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import dead_reckoned_path, increments
from fgbaseline.geometry import InputError
from fgbaseline.reports.reproduction.experiments import FilterSettings, run_filter
from fgbaseline.reports.reproduction.recordings import (
    TRACKS_PER_FRAME,
    diagnosed_stages,
    paper_recording,
    read_subjects,
    simulated_stages,
    stand_in,
)

from ..builders.commands import everything_in, fgbaseline

QUICK = ("--sweep-features", "20,100", "--sweep-noise", "0.01,15")
BIAS = (0.012, -0.01, 0.008)


def without_features(sequence: Sequence) -> Sequence:
    return replace(sequence, observations=Observations.none(), n_landmarks=0, truth=None)


@pytest.fixture(scope="module")
def faulty() -> Sequence:
    """Twelve seconds in a town, recorded with turned and biased rates."""
    return simulate(Simulation(duration=12.0, features_per_frame=25, seed=3, angular_axes="x,-y,-z", gyro_bias=BIAS))


@pytest.fixture(scope="module")
def folder(faulty: Sequence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("recordings")
    write_npz(faulty, place / "<b>drive&.npz")
    write_npz(without_features(simulate(Simulation(duration=8.0, seed=5))), place / "velocities.npz")
    return place


@pytest.fixture(scope="module")
def reproduced(folder: Path) -> Path:
    """The folder of a reproduction on both, made once."""
    result = fgbaseline("reproduce", "<b>drive&.npz", "velocities.npz", "--out", "out/r", *QUICK, cwd=folder)
    assert result.returncode == 0, result.stderr
    assert "out/r/report.html" in result.stdout
    assert "velocities: Simulated" in result.stderr
    return folder / "out/r"


def claims_in(place: Path) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    read: dict[str, Any] = json.loads((place / "claims.json").read_text(), parse_constant=refuse)
    return read


def test_every_figure_is_there_in_three_forms(reproduced: Path) -> None:
    names = {path.stem for path in (reproduced / "figures").iterdir()}
    kinds = ("path", "arrows", "mapped_700", "mapped_1000", "slam")
    assert names == {"sweep"} | {f"{n}_{k}" for n in ("_b_drive_", "velocities") for k in kinds} | {
        "causes__b_drive_",
        "causes_velocities",
    }
    for name in names:
        starts = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
        assert all((reproduced / f"figures/{name}.{form}").read_bytes().startswith(b) for form, b in starts.items())


def test_claims_are_tested_and_equal_in_both_forms(reproduced: Path) -> None:
    found = claims_in(reproduced)
    with (reproduced / "claims.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["measured"] for row in rows] == [claim["measured"] for claim in found["claims"]]
    verdicts = {(c["recording"], c["code"]): c for c in found["claims"]}
    mapping = verdicts["<b>drive&", "mapping"]
    assert mapping["verdict"] == "holds in part"
    assert "the trajectories are bitwise equal" in mapping["measured"]
    assert "with W = 0 the filter fails" in verdicts["<b>drive&", "low noise"]["measured"]
    assert not verdicts["<b>drive&", "works"]["simulated"]
    assert verdicts["velocities", "works"]["simulated"]
    for recording in found["recordings"]:
        lost, measured = recording["stages"][0]["lost"], verdicts[recording["name"], "works"]["measured"]
        assert ("the printed covariance is not positive definite at" in measured) == (lost > 0)
    assert not verdicts["velocities", "prediction"]["simulated"]
    assert verdicts["03.npz", "recording"]["verdict"] == "cannot tell"
    assert verdicts["10.npz", "recording"]["verdict"] == "cannot tell"


def test_the_sweep_covers_every_setting_as_recorded_and_repaired(reproduced: Path) -> None:
    with (reproduced / "sweep.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["reading"] == "in-turn"]
    settings = {(r["recording"], r["state"], r["features"], float(r["pixel_variance"])) for r in rows}
    assert len(rows) == len(settings) == 2 * 2 * 4
    of = claims_in(reproduced)["recordings"][0]
    assert [o["features"] for o in of["sweep"]] == [20, 100, 20, 100]
    # Low noise loses more covariances than the report's, whatever the number of features.
    lost = {(o["pixel_variance"], o["features"]): o["lost"] for o in of["sweep"]}
    assert lost[0.01, 100] > lost[15.0, 100]


def test_the_page_is_one_safe_file(reproduced: Path) -> None:
    page = (reproduced / "report.html").read_text()
    assert "<b>drive" not in page
    assert "&lt;b&gt;drive&amp;" in page
    assert "http://" not in page
    assert "https://" not in page
    assert "default-src 'none'" in page
    assert "has no features here" in page
    assert page.count("<img") == 13


def test_a_second_run_needs_force(reproduced: Path, folder: Path) -> None:
    result = fgbaseline("reproduce", "<b>drive&.npz", "--out", "out/r", cwd=folder)
    assert result.returncode == 2
    assert "--force" in result.stderr
    assert claims_in(reproduced)["schema"] == "fgbaseline/reproduction/1"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nowhere.npz",), "nowhere.npz"),
        (("velocities.npz", "velocities.npz"), "give each once"),
        ((), "RECORDING"),
        (("velocities.npz", "--sweep-features", "0"), "whole numbers from 1 on"),
        (("velocities.npz", "--sweep-features", "2.5"), "whole numbers from 1 on"),
        (("velocities.npz", "--sweep-noise", "1,nan"), "numbers above 0"),
        (("velocities.npz", "--sweep-noise", "1,1"), "given twice"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(
    arguments: tuple[str, ...], message: str, folder: Path, tmp_path: Path
) -> None:
    (tmp_path / "velocities.npz").symlink_to(folder / "velocities.npz")
    before = everything_in(tmp_path)
    result = fgbaseline("reproduce", *arguments, "--out", "new/out", cwd=tmp_path)
    assert result.returncode == 2, result.stdout
    assert len(result.stderr.splitlines()) == 1
    assert message in result.stderr
    assert everything_in(tmp_path) == before


def test_recordings_are_known_by_their_frames_and_not_confused(tmp_path: Path) -> None:
    assert [getattr(paper_recording(frames), "name", None) for frames in (1010, 3026, 1011)] == [
        "03.npz",
        "10.npz",
        None,
    ]
    drive = without_features(simulate(Simulation(duration=1.0)))
    for name, speed in (("a/x.npz", 1.0), ("b/x.npz", 2.0)):
        (tmp_path / name).parent.mkdir()
        write_npz(replace(drive, linear_velocity=speed * drive.linear_velocity), tmp_path / name)
    with pytest.raises(InputError, match="has the name x"):
        read_subjects([tmp_path / "a/x.npz", tmp_path / "b/x.npz"])


def test_a_stand_in_has_the_size_and_the_velocities_of_its_recording() -> None:
    velocities = without_features(simulate(Simulation(duration=20.0, seed=8, gyro_bias=BIAS)))
    still = replace(velocities, linear_velocity=velocities.linear_velocity * (np.arange(200) < 100)[:, None])
    simulated = stand_in(still, seed=1)
    sequence = simulated.sequence
    assert sequence.n_landmarks == round(200 * TRACKS_PER_FRAME)
    assert len(np.unique(sequence.observations.landmark)) == sequence.n_landmarks
    assert len(simulated.wrong) == len(sequence.observations)
    assert np.abs(sequence.angular_velocity - still.angular_velocity).mean() < 0.01  # the noise of a rate
    assert np.abs(sequence.linear_velocity - still.linear_velocity).mean() < 0.1
    assert "standstill" in simulated.remark
    again = stand_in(still, seed=1).sequence
    assert again.observations.pixel.tobytes() == sequence.observations.pixel.tobytes()
    never_still = stand_in(replace(still, linear_velocity=still.linear_velocity + 5.0))
    assert not never_still.gyro_bias.any()
    assert "there is no standstill" in never_still.remark


def test_each_repair_of_what_was_simulated_brings_dead_reckoning_nearer_to_the_truth(faulty: Sequence) -> None:
    simulated = stand_in(without_features(faulty))
    simulated = replace(simulated, gyro_bias=simulated.gyro_bias)

    def error(sequence: Sequence) -> float:
        assert sequence.truth is not None
        path = dead_reckoned_path(increments(sequence))
        return float(np.linalg.norm(path[-1, :3, 3] - sequence.truth.world_T_imu[-1, :3, 3]))

    stages = simulated_stages(simulated)
    assert [stage.name for stage in stages] == ["as recorded", "axes agree", "without bias", "right matches"]
    recorded, _, unbiased, matched = (error(stage.sequence) for stage in stages)
    assert unbiased < 0.2 * recorded
    assert matched == unbiased
    assert len(stages[-1].sequence.observations) == int(np.sum(~simulated.wrong))


def test_the_repairs_of_the_diagnosis_are_applied_one_at_a_time(faulty: Sequence) -> None:
    from fgbaseline.diagnosis import diagnose

    stages = diagnosed_stages(diagnose(faulty))
    assert [stage.name for stage in stages][:2] == ["as recorded", "axes agree"]
    assert np.array_equal(stages[1].sequence.angular_velocity, faulty.angular_velocity * [1.0, -1.0, -1.0])
    assert stages[0].sequence is faulty
    # Without observations no stage differs from the recorded one.
    assert len(diagnosed_stages(diagnose(without_features(faulty)))) == 1


def test_without_noise_the_first_innovation_covariance_is_singular(faulty: Sequence) -> None:
    outcome, _ = run_filter(faulty, FilterSettings(features=50, motion=0.0))
    assert outcome.status is Status.FAILED
    assert outcome.breaks
    assert "frame 1" in outcome.reason
    assert outcome.record()["apart_rmse"] is None


def test_the_reports_own_recording(recordings: Callable[[str], Path], tmp_path: Path) -> None:
    result = fgbaseline(
        "reproduce", recordings("03.npz"), "--sweep-features", "200", "--sweep-noise", "15", cwd=tmp_path, drawing=False
    )
    assert result.returncode == 0, result.stderr
    place = tmp_path / "out/reproduction"
    assert {f"figure_{n:02d}.svg" for n in (1, 4, 7, 8, 9)} <= {p.name for p in (place / "figures").iterdir()}
    found = claims_in(place)
    verdicts = {claim["code"]: claim["verdict"] for claim in found["claims"] if claim["recording"] == "03.npz"}
    assert verdicts == {
        "samples": "does not hold",
        "features": "holds",
        "prediction": "does not hold",
        "mapping": "holds in part",
        "works": "does not hold",
        "like dead reckoning": "holds in part",
        "low noise": "holds",
    }
    recording = found["recordings"][0]
    assert np.allclose(recording["dead_reckoning_end"], [-927.8, 321.4, 179.2], atol=0.05)
    mapped = recording["mapped"]["1000"]
    assert f"{mapped['before']['reprojection']:.2f} {mapped['after']['reprojection']:.2f}" == "62.71 47.81"
    stages = {stage["stage"]: stage for stage in recording["stages"]}
    assert list(stages) == ["as recorded", "axes agree", "without bias", "right interval", "right matches"]
    assert abs(stages["as recorded"]["apart_rmse"] - 79.5) < 0.4
    assert f"{stages['axes agree']['apart_rmse']:.3f} {stages['axes agree']['apart_max']:.3f}" == "9.588 38.568"
    assert stages["as recorded"]["lost"] > 0
    assert stages["right matches"]["lost"] == 0
    assert stages["right matches"]["reprojection"] < 2.0
