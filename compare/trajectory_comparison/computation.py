"""Computes the metrics of a comparison: association, alignment, errors, drift, consistency, reprojection, ranking."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import Align, Exceedance, MatchedTrajectories, TimeOffset
from fgbaseline.compare.column_tables import Columns
from fgbaseline.compare.trajectory.ate_rpe import absolute_error_columns, relative_error_columns
from fgbaseline.compare.trajectory.drift import drift_rates
from fgbaseline.compare.trajectory.error_decomposition import share_intervals
from fgbaseline.compare.trajectory.pose_errors import divergence_columns
from fgbaseline.compare.trajectory_comparison.comparison import ASSUMED_UP, Comparison, Result
from fgbaseline.compare.trajectory_comparison.decimal_resolution import position_resolution, rotation_resolution_deg
from fgbaseline.compare.trajectory_comparison.inputs import Entries, Entry
from fgbaseline.compare.trajectory_comparison.ranking import ranking_of, spread
from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, InputError

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.trajectory_comparison.reported_covariance import ReportedCovariance
    from fgbaseline.compare.trajectory_comparison.reprojection import Pixels
    from fgbaseline.data import Problem

Computed = TypeVar("Computed")

FAR, FAR_SHARE = 5.0, 0.01
"""m, and share of the path: the smaller of both is the divergence threshold"""
TILT = 10.0
"""deg, largest angle between the up directions of two worlds that count as gravity-aligned"""
FEWEST = 2
"""smallest number of pose pairs of a comparison"""


class PairedEntries(NamedTuple):
    """Entries with their pairs of poses, for inputs that passed all checks."""

    entries: Entries
    settings: Settings
    """settings with defaults for alignment and deltas filled in"""
    up: FloatArray
    """(3,)"""
    up_from: str
    """the source of `up`"""
    matched: dict[str, tuple[MatchedTrajectories, TimeOffset | None]]
    """by estimate: see `matched_poses`"""


def pair_entries(entries: Entries, settings: Settings) -> PairedEntries:
    """Pairs of poses of all estimates. Raises InputError where one has too few in common with the reference."""
    everything = [entries.reference, *entries.estimates]
    settings = replace(
        settings,
        align=str(settings.align or (Align.NONE if entries.one_world else Align.SE3)),
        deltas=tuple(settings.deltas or _usual(everything)),
    )
    up, up_from = _up(entries, settings)
    if settings.align == Align.YAW:
        _require_one_up(entries, up)
    matched = {e.name: matched_poses(entries.reference, e, up, settings) for e in entries.estimates}
    return PairedEntries(entries, settings, up, up_from, matched)


def compare_paired(paired: PairedEntries) -> Comparison:
    """Comparison with the metrics of all estimates."""
    entries, settings, up, up_from, _ = paired
    paths, pixels, held_out = _by_observations(entries, settings)
    results = {e.name: _compared(paired, e, paths, pixels.get(e.name)) for e in entries.estimates}
    return Comparison(
        reference=entries.reference,
        reference_pixels=pixels.get(entries.reference.name),
        results=results,
        up=up,
        up_from=up_from,
        deltas=tuple(delta.text for delta in settings.deltas),
        settings=settings,
        ranking=ranking_of(
            errors={name: r.absolute["translation"] for name, r in results.items()},
            stamps={name: r.matched.reference.t for name, r in results.items()},
            tolerance=min(r.matched.tolerance for r in results.values()),
            by_products=frozenset(name for name, r in results.items() if r.entry.by_product),
            seed=settings.seed,
            statistics={name: r.statistics["translation"] for name, r in results.items()},
        ),
        held_out=held_out,
        sequence=None if entries.problem is None else entries.problem.sequence,
    )


def _by_observations(
    entries: Entries, settings: Settings
) -> "tuple[dict[str, FloatArray], dict[str, Pixels], pd.DataFrame | None]":
    """Poses of a recording's frames, reprojection, and errors on held-out tracks; nothing without a recording."""
    if entries.problem is None:
        return {}, {}, None
    from fgbaseline.compare.trajectory_comparison.reprojection import held_out_of, paths_of, pixels_of

    everything = [entries.reference, *entries.estimates]
    paths = paths_of(entries.problem, everything, settings.offset)
    return paths, pixels_of(entries.problem, everything, paths), held_out_of(entries.problem, entries.held, paths)


