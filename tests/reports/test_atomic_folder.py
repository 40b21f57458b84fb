"""A folder appears whole or not at all, and what was there before survives every way of failing."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fgbaseline.data.formats.files.atomic_folder import atomic_folder, require_free
from fgbaseline.geometry import InputError

from ..builders.commands import everything_in

MARK = "summary.json"


def written(place: Path, text: str, *, force: bool = False) -> None:
    with atomic_folder(place, force=force, mark=MARK) as folder:
        (folder / "inner").mkdir()
        (folder / MARK).write_text(text)


def test_a_new_folder_appears_with_its_parents(tmp_path: Path) -> None:
    written(tmp_path / "a" / "b", "new")
    assert everything_in(tmp_path) == {"a", "a/b", "a/b/inner", f"a/b/{MARK}"}


def test_a_folder_is_not_visible_before_it_is_complete(tmp_path: Path) -> None:
    with atomic_folder(tmp_path / "out", force=False, mark=MARK) as folder:
        (folder / MARK).write_text("half")
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, InputError])
@pytest.mark.parametrize("place", ["out", "a/b/c"])
def test_nothing_is_left_of_a_folder_whose_writing_failed(
    tmp_path: Path, error: type[BaseException], place: str
) -> None:
    def fail() -> None:
        with atomic_folder(tmp_path / place, force=False, mark=MARK) as folder:
            (folder / "file").write_text("half")
            raise error

    with pytest.raises(error):
        fail()
    assert everything_in(tmp_path) == set()


def test_an_existing_folder_is_refused_and_replaced_with_force(tmp_path: Path) -> None:
    written(tmp_path / "out", "old")
    (tmp_path / "out" / "more").write_text("of the old one")
    with pytest.raises(InputError, match="--force"):
        written(tmp_path / "out", "new")
    assert (tmp_path / "out" / MARK).read_text() == "old"
    written(tmp_path / "out", "new", force=True)
    assert everything_in(tmp_path) == {"out", "out/inner", f"out/{MARK}"}
    assert (tmp_path / "out" / MARK).read_text() == "new"


def test_a_folder_created_after_the_last_check_is_not_replaced(tmp_path: Path, monkeypatch: Any) -> None:
    def late(place: Path, **options: Any) -> None:
        require_free(place, **options)
        if list(tmp_path.glob(f".out.*/{MARK}")):  # the second look: the block has ended
            place.mkdir()
            (place / MARK).write_text("of another process")

    monkeypatch.setattr("fgbaseline.data.formats.files.atomic_folder.require_free", late)
    with pytest.raises(InputError, match="the folder exists"):
        written(tmp_path / "out", "new")
    assert everything_in(tmp_path) == {"out", f"out/{MARK}"}
    assert (tmp_path / "out" / MARK).read_text() == "of another process"


def test_an_empty_folder_may_be_written_into(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    written(tmp_path / "out", "new")
    assert (tmp_path / "out" / MARK).read_text() == "new"


def test_force_does_not_touch_a_folder_that_is_not_ours(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years")
    with pytest.raises(InputError, match=MARK):
        written(tmp_path / "out", "new", force=True)
    assert everything_in(tmp_path) == {"out", "out/thesis.tex"}


def a_file(place: Path) -> None:
    place.write_text("mine")


def a_link_to_a_run(place: Path) -> None:
    written(place.with_name("elsewhere"), "old")
    place.symlink_to(place.with_name("elsewhere"))


def a_dangling_link(place: Path) -> None:
    place.symlink_to(place.with_name("nowhere"))


@pytest.mark.parametrize("make", [a_file, a_link_to_a_run, a_dangling_link])
def test_a_file_or_link_is_never_replaced_by_a_folder(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / "out")
    before = everything_in(tmp_path)
    with pytest.raises(InputError, match="is not a folder"):
        written(tmp_path / "out", "new", force=True)
    assert everything_in(tmp_path) == before


def test_a_place_below_a_file_or_with_an_impossible_name_is_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file is not a folder"):
        require_free(tmp_path / "file" / "a" / "out", force=False, mark=MARK)
    with pytest.raises(InputError, match="cannot be written"):
        require_free(tmp_path / ("x" * 300), force=False, mark=MARK)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_parent_that_may_not_be_written_to_is_refused_at_once(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(InputError, match="may not be written to"):
            require_free(tmp_path / "a" / "out", force=False, mark=MARK)
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.parametrize("error", [OSError("no space"), KeyboardInterrupt()])
@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize("which", [2, 3])  # the first rename is refused: the old folder has files
def test_the_old_folder_or_the_new_one_survives_a_failure_at_every_step_of_the_exchange(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, when: str, which: int
) -> None:
    written(tmp_path / "out", "old")
    monkeypatch.setattr("fgbaseline.data.formats.files.atomic_folder.exchanged", lambda *_: False)
    rename, calls = Path.rename, 0

    def failing(self: Path, target: Path) -> Path:
        nonlocal calls
        calls += 1
        fails = calls == which
        if fails and when == "before":
            raise error
        moved = rename(self, target)
        if fails:
            raise error
        return moved

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises((InputError, KeyboardInterrupt)):
        written(tmp_path / "out", "new", force=True)
    assert everything_in(tmp_path) == {"out", "out/inner", f"out/{MARK}"}
    expected = "new" if (which, when) == (3, "after") else "old"
    assert (tmp_path / "out" / MARK).read_text() == expected


def test_a_folder_created_during_the_write_is_kept(tmp_path: Path) -> None:
    def overtaken() -> None:
        with atomic_folder(tmp_path / "out", force=False, mark=MARK) as folder:
            (folder / MARK).write_text("mine")
            (tmp_path / "out").mkdir()
            (tmp_path / "out" / "theirs").write_text("")

    with pytest.raises(InputError, match="the folder exists"):
        overtaken()
    assert everything_in(tmp_path) == {"out", "out/theirs"}
