"""Jobs of a suite, with every fault that can be known reported before one of them runs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from glob import glob, has_magic
from itertools import product
from pathlib import Path
from typing import Any

from fgbaseline.data import estimator_names, read
from fgbaseline.data.simulate import Simulation
from fgbaseline.data.toml_file import Place, TomlFile, key_path
from fgbaseline.diagnosis import read_repairs
from fgbaseline.geometry import InputError
from fgbaseline.reports.run.problem import check_estimators

from .cache_key import code_of, content_of
from .job import File, Job, Planned, Recorded, Simulated
from .simulated_cases import DriveError, drives
from .suite import Entry, Suite, several

MOST_JOBS = 100_000


@dataclass(frozen=True, slots=True)
class Input:
    """A sequence of the suite, and what its rows are called."""

    name: str
    source: Recorded | Simulated
    seeds: tuple[int, ...]
    observations: float
    has_seed: bool


def plan(suite: TomlFile[Suite], data: Path | None) -> list[Planned]:
    """Every job of a suite in order, `data` being the folder of relative paths (None: that of the suite).

    Raises InputError naming the file and the place of what cannot be.
    """
    _check_estimators(suite)
    sweep = _settings(suite)
    varied = {name for name in sweep[0] if len({_words(settings[name]) for settings in sweep}) > 1}
    content = suite.content
    code = code_of(content.estimators, content.page != "none")
    jobs: list[Planned] = []
    names: dict[str, int] = {}
    for index, entry in enumerate(content.sequence):
        for each in _inputs(suite, index, entry, data):
            if each.name in names:
                other = key_path(("sequence", names[each.name]))
                raise suite.wrong(("sequence", index), f"'{each.name}' is the name of {other} too; add a name")
            names[each.name] = index
            for settings, seed in product(sweep, each.seeds):
                job = Job(
                    source=each.source,
                    seed=seed,
                    estimators=content.estimators,
                    page=content.page,
                    code=code,
                    **settings,
                )
                jobs.append(_planned(job, each, {name: _words(settings[name]) for name in sorted(varied)}))
                if len(jobs) > MOST_JOBS:
                    raise suite.wrong((), f"the suite has more than {MOST_JOBS} jobs; ask for less")
    for index, entry in enumerate(content.sequence):
        _check_repairs(suite, index, entry, sweep)
    return jobs


def _planned(job: Job, each: Input, settings: Mapping[str, str]) -> Planned:
    case = " ".join([each.name, *(f"{name}={words}" for name, words in settings.items())])
    return Planned(job, case, each.name, settings, each.observations, each.has_seed)


def _check_estimators(suite: TomlFile[Suite]) -> None:
    names = suite.content.estimators
    for index, name in enumerate(names):
        if name not in estimator_names() or name in names[:index]:
            try:
                check_estimators(names[: index + 1])
            except InputError as error:
                raise suite.wrong(("estimators", index), str(error)) from None


def _settings(suite: TomlFile[Suite]) -> list[dict[str, Any]]:
    """Every combination of settings; those that a preset has no use for do not multiply its runs."""
    sweep = suite.content.sweep
    for name, value in sweep:
        values = several(value)
        for index, one in enumerate(values):
            if one in values[:index]:
                raise suite.wrong(("sweep", name, index), f"{name}: {_words(_plain(one))} is named twice; name it once")
    presets = several(sweep.preset)
    for name, preset in (("noise", "calibrated"), ("landmarks", "documented")):
        if getattr(sweep, name) is not None and preset not in presets:
            raise suite.wrong(
                ("sweep", name), f"{name} is a setting of the {preset} preset alone; add that preset, or leave it out"
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
    """Given noise as a mapping of numbers."""
    return value.model_dump(exclude_none=True) if hasattr(value, "model_dump") else value


def _words(value: Any) -> str:
    """A setting as it stands in names: `all`, `0.5`, `pixel 1.5 linear_velocity 0.3`."""
    if isinstance(value, Mapping):
        return ",".join(f"{name}:{_words(one)}" for name, one in value.items())
    if isinstance(value, list | tuple):
        return ",".join(map(_words, value))
    return f"{value:g}" if isinstance(value, float) else "default" if value is None else str(value)


def _inputs(suite: TomlFile[Suite], index: int, entry: Entry, data: Path | None) -> Iterator[Input]:
    place: Place = ("sequence", index)
    if entry.simulate is None:
        for name, source, observations in _recordings(suite, index, entry, data):
            yield Input(name, source, (0,), observations, has_seed=False)
        return
    try:
        found = list(drives(entry.simulate))
    except DriveError as error:
        raise suite.wrong((*place, "simulate", error.setting), str(error)) from None
    base = entry.name or "simulated"
    for settings, varied in found:
        name = " ".join([base, *(f"{key}={_words(value)}" for key, value in varied.items())])
        drive = Simulation(**settings)
        observations = drive.seconds * drive.rate * drive.features_per_frame
        yield Input(name, Simulated(settings), entry.seed_numbers, observations, has_seed=entry.seeds is not None)


def _check_repairs(suite: TomlFile[Suite], index: int, entry: Entry, sweep: list[dict[str, Any]]) -> None:
    if entry.repairs is None:
        return
    for settings in sweep:
        if settings["preset"] == "documented" or settings["noise"] == "assumed":
            why = "the documented preset" if settings["preset"] == "documented" else 'noise = "assumed"'
            raise suite.wrong(
                ("sequence", index, "repairs"),
                f"{why} takes a recording as it is, and repairs would have no effect; leave one of the two out",
            )
        if isinstance(settings["noise"], Mapping):
            raise suite.wrong(
                ("sequence", index, "repairs"), "noise is set by [sweep] as well; leave one of the two out"
            )


def _recordings(
    suite: TomlFile[Suite], index: int, entry: Entry, data: Path | None
) -> Iterator[tuple[str, Recorded, float]]:
    """Name, source and number of observations of each. Raises InputError naming the place."""
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