def _up(entries: Entries, settings: Settings) -> tuple[FloatArray, str]:
    """Direction (3,) of up in the reference's world, and its source.

    Sources in order: the option, the reference's file or its format, the run, the recording, an estimate's file, +z.
    """
    if settings.up is not None:
        up = np.asarray(settings.up, dtype=np.float64)
        if not (np.isfinite(up).all() and np.linalg.norm(up) > 0):
            raise InputError(f"up: expected a direction such as 0,0,1, got {settings.up}")
        return up / np.linalg.norm(up), "--up"
    if entries.reference.up is not None:
        by_file = f"the file of {entries.reference.name}"
        return entries.reference.up, by_file if entries.reference.up_stated else "KITTI's camera frame"
    if entries.up is not None:
        return entries.up, "the run"
    found = _up_by_recording(entries.problem, entries.reference.trajectory)
    if found is not None:
        return found, "the recording"
    for entry in entries.estimates:
        if entry.up is not None and entry.up_stated:
            return _aligned_up(entries.reference, entry, entry.up, settings), f"the file of {entry.name}"
    return np.array([0.0, 0.0, 1.0]), ASSUMED_UP


def _aligned_up(reference: Entry, entry: Entry, up: FloatArray, settings: Settings) -> FloatArray:
    """Up (3,) of an estimate's world in the reference's; an alignment by yaw assumes that they are equal."""
    if settings.align in (Align.NONE, Align.YAW):
        return up
    return np.asarray(matched_poses(reference, entry, up, settings)[0].alignment.rotation @ up)


def _up_by_recording(problem: "Problem | None", path: Trajectory) -> FloatArray | None:
    if problem is None:
        return None
    from fgbaseline.compare.trajectory_comparison.reprojection import up_of_problem

    return up_of_problem(problem, path)


def _require_one_up(entries: Entries, up: FloatArray) -> None:
    """Raises InputError if up differs by more than TILT in the world of an estimate, by its file or the recording."""
    for entry in entries.estimates:
        there = entry.up if entry.up_stated else _up_by_recording(entries.problem, entry.trajectory)
        apart = 0.0 if there is None else _angle_deg(there, up)
        if apart > TILT:
            raise InputError(
                f"{entry.trajectory.source or entry.name}: up in its world is {apart:.0f} degrees off that of "
                f"{entries.reference.name}, which a yaw alignment cannot mend; ask for --align se3 or first-pose"
            )


def _angle_deg(a: FloatArray, b: FloatArray) -> float:
    return float(np.rad2deg(np.arccos(np.clip(a @ b, -1.0, 1.0))))


def _usual(entries: list[Entry]) -> tuple[Delta, ...]:
    stamped = all(entry.trajectory.stamped for entry in entries)
    return (Delta(1.0, "s") if stamped else Delta(1.0, "frames"), Delta(10.0, "m"))


def _compared(paired: PairedEntries, entry: Entry, paths: Mapping[str, FloatArray], pixels: "Pixels | None") -> Result:
    entries, settings, up, _, _ = paired
    reference, seed = entries.reference, settings.seed
    notes = {} if pixels is None else dict(pixels.notes)
    matched, offset = paired.matched[entry.name]
    absolute, divergence = dict(absolute_error_columns(matched)), dict(divergence_columns(matched, up))
    bare = [path.name for path in (reference.trajectory, entry.trajectory) if not path.oriented]
    if bare:
        unknown = np.full(len(matched), np.nan)
        absolute |= dict.fromkeys(("rotation_deg", "rotation_chord", "pose"), unknown)
        divergence |= dict.fromkeys(("rotation_deg", "heading_deg"), unknown)
        notes["rotation_deg"] = f"{' and '.join(bare)} {'has' if len(bare) == 1 else 'have'} no orientations"
    bound = min(FAR, FAR_SHARE * float(divergence["traveled"][-1])) or FAR
    relative = {d.text: _relative(matched, d, settings, notes) for d in settings.deltas}
    tables = {delta: table for delta, table in relative.items() if table is not None}
    positions = matched.reference.position, entry.trajectory.position
    return Result(
        entry=entry,
        matched=matched,
        offset=offset,
        absolute=absolute,
        divergence=divergence,
        relative=tables,
        segments=_or_note("segments", notes, lambda: compare.segment_errors(_oriented(matched))),
        reported_covariance=_or_note("nees", notes, lambda: _reported(reference, entry, matched)),
        drift=_or_note("drift", notes, lambda: drift_rates(_oriented(matched), seed=seed)),
        shares=compare.error_decomposition(matched, up),
        share_intervals=share_intervals(matched, up, seed=seed),
        bound=bound,
        passing=_passing(matched, divergence, bound, notes),
        statistics={name: spread(absolute[name], seed) for name in ("translation", "rotation_deg", "pose")},
        relative_statistics={
            delta: {name: spread(table[name], seed) for name in ("translation", "rotation_deg")}
            for delta, table in tables.items()
        },
        pixels=pixels,
        resolution={"m": position_resolution(*positions), "°": rotation_resolution_deg(*positions)},
        map=_or_note("map", notes, lambda: _map(entries, entry, paths, matched)),
        notes=notes,
        up_deviation=_angle_deg(matched.alignment.rotation @ entry.up, up)
        if entry.up is not None and entry.up_stated
        else None,
    )


