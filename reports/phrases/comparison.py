"""Sentences at the top of a comparison's page and on the terminal, trust in the reference first; table captions."""

from collections.abc import Callable

import numpy as np

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE, is_insufficient
from fgbaseline.compare.overconfidence import DEGREES_OF_FREEDOM
from fgbaseline.compare.trajectory.alignment import SCALE
from fgbaseline.compare.trajectory_comparison.comparison import ASSUMED_UP, Comparison
from fgbaseline.compare.trajectory_comparison.computation import TILT
from fgbaseline.compare.trajectory_comparison.sample_sizes import samples

from ..formatting import counted, grouped, listed, number, per_cent
from .evidence import (
    error_decompositions,
    file_resolution,
    held_out_sentences,
    in_pixels,
    maximum_errors,
    path_lengths,
    position_rmse,
    reference_sentence,
    sample_requirement,
)


def caption(comparison: Comparison) -> str:
    """Association, alignment, up and the kind of interval: stands under every table."""
    names = grouped((result.matched.caption, result.name) for result in comparison.results.values())
    parts = [text if len(names) == 1 else f"{listed(those)}: {text}" for text, those in names.items()]
    name = comparison.reference.name
    return (
        f"Compared with {name}: {'. '.join(parts)}. Up is {_shown_up(comparison)} in the world frame of {name} "
        f"(source: {comparison.up_from}). Brackets: 95 % intervals (block bootstrap)."
    )


def _shown_up(comparison: Comparison) -> str:
    return f"({', '.join(f'{x:.3g}' for x in (np.round(comparison.up, 6) + 0.0))})"


def verdict(comparison: Comparison) -> list[str]:
    """All sentences, those of most consequence first."""
    parts: tuple[Callable[[Comparison], list[str]], ...] = (
        _too_little_data,
        _reference,
        _reported_covariances,
        position_rmse,
        maximum_errors,
        _up_direction,
        file_resolution,
        _file_remarks,
        error_decompositions,
        path_lengths,
        _time_offsets,
        _unpaired_poses,
        _undetermined_alignments,
        _rough_intervals,
        _outside_recording,
        _reprojection,
        _maps,
        _held_out,
    )
    return [sentence for part in parts for sentence in part(comparison)]


def _too_little_data(comparison: Comparison) -> list[str]:
    sentences = []
    for name, result in comparison.results.items():
        sample = samples(comparison, result)["translation"]
        if is_insufficient(sample, MIN_SAMPLE_SIZE, MIN_COVERAGE):
            n, poses = len(result.matched), len(result.entry.trajectory)
            sentences.append(
                f"Too little data to evaluate {name}: {number(n)} of its {counted(poses, 'pose')} "
                f"{'is' if n == 1 else 'are'} paired with {comparison.reference.name}, over "
                f"{per_cent(sample['coverage'])} of its time; {sample_requirement()}."
            )
    return sentences


def _reference(comparison: Comparison) -> list[str]:
    name, trust = comparison.reference.name, comparison.reference.trust
    if trust is None:
        return [f"The reference, {name}, is taken as given: its file has no information on its accuracy."]
    return [reference_sentence(name, trust)]


def _up_direction(comparison: Comparison) -> list[str]:
    """States that up is assumed, or contradicted by the file of an estimate."""
    name = comparison.reference.name
    if comparison.up_from == ASSUMED_UP:
        return [
            f"Up is not known from these files; {_shown_up(comparison)} in the world of {name} is assumed "
            "(--up sets it). View, height, left, above and heading depend on it."
        ]
    if comparison.up_from == "--up":
        return []
    return [
        f"The file of {result.name} states another up direction: after alignment it is {result.up_deviation:.0f}° off "
        f"that of the comparison ({comparison.up_from})."
        for result in comparison.results.values()
        if result.up_deviation is not None and result.up_deviation > TILT
    ]


def _file_remarks(comparison: Comparison) -> list[str]:
    """Remarks on the files, and the metrics that missing orientations leave out."""
    entries = [comparison.reference, *(result.entry for result in comparison.results.values())]
    sentences = [
        f"{names[0] if len(names) == 1 else f'Each of {listed(names)}'}: {remark}."
        for remark, names in grouped((remark, entry.name) for entry in entries for remark in entry.remarks).items()
    ]
    bare = [entry.name for entry in entries if not entry.trajectory.oriented]
    if bare:
        sentences.append(
            f"{listed(bare)} {'has' if len(bare) == 1 else 'have'} no orientations, so only positions are compared: "
            "rotation errors, relative errors, segments, drift, heading and NEES need orientations and are left out."
        )
    return sentences


