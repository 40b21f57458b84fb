"""Problem behind a comparison: exported, as a run posed it, or as `fgbaseline export` poses it by default."""

from pathlib import Path

from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data import HeldOut, LandmarkMode, Problem, read, read_problem
from fgbaseline.geometry import InputError
from fgbaseline.reports.run.problem import RunSettings, pose_problem, split

from .run_folder import RunFolder


def load_problem(settings: Settings, run: RunFolder | None) -> tuple[Problem | None, HeldOut | None]:
    """Problem and held-out tracks: an exported folder's, or a recording's, posed as the run did, else calibrated.

    Raises InputError.
    """
    sequence = settings.sequence
    if settings.held_out and (sequence is None or sequence.is_dir()):
        raise InputError(
            "held-out: the tracks are kept from a recording; give it with --sequence, not an exported folder"
        )
    if sequence is None:
        return None, None
    if sequence.is_dir():
        return read_problem(sequence), None
    recorded = read(sequence)
    if run is None:
        wanted = RunSettings(sequence=sequence, held_out=settings.held_out, seed=settings.seed)
    else:
        wanted = _of_run(sequence, run)
        if settings.held_out not in (0.0, wanted.held_out):
            raise InputError(
                f"held-out: {run.folder} was run with {wanted.held_out:g}; leave --held-out out, or run it again"
            )
    kept, held = split(recorded, wanted)
    return pose_problem(kept, wanted), held


def _of_run(sequence: Path, run: RunFolder) -> RunSettings:
    """Settings that pose the problem of a run, from its summary. Raises InputError where it lacks one."""
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
            f"{run.folder}: its summary does not say how its problem was posed ({type(error).__name__}: {error}); "
            "give --sequence the folder of fgbaseline export"
        ) from error
