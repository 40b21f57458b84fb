"""What a command costs depends on how much data there is, never on the numbers in them: units, stray stamps, ids."""

import resource
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import diagnosis
from fgbaseline.compare.divergence_onset import worst_second
from fgbaseline.data import Problem, read_problem
from fgbaseline.data.problem import WRONG_MATCH
from fgbaseline.data.problem_export import write_problem
from fgbaseline.data.simulate import Simulation, Velocities, simulate
from fgbaseline.geometry import InputError
from fgbaseline.reports.figures.diagnosis import moving_mean

from ..builders.commands import fgbaseline
from ..builders.mutated_files import good_recording, good_trajectory
from ..builders.mutations import EPOCH, RECORDING
from ..builders.synthetic import drive, matched

CPU, MEMORY = 120, 12 * 2**30
"""s of a processor and bytes of address space that a command may use on 120 frames: many times what it needs"""
OUTPUT = 60 * 2**20
"""bytes that it may leave"""
LIMITS = '[[limit]]\nmetric = "ate.rmse"\nestimators = "isam2"\nat_most = 0.5\n'
CHANGES = {mutation.name: mutation.change for mutation in RECORDING}
SCALED = [mutation.name for mutation in RECORDING if mutation.unit or "stray" in mutation.name]


def bounded() -> None:
    """For a command before it starts: it is killed where its work or its arrays grow without bound."""
    resource.setrlimit(resource.RLIMIT_CPU, (CPU, CPU))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def ends(folder: Path, *arguments: str) -> int:
    result = fgbaseline(*arguments, cwd=folder, first=bounded)
    assert result.returncode in (0, 1, 2), (arguments, result.returncode, result.stderr[-500:])
    assert "Traceback" not in result.stderr
    return result.returncode


def size_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def every_command_ends(change: str, folder: Path) -> None:
    arrays = CHANGES[change](
        {key: np.array(array) for key, array in good_recording(0).items()}, np.random.default_rng(2)
    )
    np.savez(folder / "drive.npz", **arrays)
    (folder / "limits.toml").write_text(LIMITS)
    ends(folder, "diagnose", "drive.npz", "--out", "found")
    if ends(folder, "run", "drive.npz", "--out", "run") < 2:
        ends(folder, "check", "run", "--limits", "limits.toml")
        ends(folder, "compare", "run", "--out", "compared")
    assert size_of(folder) < OUTPUT


@pytest.mark.slow
def test_every_command_ends_on_nanoseconds_with_its_figures_drawn(tmp_path: Path) -> None:
    every_command_ends("stamps of an epoch in ns", tmp_path)


@pytest.mark.full
@pytest.mark.parametrize("change", SCALED)
def test_every_command_ends_whatever_the_numbers_are(change: str, tmp_path: Path) -> None:
    every_command_ends(change, tmp_path)


@pytest.mark.parametrize("command", [("diagnose", "drive.npz"), ("run", "drive.npz", "--out", "run")])
def test_an_impossible_velocity_is_refused_in_one_sentence(tmp_path: Path, command: tuple[str, ...]) -> None:
    arrays = {key: np.array(array) for key, array in good_recording(0).items()}
    arrays["linear_velocity"][0, 30] = 1e300
    np.savez(tmp_path / "drive.npz", **arrays)
    result = fgbaseline(*command, cwd=tmp_path, first=bounded)
    assert result.returncode == 2
    assert "linear_velocity: frame 30 has [1e+300" in result.stderr
    assert "Warning" not in result.stderr


@pytest.mark.parametrize("factor", [pytest.param(1e-9, marks=pytest.mark.full), 1e9])
def test_a_comparison_ends_whatever_both_are_stamped_in(factor: float, tmp_path: Path) -> None:
    truth, mine = good_trajectory(0)
    read = {"truth.tum": [line.split() for line in truth.splitlines() if line[0] != "#"], "mine.tum": mine}
    for name, rows in read.items():
        lines = [" ".join([f"{factor * float(row[0]):.17g}", *row[1:]]) for row in rows]
        (tmp_path / name).write_text("\n".join(lines) + "\n")
    ends(tmp_path, "compare", "truth.tum", "mine.tum", "--out", "compared")
    assert size_of(tmp_path) < OUTPUT


