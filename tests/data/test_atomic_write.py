"""A file appears whole or not at all; without `force` no process replaces what another one wrote."""

import errno
import multiprocessing
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fgbaseline.data.formats.files.atomic_write import atomic_write
from fgbaseline.geometry import InputError

from ..builders.commands import everything_in


def written(place: Path, content: bytes, *, force: bool = False, before_the_end: Callable[[], Any] = int) -> bool:
    """Whether the file was written; False where it was refused because it exists."""
    try:
        with atomic_write(place, force=force) as file:
            file.write(content)
            before_the_end()
    except InputError as error:
        assert str(error).startswith(f"{place}: the file exists")  # noqa: PT017
        return False
    return True


def without_hard_links(*_: object, **__: object) -> None:
    raise OSError(errno.EPERM, os.strerror(errno.EPERM))


@pytest.fixture(params=["hard links", "no hard links"])
def file_system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system with hard links, and one without, as FAT is."""
    if request.param == "no hard links":
        monkeypatch.setattr(os, "link", without_hard_links)


@pytest.mark.usefixtures("file_system")
def test_of_processes_that_write_one_file_at_once_only_one_succeeds(tmp_path: Path) -> None:
    fork, n = multiprocessing.get_context("fork"), 4
    together, place = fork.Barrier(n), tmp_path / "drive.npz"

    def process(i: int) -> None:
        os._exit(0 if written(place, bytes([i]) * 1000, before_the_end=together.wait) else 1)

    processes = [fork.Process(target=process, args=(i,)) for i in range(n)]
    for each in processes:
        each.start()
    for each in processes:
        each.join()
    codes = [each.exitcode for each in processes]
    assert sorted(codes, key=str) == [0, 1, 1, 1]
    assert place.read_bytes() == bytes([codes.index(0)]) * 1000
    assert everything_in(tmp_path) == {"drive.npz"}


@pytest.mark.usefixtures("file_system")
def test_only_force_replaces_a_file(tmp_path: Path) -> None:
    place = tmp_path / "drive.npz"
    assert written(place, b"old")
    assert not written(place, b"new")
    assert place.read_bytes() == b"old"
    assert written(place, b"new", force=True)
    assert place.read_bytes() == b"new"
    assert everything_in(tmp_path) == {"drive.npz"}


@pytest.mark.usefixtures("file_system")
@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
@pytest.mark.parametrize("force", [False, True])
def test_nothing_is_left_of_a_file_whose_writing_failed(
    tmp_path: Path, error: type[BaseException], force: bool
) -> None:
    def fail() -> None:
        raise error

    with pytest.raises(error):
        written(tmp_path / "drive.npz", b"half", force=force, before_the_end=fail)
    assert everything_in(tmp_path) == set()
