"""Sentences on the evidence of a comparison: files, stamps, intervals, covariances, reprojection and landmarks."""

import numpy as np

from fgbaseline.compare.trajectory_comparison.comparison import Comparison

from ..formatting import counted, listed, number


def remarks(comparison: Comparison) -> list[str]:
    """Findings on the files, and the figures that missing orientations leave out."""
    entries = [comparison.reference, *(result.entry for result in comparison.results.values())]
    sentences = [f"{entry.name}: {remark}." for entry in entries for remark in entry.remarks]
    bare = [entry.name for entry in entries if not entry.trajectory.oriented]
    if bare:
        sentences.append(
            f"{listed(bare)} {'has' if len(bare) == 1 else 'have'} no orientations, so positions alone are compared: "
            "rotation errors, relative errors, segments, drift, the body's heading and NEES need orientations and are "
            "left out."
        )
    return sentences


def offsets(comparison: Comparison) -> list[str]:
    """Estimated time offsets."""
    sentences = []
    for result in comparison.results.values():
        found = result.offset
        if found is None:
            continue
        where = f"{1e3 * abs(found.seconds):.3g} ms {'later' if found.seconds > 0 else 'earlier'}"
        text = (
            f"The stamps of {result.name} fit best {'as they are' if found.seconds == 0 else where} "
            f"(shifts of {1e3 * found.low:+.3g} to {1e3 * found.high:+.3g} ms fit nearly as well)"
        )
        sentences.append(text + ("." if found.determined else "; the path does not determine it."))
    return sentences


def left_out(comparison: Comparison) -> list[str]:
    """Poses without a partner."""
    same: dict[tuple[int, int], list[str]] = {}
    for result in comparison.results.values():
        counts = (result.matched.left_out_estimate, result.matched.left_out_reference)
        same.setdefault(counts, []).append(result.name)
    return [
        f"Without a partner, and left out: {counted(here, 'pose')} of {listed(names)}, "
        f"{number(there)} of {comparison.reference.name}."
        for (here, there), names in same.items()
        if here or there
    ]


def undetermined(comparison: Comparison) -> list[str]:
    """Degrees of freedom of the alignment that positions do not determine."""
    return [
        f"The positions of {result.name} leave {listed(result.matched.alignment.free)} of the alignment open; there "
        "the orientations decided."
        for result in comparison.results.values()
        if result.matched.alignment.free
    ]


def rough_intervals(comparison: Comparison) -> list[str]:
    """Estimates with fewer than ten independent blocks."""
    names = [r.name for r in comparison.results.values() if not r.statistics["translation"].attrs["reliable"]]
    if not names:
        return []
    return [
        f"The errors of {listed(names)} change so slowly that fewer than ten independent stretches fit into the path: "
        "their intervals are rough."
    ]


def reported_covariances(comparison: Comparison) -> list[str]:
    """Consistency of the covariances that estimates report."""
    sentences = []
    for result in comparison.results.values():
        reported = result.reported_covariance
        if reported is None:
            if result.entry.covariance is not None:
                sentences.append(f"The covariances of {result.name} are not judged: {result.notes['nees']}.")
            continue
        known = reported.nees[~np.isnan(reported.nees)]
        if len(known):
            mean = float(np.mean(known))
            sentences.append(
                f"Normalized error RMS of {result.name} by its covariances: {number(float(np.sqrt(mean / 6.0)))}, "
                f"1 being expected (mean NEES {number(mean)} over {counted(len(known), 'pose')}, 6 being expected"
                f"{'; ' if reported.remark else ''}{reported.remark})."
            )
        if reported.not_positive_definite:
            sentences.append(
                f"{number(reported.not_positive_definite)} of the {number(len(reported.nees))} covariances of "
                f"{result.name} are not positive definite; they are left out."
            )
    return sentences


def unmatched(comparison: Comparison) -> list[str]:
    """Trajectories without a pose at any frame of the recording."""
    names = [name for name, pixels in comparison.pixels.items() if pixels.frames == 0]
    if not names:
        return []
    return [
        f"No pose of {listed(names)} is at a frame of {comparison.sequence}: their time stamps have nothing in common."
    ]


def reprojection(comparison: Comparison) -> list[str]:
    """Median reprojection errors with landmarks triangulated along each path."""
    tables = {name: pixels.along for name, pixels in comparison.pixels.items()}
    medians = {name: float(table["error"].median()) for name, table in tables.items() if table is not None}
    if len(medians) < 2:
        return []
    each = listed(f"{number(medians[name])} px for {name}" for name in sorted(medians, key=lambda name: medians[name]))
    return [
        f"With landmarks triangulated along each path in the same way, the median reprojection error is {each}: it "
        "judges them locally, within the life of a track."
    ]


def maps(comparison: Comparison) -> list[str]:
    """Median distances of landmarks from the reference's."""
    known = {name: result.map for name, result in comparison.results.items() if result.map is not None}
    if not known:
        return []
    each = listed(
        f"{number(float(table['distance'].median()))} m for {name} ({number(float(table['seen'].median()))} m as the "
        f"cameras see them, {number(len(table))} in common)"
        for name, table in known.items()
    )
    return [f"The median distance of landmarks from those of {comparison.reference.name} is {each}."]


def held_out(comparison: Comparison) -> list[str]:
    """Ranking by held-out tracks, and the paths that the bootstrap does not separate from the first."""
    table = comparison.held_out
    if table is None or len(table) < 2:
        return []
    medians = {str(name): number(float(median)) for name, median in table["median"].items()}
    first, *rest = medians
    tied = [name for name in rest if not table["behind_low"][name] > 0.0 or medians[name] == medians[first]]
    separation = f"; the bootstrap does not separate {listed(tied)} from {first}" if tied else ""
    each = listed(f"{median} px for {name}" for name, median in medians.items())
    return [f"On tracks that were held out, one half predicted from the other, the median error is {each}{separation}."]
