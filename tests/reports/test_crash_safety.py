"""Killed at any moment, on a full disk, with nowhere to write, twice at once: never a half result that looks whole."""

import json
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from fgbaseline import data
from fgbaseline.data.formats.files.atomic_folder import atomic_folder, exchanged
from fgbaseline.geometry import InputError

from ..builders.commands import COMMAND, everything_in, fgbaseline, started
from ..builders.summaries import estimator, summary
from ..builders.synthetic import drive

MARK = "summary.json"
FILES = 12
RUN = ("run", "drive.npz", "--out", "out", "--estimators", "dead-reckoning")
WRITER = """
import sys
from itertools import count
from pathlib import Path
from fgbaseline.data.formats.files.atomic_folder import atomic_folder

print("ready", flush=True)
for n in count():
    with atomic_folder(Path(sys.argv[1]), force=True, mark="summary.json") as folder:
        for i in range(12):
            (folder / f"{i}.txt").write_text(str(n))
        (folder / "summary.json").write_text(str(n))
"""

RIVAL = """
import os, sys, time
from pathlib import Path
from fgbaseline.geometry import InputError
from fgbaseline.data.formats.files.atomic_folder import atomic_folder

print("ready", flush=True)
sys.stdin.readline()
try:
    with atomic_folder(Path(sys.argv[1]), force=bool(sys.argv[2]), mark="summary.json") as folder:
        for name in [*(f"{i}.txt" for i in range(12)), "summary.json"]:
            (folder / name).write_text(str(os.getpid()))
            time.sleep(0.01)
    print("done")
except InputError as error:
    print(error)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a recording, its truth, limits and a summary."""
    sequence = drive("town", seconds=4.0, features_per_frame=6.0)
    assert sequence.truth is not None
    data.write_npz(sequence, tmp_path / "drive.npz")
    data.write_tum(tmp_path / "truth.tum", sequence.t, sequence.truth.world_T_imu)
    (tmp_path / "judged").mkdir()
    (tmp_path / "judged" / MARK).write_text(json.dumps(summary(ekf=estimator())))
    (tmp_path / "limits.toml").write_text('reference = "none"\n[[limit]]\nmetric = "ate.rmse"\nat_most = 1.0\n')
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below, and what is in it."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_writer_killed_at_any_moment_leaves_one_complete_folder(tmp_path: Path) -> None:
    chance, place, seen = random.Random(1), tmp_path / "out", set()
    with atomic_folder(place, force=False, mark=MARK) as first:
        for name in [*(f"{i}.txt" for i in range(FILES)), MARK]:
            (first / name).write_text("before")
    for _ in range(12):
        with subprocess.Popen([sys.executable, "-c", WRITER, place], stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            writer.stdout.readline()
            time.sleep(chance.uniform(0.0, 0.05))
            writer.kill()
        assert everything_in(place) == {*(f"{i}.txt" for i in range(FILES)), MARK}
        written = {path.read_text() for path in place.iterdir()}
        assert len(written) == 1
        seen |= written
        left = [path for path in tmp_path.iterdir() if path != place]
        assert all(path.name.startswith(".out.") for path in left)
        assert all(len(everything_in(path)) == FILES + 1 for path in left if (path / MARK).exists())
    assert len(seen) > 1


def test_a_run_killed_while_it_writes_leaves_the_earlier_one(folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out" / MARK).write_text("{}")
    with started(*RUN, "--force", cwd=folder) as run:
        while run.poll() is None and not list(folder.glob(".out.*/*")):
            time.sleep(0.002)
        run.send_signal(signal.SIGKILL)
    assert run.returncode == -signal.SIGKILL
    assert contents(folder / "out") == {MARK: b"{}"}
    assert not list(folder.glob(f".out.*/{MARK}"))


def test_a_recording_killed_while_it_is_written_leaves_the_earlier_one(folder: Path) -> None:
    before = (folder / "drive.npz").read_bytes()
    with started("simulate", "drive.npz", "--force", "--duration", "120", cwd=folder) as process:
        while process.poll() is None and not list(folder.glob(".drive.npz.*.part")):
            time.sleep(0.002)
        process.kill()
    assert (folder / "drive.npz").read_bytes() == before


COMMANDS = {
    "run": (*RUN, "--force"),
    "diagnose": ("diagnose", "drive.npz", "--out", "out", "--force"),
    "repairs": ("diagnose", "drive.npz", "--write-repairs", "out/repairs.toml", "--force"),
    "export": ("export", "drive.npz", "--out", "out", "--force"),
    "compare": ("compare", "truth.tum", "truth.tum", "--out", "out", "--force"),
    "simulate": ("simulate", "out/new.npz", "--duration", "5"),
    "check": ("check", "judged", "--limits", "limits.toml", "--junit", "out/check.xml", "--json", "out/check.json"),
}
MARKS = {"run": MARK, "diagnose": "diagnosis.json", "export": "problem.json", "compare": "comparison.json"}
LIMITS = {"repairs": 8, "check": 8, "compare": 3000, "export": 3000, "diagnose": 3000, "simulate": 3000, "run": 60_000}
"""bytes that a file may have"""


@pytest.mark.parametrize("name", COMMANDS)
def test_on_a_full_disk_earlier_output_survives_and_one_sentence_gives_the_reason(folder: Path, name: str) -> None:
    (folder / "out").mkdir()
    (folder / "out" / MARKS.get(name, "mine.txt")).write_text("old")
    if name == "repairs":
        (folder / "out" / "repairs.toml").write_text("# mine\n")
    before = contents(folder)
    may = (LIMITS[name], LIMITS[name])
    result = fgbaseline(*COMMANDS[name], cwd=folder, first=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, may))
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    assert "cannot be written (File too large)" in result.stderr.splitlines()[-1]
    assert contents(folder) == before


def may_mount() -> bool:
    command = ["unshare", "--map-root-user", "--mount", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]
    try:
        return subprocess.run(command, stderr=subprocess.DEVNULL, check=False).returncode == 0
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not may_mount(), reason="a small disk cannot be mounted here")
@pytest.mark.parametrize("name", ["run", "export", "repairs", "check"])
def test_a_disk_of_three_pages_is_left_as_it_was(folder: Path, name: str) -> None:
    old = folder / "old" / "out"
    old.mkdir(parents=True)
    (old / MARKS.get(name, "mine.txt")).write_text("old")
    if name == "repairs":
        (old / "repairs.toml").write_text("# mine\n")
    before = contents(folder / "old")
    (folder / "disk").mkdir()
    command = [f"disk/{part}" if part.split("/")[0] == "out" else part for part in COMMANDS[name]]
    # One page is taken by what is there, and where little is to be written the others are full.
    script = """
        mount -t tmpfs -o size=12k tmpfs disk && cp -r old/. disk || exit 99
        [ "$1" = full ] && head -c 100000 /dev/zero > disk/full 2> /dev/null; shift
        "$@"; code=$?
        rm -f disk/full; cp -r disk left
        exit $code"""
    fill = "full" if name in ("repairs", "check") else "empty"
    result = subprocess.run(
        ["unshare", "--map-root-user", "--mount", "sh", "-c", script, "sh", fill, COMMAND, *command],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    assert "cannot be written (No space left on device)" in result.stderr.splitlines()[-1]
    assert contents(folder / "left") == before


@pytest.mark.parametrize("name", COMMANDS)
def test_an_unwritable_folder_is_refused_in_one_sentence(folder: Path, name: str) -> None:
    places = {"out": "/proc/new"}  # not even root may make files in /proc
    nowhere = [places.get(part, part.replace("out/", "/proc/")) for part in COMMANDS[name]]
    before = everything_in(folder)
    result = fgbaseline(*nowhere, cwd=folder)
    assert result.returncode == 2
    assert "Traceback" not in result.stderr
    assert result.stderr.splitlines()[-1].startswith("fgbaseline: /proc/")
    assert everything_in(folder) == before


@pytest.mark.parametrize("force", [False, True])
def test_of_two_processes_that_write_one_folder_one_complete_result_remains(tmp_path: Path, force: bool) -> None:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    command = [sys.executable, "-c", RIVAL, tmp_path / "out", "force" if force else ""]
    writers = [subprocess.Popen(command, **pipes) for _ in range(3)]  # type: ignore[call-overload]
    for writer in writers:
        assert writer.stdout.readline() == "ready\n"
    for writer in writers:
        writer.stdin.write("go\n")
        writer.stdin.flush()
    outputs = [writer.communicate(timeout=60)[0] for writer in writers]
    assert all("done\n" in text or "out: the folder" in text for text in outputs)
    done = [writer.pid for writer, text in zip(writers, outputs, strict=True) if "done" in text]
    assert len(done) >= 1 if force else len(done) == 1
    written = {path.read_text() for path in (tmp_path / "out").iterdir()}
    assert everything_in(tmp_path / "out") == {*(f"{i}.txt" for i in range(FILES)), MARK}
    assert written <= {str(pid) for pid in done}
    assert len(written) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_two_folders_exchange_their_names(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / name).write_text(name)
    if not exchanged(tmp_path / "a", tmp_path / "b"):
        pytest.skip("this file system cannot exchange names")
    assert everything_in(tmp_path) == {"a", "a/b", "b", "b/a"}
    with pytest.raises(OSError, match="No such file"):
        exchanged(tmp_path / "a", tmp_path / "c")


@pytest.mark.parametrize("unable", [None, lambda *_: -1])
def test_where_the_system_cannot_exchange_names_the_folder_is_replaced_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unable: Callable[..., int] | None
) -> None:
    monkeypatch.setattr("fgbaseline.data.formats.files.atomic_folder._renameat2", lambda: unable)
    monkeypatch.setattr("ctypes.get_errno", lambda: 38)
    for text in ("old", "new"):
        with atomic_folder(tmp_path / "out", force=True, mark=MARK) as folder:
            (folder / MARK).write_text(text)
    assert contents(tmp_path) == {f"out/{MARK}": b"new"}


def test_a_folder_created_by_another_process_during_the_run_is_not_overwritten(tmp_path: Path) -> None:
    def late() -> None:
        with atomic_folder(tmp_path / "out", force=False, mark=MARK) as folder:
            (folder / MARK).write_text("late")
            (tmp_path / "out").mkdir()
            (tmp_path / "out" / MARK).write_text("first")

    with pytest.raises(InputError, match="choose another --out"):
        late()
    assert contents(tmp_path) == {f"out/{MARK}": b"first"}
