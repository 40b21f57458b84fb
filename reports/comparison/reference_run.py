"""The folder of a run as the reference of a comparison, and the problem behind a comparison."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fgbaseline.compare import Criterion, Trust, Verdict
from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data import HeldOut, LandmarkMode, Landmarks, Problem, Sequence, Trajectory, read, read_problem
from fgbaseline.data.formats.files.file_errors import reading
from fgbaseline.geometry import InputError

from ..problem.construction import build_problem, hold_out_tracks
from ..problem.settings import RunSettings
from ..results.json_files import SUMMARY
from ..results.reader import RunFolder

NO_REFERENCE = "the run has no reference: none of its estimators succeeded; repeat the run"


@dataclass(frozen=True, eq=False, slots=True)
class ReferenceRun:
    """A run whose reference others are compared with, in a folder or in memory."""

    name: str
    """name of the run in messages"""
    reference: str
    trust: Trust
    names: tuple[str, ...]
    """the estimators that gave an answer"""
    settings: Mapping[str, Any]
    up: tuple[float, ...] | None
    """up in the world of its trajectories; None in the summaries of older versions"""
    trajectory: Callable[[str], Trajectory]
    """the path of an estimator"""
    landmarks: Callable[[str], Landmarks]
    in_memory: Run | None = None


def read_reference_run(folder: Path) -> ReferenceRun:
    """Reads the summary. Raises InputError with the file where the folder is not that of a run with a reference."""
    files, path = RunFolder(folder), folder / SUMMARY
    if not path.is_file():
        raise InputError(
            f"{folder}: this folder has no {SUMMARY}, so it is not that of a run; give a trajectory file, or a folder "
            "that fgbaseline run wrote"
        )
    summary = files.summary
    with reading(path):
        try:
            reference, estimators = summary["reference"], summary["estimators"]
            chosen = str(reference["name"])
            criteria = tuple(map(_criterion, reference.get("criteria", ())))
            trust = Trust(Verdict[str(reference["trust"]).upper()], tuple(map(str, reference["reasons"])), criteria)
            names = tuple(str(name) for name, e in estimators.items() if e["status"] != "failed")
            settings = dict(summary["settings"])
            up = summary["sequence"].get("up")
            up = None if up is None else tuple(map(float, up))
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise InputError(f"it is not the summary of a run ({type(error).__name__}: {error})") from error
        if chosen not in names:
            raise InputError(NO_REFERENCE)
    return ReferenceRun(str(folder), chosen, trust, names, settings, up, files.trajectory, files.landmarks)


def _criterion(found: dict[str, Any]) -> Criterion:
    value = float("nan") if found["value"] is None else float(found["value"])
    return Criterion(**{**found, "value": value, "verdict": Verdict[str(found["verdict"]).upper()]})


def reference_in_memory(run: Run) -> ReferenceRun:
    """Reference of a run in memory. Raises InputError where it has none."""
    if run.reference is None:
        raise InputError(NO_REFERENCE)
    sequence, estimates = run.problem.sequence, {result.name: result.estimate for result in run.answered}
    return ReferenceRun(
        name=sequence.name,
        reference=run.reference,
        trust=run.trust,
        names=tuple(estimates),
        settings=run.settings,
        up=tuple(map(float, sequence.up)),
        trajectory=lambda name: Trajectory.of_frames(sequence.t, estimates[name].world_T_imu, name),
        landmarks=lambda name: estimates[name].landmarks,
        in_memory=run,
    )


def load_problem(settings: Settings, run: ReferenceRun | None) -> tuple[Problem | None, HeldOut | None]:
    """Problem and held-out tracks: of an exported folder, or built from a recording as in the run, else calibrated.

    A run in memory has its own. Raises InputError.
    """
    sequence = settings.sequence
    if not (sequence is None or isinstance(sequence, Path | Sequence | Problem)):
        raise InputError(f"sequence: expected a file, a Sequence or a Problem, got {type(sequence).__name__}")
    is_posed = isinstance(sequence, Problem) or (isinstance(sequence, Path) and sequence.is_dir())
    if settings.held_out and (sequence is None or is_posed):
        raise InputError("held-out: the tracks come from a recording; give it with --sequence, not an exported folder")
    if sequence is None:
        of = None if run is None else run.in_memory
        return (None, None) if of is None else (of.problem, None if of.held_out is None else of.held_out.held)
    if isinstance(sequence, Problem):
        return sequence, None
    if isinstance(sequence, Path) and is_posed:
        return read_problem(sequence), None
    recorded = read(sequence) if isinstance(sequence, Path) else sequence
    if run is None:
        wanted = RunSettings(sequence=sequence, held_out=settings.held_out, seed=settings.seed)
    else:
        wanted = _settings_of(run, sequence)
        if settings.held_out not in (0.0, wanted.held_out):
            raise InputError(
                f"held-out: {run.name} was run with {wanted.held_out:g}; leave out --held-out, or repeat the run"
            )
    kept, held = hold_out_tracks(recorded, wanted)
    return build_problem(kept, wanted), held


def _settings_of(run: ReferenceRun, sequence: Path | Sequence) -> RunSettings:
    """Settings that build the problem of a run, from its summary. Raises InputError where it lacks one."""
    known = run.settings
    try:
        return RunSettings(
            sequence=sequence,
            preset=known["preset"],
            features="all" if known["features"] == "all" else int(known["features"]),
            landmarks=LandmarkMode(known["landmarks"]),
            as_recorded=bool(known["as_recorded"]),
            held_out=float(known["held_out"]),
            seed=int(known["seed"]),
            repairs=None if known["repairs"] is None else Path(known["repairs"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{run.name}: its summary lacks the settings of its problem ({type(error).__name__}: {error}); "
            "give --sequence the folder of fgbaseline export"
        ) from error
