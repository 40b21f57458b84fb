"""Whatever is done to a file, a reader reads it or refuses it in a sentence; `make fuzz` asks a million times more."""

import io
import json
import pickle
import time
import zipfile
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fgbaseline import data, diagnosis
from fgbaseline.data.problem_export import read_problem
from fgbaseline.geometry import InputError
from fgbaseline.reports.comparison.reference_run import read_reference_run
from fgbaseline.reports.results.reader import read_measured, value_of

from ..builders.readers import Reader, archive, course_arrays, npy, npz, problem_words, readers

READERS = readers()
PIECES = [
    b"",
    b"\x00",
    b"\xff" * 4,
    b"-1",
    b"nan",
    b"1e999",
    b"9" * 400,
    b"[" * 3000,
    b"\n",
    b"\xc3",
    b"{}",
    b"null",
    b"../x",
]


@cache
def seeds(name: str) -> list[bytes]:
    return READERS[name].seeds()


def fed(reader: Reader, content: bytes) -> bool:
    """Whether the reader took it; it may refuse it in one line, quickly, and must touch nothing else."""
    with TemporaryDirectory() as folder:
        scratch = Path(folder) / "scratch"
        scratch.mkdir()
        start, said = time.process_time(), ""
        try:
            reader.read(content, scratch)
        except InputError as error:
            said = str(error)
        assert time.process_time() - start < 10.0
        assert said == "" or (said.startswith(folder) and len(said.splitlines()) == 1)
        assert [path.name for path in Path(folder).iterdir()] == ["scratch"]
    return said == ""


@pytest.mark.parametrize("name", READERS)
def test_the_good_files_are_read(name: str) -> None:
    assert all(fed(READERS[name], seed) for seed in seeds(name))


@pytest.mark.parametrize("name", READERS)
@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
@given(chance=st.data())
def test_a_mutated_file_is_read_or_refused_in_one_sentence(name: str, chance: st.DataObject) -> None:
    content = bytearray(chance.draw(st.sampled_from(seeds(name))))
    for _ in range(chance.draw(st.integers(1, 4))):
        start, length = chance.draw(st.integers(0, len(content))), chance.draw(st.integers(0, 16))
        content[start : start + length] = chance.draw(st.sampled_from(PIECES) | st.binary(max_size=8))
    fed(READERS[name], bytes(content))


class Evil:
    """Makes a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return Path.touch, (self.mark,)


@pytest.mark.parametrize("key", ["features", "K", "time_stamps"])
def test_a_pickle_in_an_npz_is_never_opened(tmp_path: Path, key: str) -> None:
    array = np.empty(1, dtype=object)
    array[0] = Evil(tmp_path / "ran")
    (tmp_path / "a.npz").write_bytes(npz(**course_arrays() | {key: array}))
    with pytest.raises(InputError, match=f"{key}: it is a pickled array"):
        data.read(tmp_path / "a.npz")
    (tmp_path / "b.npz").write_bytes(
        archive(**{k: npy(v) for k, v in course_arrays().items()} | {key: pickle.dumps(Evil(tmp_path / "ran"))})
    )
    with pytest.raises(InputError):
        data.read(tmp_path / "b.npz")
    assert not (tmp_path / "ran").exists()


def test_a_decompression_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    """Four hundred megabytes of zeros in four hundred kilobytes, under a header that promises them."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (3, 2**24)})
    good = {key: npy(array) for key, array in course_arrays().items() if key != "K"}
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as file:
        for key, member in good.items():
            file.writestr(f"{key}.npy", member)
        with file.open("K.npy", "w", force_zip64=True) as member:
            member.write(header.getvalue())
            for _ in range(3 * 2**24 * 8 // 2**24):
                member.write(bytes(2**24))
    start = time.process_time()
    with pytest.raises(InputError, match=r"K: shape \(3, 16777216\) is larger than any recording needs"):
        data.read(tmp_path / "bomb.npz")
    assert time.process_time() - start < 5.0


NESTED = b"[" * 100_000
DEEP = {
    "summary of a check": (read_measured, "summary.json"),
    "summary of a run": (lambda path: read_reference_run(path.parent), "summary.json"),
    "words of a problem": (lambda path: read_problem(path.parent), "problem.json"),
}


@pytest.mark.parametrize("name", DEEP)
def test_json_that_is_nested_too_deeply_is_refused(tmp_path: Path, name: str) -> None:
    read, file = DEEP[name]
    (tmp_path / file).write_bytes(NESTED)
    with pytest.raises(InputError, match=file):
        read(tmp_path / file)


def test_values_of_the_wrong_type_in_an_exported_problem_are_refused(tmp_path: Path) -> None:
    for key in ("preset", "sequence", "remarks", "reading", "schema"):
        words = json.loads(problem_words())
        for value in (None, 3, [], {}, [[]], "x", 1e308, True):
            words[key] = value
            fed(READERS["problem JSON"], json.dumps(words).encode())


def test_a_run_whose_reference_has_no_name_is_refused(tmp_path: Path) -> None:
    words = json.loads(seeds("run folder")[0])
    del words["reference"]["name"]
    (tmp_path / "summary.json").write_text(json.dumps(words))
    with pytest.raises(InputError, match="it is not the summary of a run"):
        read_reference_run(tmp_path)


def test_an_integer_too_large_for_a_double_is_no_number(tmp_path: Path) -> None:
    path = tmp_path / "repairs.toml"
    path.write_text(f"velocity_scale = {'9' * 400}\n")
    with pytest.raises(InputError, match="it should be a number from"):
        diagnosis.read_repairs(path)
    assert value_of({"status": "ok", "ate": {"rmse": 10**400}}, "ate.rmse") == (None, "it is not a finite number")
