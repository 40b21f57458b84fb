"""Sentences on the position errors of a comparison: RMSE, ranking, maximum, decomposition, length of the path."""

from collections.abc import Mapping

import numpy as np

from fgbaseline.compare import RmseDifference, distance_traveled
from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.sample_sizes import coverage

from ..formatting import (
    MINUS,
    counted,
    grouped,
    interval,
    limit_per_cent,
    listed,
    number,
    per_cent,
    resolution,
    resolved,
)
from .evidence import causal_estimate, threshold_sentences

NOTABLE_SHARE = 0.05
"""share of heading or scale in the squared position error from which on it is reported"""


def position_rmse(comparison: Comparison) -> list[str]:
    """Position RMSEs in order, over the common poses; where these are not all poses, also over all of each."""
    name = comparison.reference.name
    others = [result for result in comparison.ranked if not result.entry.by_product]
    by_products = [
        f"{result.name}, {causal_estimate(name)}: {_rmse(result)}."
        for result in comparison.ranked
        if result.entry.by_product
    ]
    if not others:
        return by_products
    if comparison.ranking.same:
        path = float(others[0].divergence["traveled"][-1])
        share = f" ({per_cent(others[0].rmse / path)} of the path length, {number(path)} m)" if path > 0 else ""
        first, *rest = (f"{result.name} {_rmse(result)}" for result in others)
        each = listed([f"{first}{share}", *rest])
        return [f"Position RMSE against {_reference(comparison)}: {each}.", *_order(comparison), *by_products]
    each = listed(
        f"{r.name} {_rmse(r)} over {counted(len(r.matched), 'pose')} "
        f"({per_cent(coverage(comparison, r))} of {name}'s time)"
        for r in others
    )
    return [*_over_common(comparison), f"Position RMSE over all poses of each estimate: {each}.", *by_products]


def _reference(comparison: Comparison) -> str:
    """The reference, and the alignment of all estimates to it."""
    alignment = next(iter(comparison.results.values())).matched.alignment
    return f"{comparison.reference.name}, {alignment.method}"


def _over_common(comparison: Comparison) -> list[str]:
    """Ranking of estimates that do not have the same stamps, and the estimates that are not ranked."""
    ranking, name = comparison.ranking, comparison.reference.name
    apart = [r.name for r in comparison.ranked if not r.entry.by_product and ranking.rank(r.name) is None]
    if len(ranking.rivals) < 2:
        return [f"Not ranked, too few poses in common: {listed([*ranking.rivals, *apart])}."]
    each = listed(f"{n} {number(ranking.rmse(n))} m" for n in ranking.rivals)
    having = "the others have" if apart else "all have"
    common = f"over the {counted(ranking.moments, 'pose')} that {having}"
    text = f"Position RMSE against {_reference(comparison)}, {common}: {each}."
    missing = [f"Not ranked, too few poses in common with {name}: {listed(apart)}."] if apart else []
    return [text, *_order(comparison), *missing]


def _order(comparison: Comparison) -> list[str]:
    behind = {n: d for n, d in comparison.behind.items() if not _is_unresolved(comparison.results[n])}
    return significance_sentences(comparison.ranking.rivals[0], behind) if behind else []


def significance_sentences(first: str, behind: Mapping[str, RmseDifference]) -> list[str]:
    """Paired differences from the estimate with the smallest RMSE, `first`: the significant ones, and the others."""
    titles = {True: f"Larger position RMSE than {first}", False: f"No significant difference from {first}"}
    groups = grouped(
        (d.settled, f"{name} ({_signed(d.value)} m [{_signed(d.low)}, {_signed(d.high)}])")
        for name, d in behind.items()
    )
    return [f"{titles[k]}, by paired bootstrap: {listed(groups[k])}." for k in titles if k in groups]


def _signed(meters: float) -> str:
    return number(meters) if not meters < 0 else f"{MINUS}{number(-meters)}"


def _rmse(result: Result) -> str:
    """Position RMSE with its interval, `0.52 m [0.41, 0.66]`, or as below the resolution of the files."""
    if _is_unresolved(result):
        return f"{resolved(result.rmse, resolution(result.resolution, 'm'))} m"
    value, mark, bounds = interval(*result.statistics["translation"]["rmse"]).partition(" [")
    return f"{value} m{mark}{bounds}"


def maximum_errors(comparison: Comparison) -> list[str]:
    """Largest position error of each estimate, and when it first exceeds the threshold."""
    onset = {}
    for result in comparison.ranked:
        if result.passing is not None:
            t = result.passing.t - float(result.matched.reference.t[0])
            when = f"{number(t)} s" if result.matched.reference.stamped else f"frame {result.passing.frame}"
            onset[result.name] = f"first at {when}, {number(result.passing.traveled)} m along the path"
    largest = {r.name: float(np.nanmax(r.divergence["position"])) for r in comparison.ranked}
    most = {
        r.name: (r.bound, f"{resolved(largest[r.name], resolution(r.resolution, 'm'))} m") for r in comparison.ranked
    }
    return threshold_sentences("position error", most, onset)


def file_resolution(comparison: Comparison) -> list[str]:
    """States the resolution where a path is nearer to the reference than the files resolve."""
    each = [f"{r.name} {number(r.resolution['m'])} m" for r in comparison.ranked if r.rmse < r.resolution["m"]]
    if not each:
        return []
    return [f"Nearer to {comparison.reference.name} than the decimals of the files resolve: {listed(each)}."]


def _is_unresolved(result: Result) -> bool:
    return result.rmse < resolution(result.resolution, "m")


def error_decompositions(comparison: Comparison) -> list[str]:
    """Shares of heading and scale in the squared position error, where they are notable."""
    sentences, others = [], 0
    for result in comparison.ranked:
        if np.isfinite(result.shares.noise) and not _is_unresolved(result):
            if not any(result.share_intervals.by_name[name][0] >= NOTABLE_SHARE for name in ("heading", "scale")):
                others += 1
                continue
            sentences.append(
                f"Squared position error of {result.name}: {_share(result, 'scale')} from scale (least-squares scale "
                f"{1.0 + 0.01 * result.shares.scale_percent:.4f}), {_share(result, 'heading')} from heading, "
                f"{100.0 * max(result.shares.noise, 0.0):.1f} % from the rest."
            )
    if others:
        of, least = "the other estimates" if sentences else "each estimate", limit_per_cent(NOTABLE_SHARE)
        sentences.append(f"Squared position error of {of}: scale and heading below {least} each.")
    return sentences


def _share(result: Result, name: str) -> str:
    value, low, high = (100.0 * share for share in result.share_intervals.by_name[name])
    bounds = f" [{max(low, 0.0):.1f}, {high:.1f}]" if np.isfinite(low) else ""
    return f"{max(value, 0.0):.1f} %{bounds}"


def path_lengths(comparison: Comparison) -> list[str]:
    """Length of each path over the paired poses, before alignment, against the reference's."""
    each = []
    for result in comparison.results.values():
        matched = result.matched
        own = float(distance_traveled(matched.estimate.position)[-1]) / float(matched.alignment.scale)
        path = float(distance_traveled(matched.reference.position)[-1])
        if path > 0.0 and number(own) != number(path):
            share = f"{per_cent(abs(own / path - 1.0))} {'longer' if own > path else 'shorter'}"
            each.append(f"{result.name} {number(own)} m, {share}")
    return [f"Path length over the paired poses, compared with the reference's: {'; '.join(each)}."] if each else []
