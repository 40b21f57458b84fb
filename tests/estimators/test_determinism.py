"""The same input and settings give the same bytes of tables, twice in a row and in processes with other hash seeds."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest

from fgbaseline import data

from ..builders.commands import undrawn
from ..builders.synthetic import drive

TIMINGS = ("seconds", "seconds_total", "frames_per_second", "runtime: time, s")
COMMANDS = {
    "run": ("run", "drive.npz", "--estimators", "dead-reckoning,ekf,joint-ekf,isam2,isam2-online,batch,fixed-lag"),
    "diagnose": ("diagnose", "drive.npz"),
    "compare": ("compare", "truth.tum", "other.tum", "--align", "se3"),
    "export": ("export", "drive.npz"),
}
TABLES = {".csv", ".tum", ".md", ".tex", ".npz", ".toml"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording, its truth and a path that is a little off."""
    place = tmp_path_factory.mktemp("same")
    sequence = drive("town", seconds=4.0, features_per_frame=10.0, wrong=0.05)
    assert sequence.truth is not None
    data.write_npz(sequence, place / "drive.npz")
    poses = sequence.truth.world_T_imu.copy()
    data.write_tum(place / "truth.tum", sequence.t, poses)
    poses[1:, :3, 3] += 0.1
    data.write_tum(place / "other.tum", sequence.t, poses)
    return place


def without_timings(path: Path) -> bytes:
    """Bytes of a table without its columns and rows of computation times."""
    if path.suffix in (".md", ".tex"):
        lines = path.read_text(encoding="utf-8").splitlines()
        return "\n".join(line for line in lines if "time, s" not in line).encode()
    if path.suffix != ".csv":
        return path.read_bytes()
    rows = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))
    kept = [i for i, title in enumerate(rows[0]) if title not in TIMINGS]
    return "\n".join(
        ",".join(row[i] for i in kept) for row in rows if not any(cell.endswith(TIMINGS) for cell in row)
    ).encode()


def timeless(words: Any) -> Any:
    """JSON without times."""
    if isinstance(words, dict):
        return {key: timeless(value) for key, value in words.items() if key not in (*TIMINGS, "machine", "created")}
    return [timeless(value) for value in words] if isinstance(words, list) else words


@pytest.fixture(scope="module")
def places(folder: Path) -> list[Path]:
    """Folders in which two processes, with other hash seeds, worked through all commands: inputs and outputs."""
    made = []
    for seed in ("1", "2"):
        work = folder / seed
        work.mkdir()
        for path in folder.iterdir():
            if path.is_file():
                (work / path.name).write_bytes(path.read_bytes())
        # the same name in different folders, since a summary says where it was written
        commands = [(*arguments, "--out", f"out-{name}") for name, arguments in COMMANDS.items()]
        result = undrawn(*commands, cwd=work, PYTHONHASHSEED=seed)
        assert result.returncode in (0, 1), result.stderr
        made.append(work)
    return made


@pytest.mark.parametrize("name", COMMANDS)
def test_two_processes_give_the_same_tables(places: list[Path], name: str) -> None:
    outputs = [place / f"out-{name}" for place in places]
    one, other = ({p.relative_to(place): p for p in place.rglob("*") if p.is_file()} for place in outputs)
    assert set(one) == set(other)
    tables = [path for path in one if path.suffix in TABLES]
    assert tables or name == "diagnose"
    assert [str(path) for path in tables if without_timings(one[path]) != without_timings(other[path])] == []
    for path in (path for path in one if path.suffix == ".json"):
        first, second = (json.loads(each[path].read_text(encoding="utf-8")) for each in (one, other))
        assert timeless(first) == timeless(second), path