@pytest.mark.parametrize("width", [1, 2, 5, 8, 31, 40])
def test_a_moving_mean_is_the_convolution_with_ones_over_how_many_there_are(width: int) -> None:
    values, ones = np.random.default_rng(0).normal(size=40), np.ones(width)
    expected = np.convolve(values, ones, "same") / np.convolve(np.ones(40), ones, "same")
    np.testing.assert_allclose(moving_mean(values, width), expected, atol=1e-12)


def test_a_moving_mean_over_more_than_there_is_is_the_mean() -> None:
    np.testing.assert_allclose(moving_mean(np.arange(7.0), 1e18), 3.0)
    np.testing.assert_allclose(moving_mean(np.arange(7.0), np.inf), 3.0)


def with_stamps(problem: Problem, factor: float) -> Problem:
    return replace(problem, sequence=replace(problem.sequence, t=factor * problem.sequence.t))


def test_the_worst_second_is_the_one_with_the_largest_share_of_wrong_matches() -> None:
    problem = matched(drive(wrong=0.05))
    frame = problem.sequence.observations.frame
    second = np.floor(problem.sequence.t - problem.sequence.t[0])[frame]
    wrong = np.isin(problem.excluded, WRONG_MATCH)
    shares = {s: float(wrong[second == s].mean()) for s in np.unique(second)}
    found = worst_second(problem)
    assert found is not None
    assert found.share == max(shares.values()) == shares[found.second]


def test_the_worst_second_of_a_span_of_billions_is_one_that_has_a_frame() -> None:
    problem = matched(drive(wrong=0.05))
    found = worst_second(with_stamps(problem, 1e9))
    assert found is not None
    t = 1e9 * problem.sequence.t
    assert found.second in np.floor(t - t[0])


def followed(speed: float, interval: float) -> Velocities:
    n = 40
    return Velocities(interval * np.arange(n), np.tile([speed, 0.0, 0.0], (n, 1)), np.zeros((n, 3)))


@pytest.mark.parametrize(("speed", "interval"), [(1e9, 0.1), (8.0, 1e8)])
def test_a_street_is_not_built_along_velocities_that_lead_over_millions_of_meters(
    speed: float, interval: float
) -> None:
    with pytest.raises(InputError, match=r"along: its velocities lead over .* stamps are in s"):
        simulate(Simulation(path="along", along=followed(speed, interval)))


def test_standing_for_years_costs_no_more_than_standing_for_seconds() -> None:
    sequence = simulate(Simulation(path="along", along=followed(0.0, 1e8), features_per_frame=10.0))
    assert sequence.n_frames == 40


def test_frames_at_a_rate_over_a_span_are_bounded() -> None:
    with pytest.raises(InputError, match=r"frame_rate: 10 Hz are 3\.9e"):
        simulate(Simulation(path="along", along=followed(0.0, 1e8), frame_rate=10.0))


@pytest.mark.parametrize(("key", "value"), [("n_landmarks", 1e9), ("n_landmarks", 1e300), ("landmark", 1e12)])
def test_ids_of_an_exported_problem_size_no_array(key: str, value: float, tmp_path: Path) -> None:
    write_problem(diagnosis.calibrated(drive()), tmp_path)
    with np.load(tmp_path / "problem.npz") as read:
        arrays = {name: read[name] for name in read.files}
    changed = np.array(arrays[key], dtype=np.float64)
    changed.reshape(-1)[-1] = value
    np.savez(tmp_path / "problem.npz", **{**arrays, key: changed})
    with pytest.raises(InputError, match=key):
        read_problem(tmp_path)


def test_the_mutations_begin_at_an_epoch() -> None:
    stray = CHANGES["a stray zero stamp"](dict(good_recording(0)), np.random.default_rng(0))["time_stamps"]
    assert np.median(stray) > EPOCH - 1.0
