"""The recordings that a suite names: found, read once to know that they can be, and known by their content."""

from collections.abc import Iterator
from glob import glob, has_magic
from pathlib import Path

from fgbaseline.data import read
from fgbaseline.data.toml_file import TomlFile
from fgbaseline.diagnosis import read_repairs
from fgbaseline.geometry import InputError

from .identity import content_of
from .job import File, Recorded
from .suite import Entry, Suite, several


def recordings(
    suite: TomlFile[Suite], index: int, entry: Entry, data: Path | None
) -> Iterator[tuple[str, Recorded, float]]:
    """Name, source and number of observations of each. Raises InputError naming the key path."""
    folder = (data or Path(suite.path).parent).absolute()
    found = _files(suite, index, entry, folder)
    truth = None if entry.truth is None else folder / entry.truth
    repairs = None if entry.repairs is None else folder / entry.repairs
    for key in ("name", "truth", "repairs"):
        if getattr(entry, key) is not None and len(found) > 1:
            raise suite.wrong(
                ("sequence", index, key),
                f"{key} is for one recording, and files names {len(found)}; give each a [[sequence]] of its own",
            )
    for path, place in found:
        try:
            if repairs is not None:
                read_repairs(repairs)
            sequence = read(path, truth, entry.truth_frame)
        except InputError as error:
            raise suite.wrong(place, str(error)) from None
        source = Recorded(_known(path), _file(truth), entry.truth_frame, _file(repairs))
        yield entry.name or path.stem, source, float(len(sequence.observations))


def _files(suite: TomlFile[Suite], index: int, entry: Entry, folder: Path) -> list[tuple[Path, tuple[str | int, ...]]]:
    """The files and where each is named, sorted within a pattern; none twice."""
    left_out = {path for pattern in several(entry.leave_out) for path in _matching(folder, pattern)}
    found: dict[Path, tuple[str | int, ...]] = {}
    for number, pattern in enumerate(entry.patterns):
        place = ("sequence", index, "files", number)
        paths = [path for path in _matching(folder, pattern) if path.is_file() and path not in left_out]
        if not paths:
            what = "matches no file" if has_magic(pattern) else "is no file"
            raise suite.wrong(place, f"files: '{pattern}' {what} in {folder}; correct it, or say where with --data")
        for path in paths:
            found.setdefault(path, place)
    return list(found.items())


def _matching(folder: Path, pattern: str) -> list[Path]:
    if not has_magic(pattern):
        return [folder / pattern]
    return sorted(folder / name for name in glob(pattern, root_dir=folder, recursive=True))  # noqa: PTH207 - of any root


def _file(path: Path | None) -> File | None:
    return None if path is None else _known(path)


def _known(path: Path) -> File:
    return File(str(path), content_of(path))
