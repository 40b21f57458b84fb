"""Sentences on a comparison: the caption of its tables, and its verdict, the trust in the reference first."""

from collections.abc import Callable, Mapping

import numpy as np

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE, RmseDifference, distance_traveled, is_insufficient
from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.samples import coverage, samples

from ..formatting import MINUS, counted, interval, listed, number, per_cent
from .evidence import (
    DEGREES_OF_FREEDOM,
    held_out_sentences,
    reference_sentence,
    sample_requirement,
    threshold,
)


def caption(comparison: Comparison) -> str:
    """Association, alignment, up and the kind of interval: stands under every table."""
    names: dict[str, list[str]] = {}
    for result in comparison.results.values():
        names.setdefault(result.matched.caption, []).append(result.name)
    parts = [text if len(names) == 1 else f"{listed(those)}: {text}" for text, those in names.items()]
    up = ", ".join(f"{x:.3g}" for x in (np.round(comparison.up, 6) + 0.0))
    name = comparison.reference.name
    return (
        f"Compared with {name}: {'. '.join(parts)}. Up is ({up}) in the world of {name} ({comparison.up_from}). "
        "Brackets: 95 % intervals (block bootstrap)."
    )


def verdict(comparison: Comparison) -> list[str]:
    """All sentences, in the order in which later ones rest on earlier ones."""
    parts: tuple[Callable[[Comparison], list[str]], ...] = (
        _too_little_data,
        _reference,
        _file_remarks,
        _position_rmse,
        _maximum_errors,
        _decompositions,
        _path_lengths,
        _time_offsets,
        _unpaired_poses,
        _undetermined_alignments,
        _rough_intervals,
        _reported_covariances,
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


def _file_remarks(comparison: Comparison) -> list[str]:
    """Remarks on the files, and the metrics that missing orientations leave out."""
    entries = [comparison.reference, *(result.entry for result in comparison.results.values())]
    sentences = [f"{entry.name}: {remark}." for entry in entries for remark in entry.remarks]
    bare = [entry.name for entry in entries if not entry.trajectory.oriented]
    if bare:
        sentences.append(
            f"{listed(bare)} {'has' if len(bare) == 1 else 'have'} no orientations, so only positions are compared: "
            "rotation errors, relative errors, segments, drift, heading and NEES need orientations and are left out."
        )
    return sentences


def _position_rmse(comparison: Comparison) -> list[str]:
    """Position RMSEs in order, over the common poses; where these are not all poses, also over all of each."""
    name = comparison.reference.name
    others = [result for result in comparison.ranked if not result.entry.by_product]
    by_products = [
        f"{result.name}, a by-product of {name} with pose k from data up to frame k: {_rmse(result)}."
        for result in comparison.ranked
        if result.entry.by_product
    ]
    if not others:
        return by_products
    if comparison.ranking.same:
        path = float(others[0].departure["travelled"][-1])
        share = f" ({per_cent(others[0].rmse / path)} of the path of {number(path)} m)" if path > 0 else ""
        first, *rest = (f"{result.name} {_rmse(result)}" for result in others)
        each = listed([f"{first}{share}", *rest])
        return [f"Position RMSE against {name}: {each}.", *_order(comparison), *by_products]
    each = listed(
        f"{r.name} {_rmse(r)} over {counted(len(r.matched), 'pose')} "
        f"({per_cent(coverage(comparison, r))} of {name}'s time)"
        for r in others
    )
    return [*_over_common(comparison), f"Position RMSE over all poses of each estimate: {each}.", *by_products]


def _over_common(comparison: Comparison) -> list[str]:
    """Ranking of estimates that do not have the same moments, and the estimates that are not ranked."""
    ranking, name = comparison.ranking, comparison.reference.name
    apart = [r.name for r in comparison.ranked if not r.entry.by_product and ranking.rank(r.name) is None]
    if len(ranking.rivals) < 2:
        return [f"Not ranked, too few poses in common: {listed([*ranking.rivals, *apart])}."]
    each = listed(f"{n} {number(ranking.rmse(n))} m" for n in ranking.rivals)
    having = "the others have" if apart else "all have"
    text = f"Position RMSE against {name} over the {counted(ranking.moments, 'pose')} that {having}: {each}."
    missing = [f"Not ranked, too few poses in common with {name}: {listed(apart)}."] if apart else []
    return [text, *_order(comparison), *missing]


def _order(comparison: Comparison) -> list[str]:
    return significance_sentences(comparison.ranking.rivals[0], comparison.behind) if comparison.behind else []


def significance_sentences(first: str, behind: Mapping[str, RmseDifference]) -> list[str]:
    """Paired differences from the estimate with the smallest RMSE, `first`: the significant ones, and the others."""
    groups: dict[bool, list[str]] = {True: [], False: []}
    for name, d in behind.items():
        groups[d.settled].append(f"{name} ({_signed(d.value)} m [{_signed(d.low)}, {_signed(d.high)}])")
    sentences = []
    if groups[True]:
        sentences.append(f"Larger position RMSE than {first}, by paired bootstrap: {listed(groups[True])}.")
    if groups[False]:
        sentences.append(f"No significant difference from {first}, by paired bootstrap: {listed(groups[False])}.")
    return sentences


def _signed(meters: float) -> str:
    return number(meters) if not meters < 0 else f"{MINUS}{number(-meters)}"


def _rmse(result: Result) -> str:
    """Position RMSE with its interval: `0.52 m [0.41, 0.66]`."""
    value, mark, bounds = interval(*result.statistics["translation"]["rmse"]).partition(" [")
    return f"{value} m{mark}{bounds}"


def _maximum_errors(comparison: Comparison) -> list[str]:
    """Largest position error of each estimate, and when it first exceeds the threshold."""
    sentences = []
    for result in comparison.ranked:
        most = float(np.nanmax(result.departure["position"]))
        sentence = f"{result.name}: maximum position error {number(most)} m; {threshold(result.bound)}."
        if result.passing is not None:
            t = result.passing.t - float(result.matched.reference.t[0])
            when = f"after {number(t)} s" if result.matched.reference.stamped else f"at frame {result.passing.frame}"
            sentence += f" The threshold is first exceeded {when}, {number(result.passing.travelled)} m along the path."
        sentences.append(sentence)
    return sentences


def _decompositions(comparison: Comparison) -> list[str]:
    """Shares of heading and scale in the squared position error."""
    sentences = []
    for result in comparison.ranked:
        if np.isfinite(result.shares.noise):
            heading, scale, rest = (_share(result, name) for name in ("heading", "scale", "noise"))
            sentences.append(
                f"Squared position error of {result.name}: {heading} from heading, {scale} from scale (least-squares "
                f"scale {1.0 + 0.01 * result.shares.scale_percent:.4f}) and {rest} from the rest."
            )
    return sentences


def _share(result: Result, name: str) -> str:
    value, low, high = result.share_intervals.by_name[name]
    if not np.isfinite(low):
        return per_cent(max(value, 0.0))
    return f"{100.0 * max(value, 0.0):.0f} % [{100.0 * low:.0f}, {100.0 * high:.0f}]"


def _path_lengths(comparison: Comparison) -> list[str]:
    """Length of each path over the paired poses, before alignment, against the reference's."""
    sentences = []
    for result in comparison.results.values():
        matched = result.matched
        own = float(distance_traveled(matched.estimate.position)[-1]) / float(matched.alignment.scale)
        path = float(distance_traveled(matched.reference.position)[-1])
        if path > 0.0 and number(own) != number(path):
            sentences.append(
                f"The path of {result.name} over the paired poses is {number(own)} m long, "
                f"{number(100.0 * abs(own / path - 1.0))} % {'longer' if own > path else 'shorter'} than the "
                "reference's."
            )
    return sentences


def _time_offsets(comparison: Comparison) -> list[str]:
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


def _unpaired_poses(comparison: Comparison) -> list[str]:
    same: dict[tuple[int, int], list[str]] = {}
    for result in comparison.results.values():
        counts = (result.matched.left_out_estimate, result.matched.left_out_reference)
        same.setdefault(counts, []).append(result.name)
    return [
        f"Not paired: {counted(here, 'pose')} of {listed(names)}, {number(there)} of {comparison.reference.name}."
        for (here, there), names in same.items()
        if here or there
    ]


def _undetermined_alignments(comparison: Comparison) -> list[str]:
    return [
        f"The positions of {result.name} do not determine {listed(result.matched.alignment.free)} of the alignment; "
        "the orientations do."
        for result in comparison.results.values()
        if result.matched.alignment.free
    ]


def _rough_intervals(comparison: Comparison) -> list[str]:
    """Estimates with fewer than ten independent blocks."""
    names = [r.name for r in comparison.results.values() if not r.statistics["translation"].reliable]
    if not names:
        return []
    return [f"The intervals of {listed(names)} are rough: fewer than 10 independent blocks fit the path."]


def _reported_covariances(comparison: Comparison) -> list[str]:
    """Consistency of the covariances in the files of estimates."""
    sentences = []
    for result in comparison.results.values():
        reported = result.reported_covariance
        if reported is None:
            if result.entry.covariance is not None:
                sentences.append(f"The covariances of {result.name} are not evaluated: {result.notes['nees']}.")
            continue
        known = reported.nees[~np.isnan(reported.nees)]
        if len(known):
            mean = float(np.mean(known))
            sentences.append(
                f"Normalized error RMS of {result.name} (root of the mean NEES / {DEGREES_OF_FREEDOM}, expected 1): "
                f"{number(float(np.sqrt(mean / DEGREES_OF_FREEDOM)))} (NEES {number(mean)} over "
                f"{counted(len(known), 'pose')}{'; ' if reported.remark else ''}{reported.remark})."
            )
        if reported.not_positive_definite:
            sentences.append(
                f"{number(reported.not_positive_definite)} of the {counted(len(reported.nees), 'covariance')} of "
                f"{result.name} are not positive definite; NEES leaves them out."
            )
    return sentences


def _outside_recording(comparison: Comparison) -> list[str]:
    names = [name for name, pixels in comparison.pixels.items() if pixels.frames == 0]
    if not names:
        return []
    return [f"No pose of {listed(names)} is at a frame of {comparison.sequence}: their time stamps differ."]


def _reprojection(comparison: Comparison) -> list[str]:
    tables = {name: pixels.along for name, pixels in comparison.pixels.items()}
    medians = {name: float(table["error"].median()) for name, table in tables.items() if table is not None}
    if len(medians) < 2:
        return []
    each = listed(f"{number(medians[name])} px for {name}" for name in sorted(medians, key=lambda name: medians[name]))
    return [
        f"Median reprojection error, landmarks triangulated along each path: {each}.",
        "This error measures the motion over the length of a track, not drift.",
    ]


def _maps(comparison: Comparison) -> list[str]:
    known = {name: result.map for name, result in comparison.results.items() if result.map is not None}
    if not known:
        return []
    each = listed(
        f"{number(float(table['distance'].median()))} m for {name} ({number(float(table['seen'].median()))} m in the "
        f"camera frame; {counted(len(table), 'common landmark')})"
        for name, table in known.items()
    )
    return [f"Map difference from {comparison.reference.name} (median): {each}."]


def _held_out(comparison: Comparison) -> list[str]:
    table = comparison.held_out
    return [] if table is None or len(table) < 2 else held_out_sentences(table, "the held-out tracks")
