"""An exported problem: every number comes back to the bit, the CSV files say the same, and the truth stays behind."""

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline import data, ekf
from fgbaseline.data import Problem, read_problem
from fgbaseline.data.problem_export import layout, write_problem
from fgbaseline.geometry import InputError

from ..builders.commands import everything_in, fgbaseline
from ..builders.synthetic import drive, matched


@pytest.fixture(scope="module")
def problems() -> dict[str, Problem]:
    """One with a mask and a kernel, one with priors and a fixed number of features."""
    sequence = drive(wrong=0.05)
    calibrated = replace(matched(sequence), pixel_inflation=2.5)
    return {"calibrated": calibrated, "documented": data.documented(sequence, 40)}


def assert_equal(expected: Any, actual: Any, where: str) -> None:
    """Field by field, arrays bit by bit."""
    if isinstance(expected, np.ndarray):
        assert actual.dtype == expected.dtype, where
        assert np.ascontiguousarray(actual).tobytes() == np.ascontiguousarray(expected).tobytes(), where
        assert actual.shape == expected.shape, where
    elif hasattr(expected, "__dataclass_fields__"):
        for field in fields(expected):
            assert_equal(getattr(expected, field.name), getattr(actual, field.name), f"{where}.{field.name}")
    else:
        assert actual == expected, where


@pytest.mark.parametrize("preset", ["calibrated", "documented"])
def test_it_comes_back_to_the_bit_without_its_truth(problems: dict[str, Problem], preset: str, tmp_path: Path) -> None:
    problem = problems[preset]
    write_problem(problem, tmp_path)
    expected = replace(problem, sequence=replace(problem.sequence, truth=None))
    assert_equal(expected, read_problem(tmp_path), "problem")
    assert problem.sequence.truth is not None
    assert read_problem(tmp_path).sequence.truth is None


@pytest.mark.parametrize("preset", ["calibrated", "documented"])
def test_an_exported_problem_gives_the_same_estimate(problems: dict[str, Problem], preset: str, tmp_path: Path) -> None:
    write_problem(problems[preset], tmp_path)
    expected, actual = ekf.ekf(problems[preset]), ekf.ekf(read_problem(tmp_path))
    assert actual.world_T_imu.tobytes() == expected.world_T_imu.tobytes()
    assert actual.landmarks.position.tobytes() == expected.landmarks.position.tobytes()


def columns(table: np.ndarray, *names: str) -> np.ndarray:
    return np.stack([table[name] for name in names], axis=1)


@pytest.mark.parametrize("preset", ["calibrated", "documented"])
def test_the_tables_hold_the_values_of_the_arrays(problems: dict[str, Problem], preset: str, tmp_path: Path) -> None:
    problem = problems[preset]
    write_problem(problem, tmp_path)
    o, sequence = problem.sequence.observations, problem.sequence
    frames = np.genfromtxt(tmp_path / layout.FRAMES, delimiter=",", names=True)
    assert frames["t"].tobytes() == sequence.t.tobytes()
    np.testing.assert_array_equal(columns(frames, *layout.TWIST)[:, :3], sequence.linear_velocity)
    increments = np.genfromtxt(tmp_path / layout.INCREMENTS, delimiter=",", names=True)
    np.testing.assert_array_equal(columns(increments, *layout.TWIST), problem.increment)
    np.testing.assert_array_equal(increments["dt"], sequence.dt)
    covariance = columns(increments, *layout.COVARIANCE_COLUMNS).reshape(-1, 6, 6)
    np.testing.assert_array_equal(covariance, problem.increment_covariance)
    observations = np.genfromtxt(tmp_path / layout.OBSERVATIONS, delimiter=",", names=True)
    np.testing.assert_array_equal(observations["frame"], o.frame)
    np.testing.assert_array_equal(observations["landmark"], o.landmark)
    np.testing.assert_array_equal(columns(observations, "uL", "vL", "uR", "vR"), o.pixel)
    np.testing.assert_array_equal(observations["excluded"], problem.excluded)
    landmarks = np.genfromtxt(tmp_path / layout.LANDMARKS, delimiter=",", names=True)
    np.testing.assert_array_equal(landmarks["id"], problem.features)
    assert landmarks["observations"].sum() == problem.mask.sum()
    mean = columns(landmarks, "prior_x", "prior_y", "prior_z")
    if problem.landmark_prior is not None:
        np.testing.assert_array_equal(mean, problem.landmark_prior.mean)
    else:
        assert np.isnan(mean).all()
    words = json.loads((tmp_path / layout.SCALARS).read_text())
    assert words["pixel_variance"] == problem.pixel_variance
    assert (words["huber_threshold"] is None) == (problem.kernel is None)
    assert words["camera"]["fu"] == sequence.camera.fu
    np.testing.assert_array_equal(words["imu_T_cam"], sequence.imu_T_cam)


