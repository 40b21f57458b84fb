"""An estimator in a file of the user is a registered one in all but installation, and is timed where it does not."""

import time
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data.estimators.runner import solve_all
from fgbaseline.data.estimators.user_estimator import load_all, parse
from fgbaseline.geometry import InputError

from ..builders.synthetic import drive, matched

SOURCE = """
import time
import numpy as np
from beside import OFFSET
from fgbaseline import data

def at_rest(problem, progress=None):
    time.sleep(0.05)
    poses = np.repeat(problem.initial_pose[None], problem.n_frames, axis=0)
    poses[:, 0, 3] = OFFSET
    return data.Estimate("at-rest", poses, used=np.zeros(len(problem.excluded), dtype=bool))

def crashes(problem, progress=None):
    raise ValueError("no luck")
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "beside.py").write_text("OFFSET = 2.5\n")
    path = tmp_path / "mine.py"
    path.write_text(SOURCE)
    return path


def test_a_function_of_a_file_answers_under_its_name_and_its_time_is_measured(file: Path) -> None:
    functions = load_all((f"{file}:at_rest", f"broken={file}:crashes"))
    problem = matched(drive(seconds=2.0))
    start = time.perf_counter()
    answers = solve_all(problem, ["dead-reckoning", *functions], functions=functions)
    took = time.perf_counter() - start
    assert list(answers) == ["dead-reckoning", "at_rest", "broken"]
    assert np.all(answers["at_rest"].world_T_imu[:, 0, 3] == 2.5)
    assert 0.05 <= answers["at_rest"].seconds_total <= took
    assert answers["broken"].status is data.Status.FAILED
    assert "no luck" in answers["broken"].reason


@pytest.mark.parametrize(
    ("text", "name", "path", "function"),
    [
        ("mine.py:solve", "solve", "mine.py", "solve"),
        ("my filter=dir/mine.py:solve", "my filter", "dir/mine.py", "solve"),
        ("a=C:/x/mine.py:solve", "a", "C:/x/mine.py", "solve"),
    ],
)
def test_name_file_and_function_are_read_from_the_text(text: str, name: str, path: str, function: str) -> None:
    assert parse(text) == (name, Path(path), function)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("mine.py", "FILE:FUNCTION"),
        ("mine.py:", "FILE:FUNCTION"),
        ("ekf=mine.py:solve", "installed already"),
        ("=mine.py:solve", "name of a file"),
        ("missing.py:solve", "no file"),
    ],
)
def test_what_is_wrong_with_the_text_is_named(text: str, cause: str) -> None:
    with pytest.raises(InputError, match=cause):
        load_all((text,))


def test_a_file_that_cannot_be_imported_and_a_missing_function_are_named(tmp_path: Path, file: Path) -> None:
    (tmp_path / "broken.py").write_text("import no_such_module\n")
    with pytest.raises(InputError, match="no_such_module"):
        load_all((f"{tmp_path / 'broken.py'}:solve",))
    with pytest.raises(InputError, match=r"no function 'solve'; it has .*at_rest"):
        load_all((f"{file}:solve",))
    with pytest.raises(InputError, match="given twice"):
        load_all((f"{file}:at_rest", f"{file}:at_rest"))