def _time_offsets(comparison: Comparison) -> list[str]:
    each = []
    for result in comparison.results.values():
        found = result.offset
        if found is None:
            continue
        where = f"{1e3 * abs(found.seconds):.3g} ms {'later' if found.seconds > 0 else 'earlier'}"
        determined = "" if found.determined else "; the motion does not determine it"
        each.append(
            f"{result.name} {'as they are' if found.seconds == 0 else where} (shifts of {1e3 * found.low:+.3g} to "
            f"{1e3 * found.high:+.3g} ms fit nearly as well{determined})"
        )
    return [f"The stamps fit best: {listed(each)}."] if each else []


def _unpaired_poses(comparison: Comparison) -> list[str]:
    """Poses without a partner of each estimate, and of the reference as a range over the estimates."""
    paired = {result.name: result.matched for result in comparison.results.values()}
    there = sorted({m.left_out_reference for m in paired.values()})
    of = {name: m.left_out_estimate for name, m in paired.items() if m.left_out_estimate}
    each = [f"{number(n)} of {name}" for name, n in of.items()]
    if there[-1]:
        span = number(there[-1]) if there[0] == there[-1] else f"{number(there[0])} to {number(there[-1])}"
        each.append(f"{span} of {comparison.reference.name}")
    return [f"Poses that are not paired: {listed(each)}."] if each else []


def _undetermined_alignments(comparison: Comparison) -> list[str]:
    return [
        f"Parameters of the alignment that the positions of {result.name} do not determine: "
        + listed(f"{each} ({'set to 1' if each == SCALE else 'from the orientations'})" for each in free)
        + "."
        for result in comparison.results.values()
        if (free := result.matched.alignment.free)
    ]


def _rough_intervals(comparison: Comparison) -> list[str]:
    """Estimates with fewer than ten independent blocks."""
    names = [r.name for r in comparison.results.values() if not r.statistics["translation"].reliable]
    rough = "are rough, from fewer than 10 independent blocks"
    return [f"The 95 % intervals of {listed(names)} {rough}."] if names else []


def _reported_covariances(comparison: Comparison) -> list[str]:
    """Consistency of the covariances in the files of estimates, the overconfident ones first."""
    sentences, measured, bad = [], list[tuple[bool, str]](), []
    for result in comparison.results.values():
        reported = result.reported_covariance
        if reported is None:
            if result.entry.covariance is not None:
                sentences.append(f"The covariances of {result.name} are not evaluated: {result.notes['nees']}.")
            continue
        if n := len(reported.known):
            mean, remark = float(np.mean(reported.known)), f"; {reported.remark}" if reported.remark else ""
            root = number(float(np.sqrt(mean / DEGREES_OF_FREEDOM)))
            text = f"{result.name} {root} (NEES {number(mean)} over {counted(n, 'pose')}{remark})"
            measured.append((reported.is_overconfident, text))
        if reported.not_positive_definite:
            those = f"{number(reported.not_positive_definite)} of the {counted(len(reported.nees), 'covariance')}"
            bad.append(f"{those} of {result.name}")
    by = f"by the normalized error RMS (root of the mean NEES / {DEGREES_OF_FREEDOM}, expected 1)"
    for is_overconfident, each in sorted(grouped(measured).items(), reverse=True):
        sentences.append(f"{'Overconfident' if is_overconfident else 'Not overconfident'}, {by}: {listed(each)}.")
    if bad:
        sentences.append(f"Not positive definite, and left out by NEES: {listed(bad)}.")
    return sentences


def _outside_recording(comparison: Comparison) -> list[str]:
    names = [name for name, pixels in comparison.pixels.items() if pixels.frames == 0]
    if comparison.sequence is None or not names:
        return []
    return [f"No pose of {listed(names)} is at a frame of {comparison.sequence.name}: their time stamps differ."]


def _reprojection(comparison: Comparison) -> list[str]:
    tables = {name: pixels.along for name, pixels in comparison.pixels.items()}
    medians = {name: float(table["error"].median()) for name, table in tables.items() if table is not None}
    if len(medians) < 2:
        return []
    return [
        f"Median reprojection error, landmarks triangulated along each trajectory: {in_pixels(medians)}.",
        "This error measures the motion over the length of a track, not drift.",
    ]


def _maps(comparison: Comparison) -> list[str]:
    each = [
        f"{number(float(table['distance'].median()))} m for {name} ({number(float(table['seen'].median()))} m in the "
        f"camera frame; {counted(len(table), 'common landmark')})"
        for name, result in comparison.results.items()
        if (table := result.map) is not None
    ]
    return [f"Map difference from {comparison.reference.name} (median): {listed(each)}."] if each else []


def _held_out(comparison: Comparison) -> list[str]:
    table = comparison.held_out
    return [] if table is None or len(table) < 2 else held_out_sentences(table, "the held-out tracks")