def _oriented(matched: MatchedTrajectories) -> MatchedTrajectories:
    """The pairs; raises InputError where reference or estimate has positions only."""
    for path in (matched.reference, matched.estimate):
        if not path.oriented:
            raise InputError(f"{path.name} has no orientations, so no motion of a body can be compared")
    return matched


def _reported(reference: Entry, entry: Entry, matched: MatchedTrajectories) -> "ReportedCovariance":
    matched = _oriented(matched)
    if entry.covariance is None:
        raise InputError("no covariances came with it")
    from fgbaseline.compare.trajectory_comparison.reported_covariance import reported_covariance

    return reported_covariance(reference, entry, matched)


def _map(
    entries: Entries, entry: Entry, paths: Mapping[str, FloatArray], matched: MatchedTrajectories
) -> "pd.DataFrame":
    lacking = [each.name for each in (entries.reference, entry) if each.landmarks is None]
    if entries.problem is None or lacking:
        raise InputError(f"no landmarks came with {' and '.join(lacking)}" if lacking else "there is no recording")
    from fgbaseline.compare.trajectory_comparison.reprojection import map_of

    return map_of(entries.problem, paths, entries.reference, entry, matched)


def _passing(
    matched: MatchedTrajectories, divergence: Columns, bound: float, notes: dict[str, str]
) -> Exceedance | None:
    """First pose beyond the bound; None with a note if the alignment does not make the paths start together."""
    if matched.alignment.kind in (Align.NONE, Align.FIRST_POSE):
        return compare.first_exceedance(divergence, bound)
    notes["passing"] = f"it was {matched.alignment.caption}, so the trajectories do not start together"
    return None


def _relative(matched: MatchedTrajectories, delta: Delta, settings: Settings, notes: dict[str, str]) -> Columns | None:
    return _or_note(
        f"relative.{delta.text}",
        notes,
        lambda: relative_error_columns(_oriented(matched), delta.length, delta.unit, all_pairs=settings.all_pairs),
    )


def _or_note(key: str, notes: dict[str, str], compute: Callable[[], Computed]) -> Computed | None:
    """Result of `compute`, or None and the error as a note, as for a path that is too short or has no stamps."""
    try:
        return compute()
    except InputError as error:
        notes[key] = str(error)
        return None


def matched_poses(
    reference: Entry, entry: Entry, up: FloatArray, settings: Settings
) -> tuple[MatchedTrajectories, TimeOffset | None]:
    """Pairs of poses, aligned, and the time offset if it is searched for.

    Raises InputError if only one trajectory has time stamps, and for fewer than FEWEST pairs.
    """
    there, here, kind = reference.trajectory, entry.trajectory, settings.align or Align.NONE
    if there.stamped != here.stamped:
        bare = there if here.stamped else here
        raise InputError(
            f"{bare.source or bare.name}: it has no time stamps, but the other trajectory does; "
            "add --times FILE, or --sequence with the recording"
        )
    seconds, found = settings.offset, None
    if settings.search_offset is not None:
        sought = Align.SE3 if Align(kind) is Align.NONE else kind
        moved = here.later(seconds) if seconds else here
        found = compare.time_offset(there, moved, settings.search_offset, sought)
        seconds += found.seconds
    matched = compare.associate(there, here, how=settings.association, tolerance=settings.tolerance, offset=seconds)
    if len(matched) < FEWEST:
        raise InputError(
            f"{here.source or here.name}: only {len(matched)} of its poses has a partner in {there.name}, "
            f"{FEWEST} are needed; give a larger --tolerance, or an --offset"
        )
    if kind == Align.FIRST_POSE:
        _oriented(matched)
    return matched.aligned(kind, first=settings.align_first, up=up), found
