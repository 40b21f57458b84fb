"""Plan of a suite: its jobs, with faults of the suite reported before any job runs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from glob import glob, has_magic
from itertools import product
from pathlib import Path
from typing import Any

from fgbaseline.data import read
from fgbaseline.data.formats.files.toml_file import Place, TomlFile, key_path
from fgbaseline.data.simulate import Simulation
from fgbaseline.diagnosis import read_repairs
from fgbaseline.geometry import InputError

from ..problem.settings import check_estimators
from ..results.bench import File, Job, Planned, Recorded, Simulated
from .suite import DriveError, Entry, Suite, drives, several
from .worker import code_hash, file_hash

MOST_JOBS = 100_000


@dataclass(frozen=True, slots=True)
class Input:
    """A sequence of the suite with its name in tables."""

    name: str
    source: Recorded | Simulated
    seeds: tuple[int, ...]
    observations: float
    has_seed: bool


def plan(suite: TomlFile[Suite], data: Path | None) -> list[Planned]:
    """Lists the jobs of a suite, `data` being the folder of relative paths (None: that of the suite).

    Raises InputError with the file and the key path of a fault.
    """
    _check_estimators(suite)
    sweep = _settings(suite)
    varied = sorted(name for name in sweep[0] if len({_words(settings[name]) for settings in sweep}) > 1)
    content, code = suite.content, code_hash(suite.content.estimators, suite.content.page != "none")
    jobs: list[Planned] = []
    names: dict[str, int] = {}
    for index, entry in enumerate(content.sequence):
        for each in _inputs(suite, index, entry, data):
            if each.name in names:
                other = key_path(("sequence", names[each.name]))
                raise suite.wrong(("sequence", index), f"'{each.name}' is the name of {other} too; add a name")
            names[each.name] = index
            for settings, seed in product(sweep, each.seeds):
                job = Job(each.source, seed, **settings, estimators=content.estimators, page=content.page, code=code)
                words = {name: _words(settings[name]) for name in varied}
                case = " ".join([each.name, *(f"{name}={text}" for name, text in words.items())])
                jobs.append(Planned(job, case, each.name, words, each.observations, each.has_seed))
                if len(jobs) > MOST_JOBS:
                    raise suite.wrong((), f"the suite has more than {MOST_JOBS} jobs; reduce its settings or seeds")
    for index, entry in enumerate(content.sequence):
        _check_repairs(suite, index, entry, sweep)
    return jobs


def _check_estimators(suite: TomlFile[Suite]) -> None:
    names = suite.content.estimators
    for index in range(len(names)):
        try:
            check_estimators(names[: index + 1])
        except InputError as error:
            raise suite.wrong(("estimators", index), str(error)) from None


def _settings(suite: TomlFile[Suite]) -> list[dict[str, Any]]:
    """Every combination of settings; those that a preset does not use do not multiply its runs."""
    sweep = suite.content.sweep
    for name, value in sweep:
        values = several(value)
        for index, one in enumerate(values):
            if one in values[:index]:
                raise suite.wrong(("sweep", name, index), f"{name}: {_words(_plain(one))} is given twice; give it once")
    presets = several(sweep.preset)
    for name, preset in (("noise", "calibrated"), ("landmarks", "documented")):
        if getattr(sweep, name) is not None and preset not in presets:
            raise suite.wrong(
                ("sweep", name), f"{name} is a setting of the {preset} preset only; add that preset, or leave it out"
            )
    found: list[dict[str, Any]] = []
    for preset, features, noise, landmarks, held_out in product(
        presets,
        several(sweep.features),
        several(sweep.noise or "estimated"),
        several(sweep.landmarks or "in-turn"),
        several(sweep.held_out),
    ):
        settings = {
            "preset": preset,
            "features": features,
            "noise": _plain(noise) if preset == "calibrated" else "estimated",
            "landmarks": landmarks if preset == "documented" else "in-turn",
            "held_out": held_out,
        }
        if settings not in found:
            found.append(settings)
    return found


def _plain(value: Any) -> Any:
    """User-specified noise as a mapping of numbers."""
    return value.model_dump(exclude_none=True) if hasattr(value, "model_dump") else value


def _words(value: Any) -> str:
    """A setting as text in names: `all`, `0.5`, `pixel:1.5,linear_velocity:0.3`."""
    if isinstance(value, Mapping):
        return ",".join(f"{name}:{_words(one)}" for name, one in value.items())
    if isinstance(value, list | tuple):
        return ",".join(map(_words, value))
    return f"{value:g}" if isinstance(value, float) else "default" if value is None else str(value)


def _inputs(suite: TomlFile[Suite], index: int, entry: Entry, data: Path | None) -> Iterator[Input]:
    place: Place = ("sequence", index)
    if entry.simulate is None:
        yield from _recordings(suite, index, entry, data)
        return
    try:
        found = list(drives(entry.simulate))
    except DriveError as error:
        raise suite.wrong((*place, "simulate", error.setting), str(error)) from None
    for settings, varied in found:
        name = " ".join([entry.name or "simulated", *(f"{key}={_words(value)}" for key, value in varied.items())])
        drive = Simulation(**settings)
        observations = drive.seconds * drive.rate * drive.features_per_frame
        yield Input(name, Simulated(settings), entry.seed_numbers, observations, has_seed=entry.seeds is not None)


def _check_repairs(suite: TomlFile[Suite], index: int, entry: Entry, sweep: list[dict[str, Any]]) -> None:
    if entry.repairs is None:
        return
    place: Place = ("sequence", index, "repairs")
    for settings in sweep:
        if settings["preset"] == "documented":
            raise suite.wrong(place, "the documented preset uses no repairs; leave out one of the two")
        if settings["noise"] == "assumed":
            raise suite.wrong(place, 'noise = "assumed" uses no repairs; leave out one of the two')
        if isinstance(settings["noise"], Mapping):
            raise suite.wrong(place, "[sweep] sets the noise too; leave out one of the two")


def _recordings(suite: TomlFile[Suite], index: int, entry: Entry, data: Path | None) -> Iterator[Input]:
    """Reads each recording. Raises InputError with the key path."""
    folder = (data or Path(suite.path).parent).absolute()
    found = _files(suite, index, entry, folder)
    truth = None if entry.truth is None else folder / entry.truth
    repairs = None if entry.repairs is None else folder / entry.repairs
    for key in ("name", "truth", "repairs"):
        if getattr(entry, key) is not None and len(found) > 1:
            raise suite.wrong(
                ("sequence", index, key),
                f"{key} is for one recording, and files matches {len(found)}; give each its own [[sequence]]",
            )
    for path, place in found:
        try:
            if repairs is not None:
                read_repairs(repairs)
            sequence = read(path, truth, entry.truth_frame)
        except InputError as error:
            raise suite.wrong(place, str(error)) from None
        source = Recorded(File(str(path), file_hash(path)), _file(truth), entry.truth_frame, _file(repairs))
        yield Input(entry.name or path.stem, source, (0,), float(len(sequence.observations)), has_seed=False)


def _files(suite: TomlFile[Suite], index: int, entry: Entry, folder: Path) -> list[tuple[Path, Place]]:
    """The files with their key paths, sorted within a pattern, each once."""
    excluded = {path for pattern in several(entry.leave_out) for path in _matching(folder, pattern)}
    found: dict[Path, Place] = {}
    for number, pattern in enumerate(entry.patterns):
        place = ("sequence", index, "files", number)
        paths = [path for path in _matching(folder, pattern) if path.is_file() and path not in excluded]
        if not paths:
            what = "matches no file" if has_magic(pattern) else "is not a file"
            raise suite.wrong(
                place, f"files: '{pattern}' {what} in {folder}; correct it, or give the folder with --data"
            )
        for path in paths:
            found.setdefault(path, place)
    return list(found.items())


def _matching(folder: Path, pattern: str) -> list[Path]:
    if not has_magic(pattern):
        return [folder / pattern]
    return sorted(folder / name for name in glob(pattern, root_dir=folder, recursive=True))  # noqa: PTH207 - of any root


def _file(path: Path | None) -> File | None:
    return None if path is None else File(str(path), file_hash(path))