def spoilt(folder: Path, **changes: Any) -> None:
    with np.load(folder / layout.ARRAYS) as file:
        arrays = {key: file[key] for key in file.files}
    for key, value in changes.items():
        if value is None:
            del arrays[key]
        else:
            arrays[key] = value(arrays[key].copy()) if callable(value) else value
    np.savez(folder / layout.ARRAYS, **arrays)


def put(index: Any, value: float) -> Any:
    def change(array: np.ndarray) -> np.ndarray:
        array[index] = value
        return array

    return change


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"increment": None}, r"problem\.npz: increment is missing"),
        ({"increment": lambda a: a[:-1]}, r"problem\.npz: increment: expected shape \(.*, 6\), got"),
        ({"increment": put((3, 2), np.nan)}, "increment: it has entries that are not finite"),
        ({"excluded": put(0, 200)}, "excluded: expected codes from 0 to 9, got 200"),
        ({"features": put(0, 10**6)}, "features: they must rise and lie below"),
        ({"frame": put(0, 5)}, "frame: observations must be sorted"),
        ({"landmark": lambda a: a + 0.5}, "landmark: expected whole numbers"),
        ({"t": put(1, 0.0)}, "t: stamps must rise"),
        ({"imu_T_cam": put((0, 0), 3.0)}, "imu_T_cam: its 3x3 block .* is not a rotation"),
        ({"pixel_variance": np.array(-1.0)}, "pixel_variance: expected a positive number"),
        ({"pixel_variance": np.ones(2)}, "pixel_variance: expected shape"),
        ({"pixel_inflation": np.array(0.0)}, "pixel_inflation: expected a positive number"),
        ({"huber_threshold": np.array(-1.0)}, "huber_threshold: expected a positive number"),
    ],
)
def test_a_corrupted_array_is_refused_with_file_and_key(
    problems: dict[str, Problem], tmp_path: Path, changes: dict[str, Any], sentence: str
) -> None:
    write_problem(problems["calibrated"], tmp_path)
    spoilt(tmp_path, **changes)
    with pytest.raises(InputError, match=sentence):
        read_problem(tmp_path)


def test_an_unknown_schema_or_value_of_an_exported_problem_is_refused(
    problems: dict[str, Problem], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"problem\.json: there is no such file"):
        read_problem(tmp_path)
    write_problem(problems["calibrated"], tmp_path)
    path = tmp_path / layout.SCALARS
    words = json.loads(path.read_text())
    for text, sentence in (
        ("{", "it is not JSON"),
        ("[]", "schema: expected 'fgbaseline/problem/1', got None"),
        (json.dumps({**words, "schema": "fgbaseline/problem/9"}), "got 'fgbaseline/problem/9'"),
        (json.dumps({**words, "reading": "aloud"}), "'aloud' is not a valid LandmarkMode"),
        (json.dumps({k: v for k, v in words.items() if k != "preset"}), "'preset' is missing"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=rf"problem\.json: .*{sentence}"):
            read_problem(tmp_path)


def test_the_command_writes_the_problem_that_a_run_solves(tmp_path: Path) -> None:
    data.write_npz(drive(), tmp_path / "drive.npz")
    finished = fgbaseline(
        "export", "drive.npz", "--out", "out/p", "--preset", "documented", "--features", "30", cwd=tmp_path
    )
    assert finished.returncode == 0, finished.stderr
    assert "observations of 30 landmarks; " in finished.stdout
    exported = read_problem(tmp_path / "out/p")
    expected = data.documented(replace(data.read(tmp_path / "drive.npz"), truth=None, source="drive.npz"), 30)
    assert_equal(expected, exported, "problem")
    again = fgbaseline("export", "drive.npz", "--out", "out/p", "--as-recorded", cwd=tmp_path)
    assert again.returncode == 2
    assert "--force" in again.stderr
    forced = fgbaseline("export", "drive.npz", "--out", "out/p", "--as-recorded", "--force", cwd=tmp_path)
    assert forced.returncode == 0, forced.stderr
    assert read_problem(tmp_path / "out/p").preset == "calibrated"
    held = fgbaseline("export", "drive.npz", "--out", "out/h", "--as-recorded", "--held-out", "0.25", cwd=tmp_path)
    assert "Held out, not in the problem: " in held.stdout
    assert len(read_problem(tmp_path / "out/h").features) < len(read_problem(tmp_path / "out/p").features)
    assert {name for name in everything_in(tmp_path / "out") if "partial" in name} == set()


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("export drive.npz", ("--out",)),
        ("export missing.npz --out out", ("missing.npz", "no such file")),
        ("export drive.npz --out out --features 0", ("--features", "'0'")),
        ("export drive.npz --out theirs --force", ("theirs", "problem.json")),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(line: str, names: tuple[str, ...], tmp_path: Path) -> None:
    data.write_npz(drive(), tmp_path / "drive.npz")
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "thesis.tex").write_text("years of work")
    before = everything_in(tmp_path)
    result = fgbaseline(*line.split(), cwd=tmp_path)
    assert result.returncode == 2
    assert len(result.stderr.strip().splitlines()) == 1
    assert all(name in result.stderr for name in names), result.stderr
    assert everything_in(tmp_path) == before
