"""Sentences on what supports a result: trust in the reference, samples, held-out tracks, thresholds, position errors.

A run and a comparison share those up to `no_difference`; the others are on the position errors of a comparison.
"""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE, RmseDifference, is_claimed, is_level
from fgbaseline.compare.divergence_onset import FAR, FAR_SHARE
from fgbaseline.compare.statistics.paired_bootstrap import MIN_DIFFERENCE
from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.sample_sizes import coverage
from fgbaseline.data.wording import capitalized, plural
from fgbaseline.geometry.path_length import path_length

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

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare import Trust

FIRST = 6
"""sentences of a verdict that stand above the table"""
NOTABLE_SHARE = 0.05
"""share of heading or scale in the squared position error from which on it is reported"""
MEANING: Mapping[str, str] = {
    "doubtful": "A small divergence from it still shows agreement; a large one may be an error of the reference",
    "untrusted": "Divergence from it does not measure accuracy",
}
"""consequence of a verdict other than `trusted`"""
WITHIN = limit_per_cent(MIN_DIFFERENCE)
"""difference up to which two errors are the same, as text"""


def reference_sentence(name: str, trust: "Trust", *, is_compared: bool = True) -> str:
    """Trust in a reference with its first reason where it is trusted, else with those against it and what follows."""
    word = trust.verdict.name.lower()
    if word == "trusted" and trust.criteria:
        n = len(trust.criteria)
        return (
            f"The reference, {name}, is trusted ({n} of {plural(n, 'criterion', 'criteria')}). "
            f"{capitalized(trust.reasons[0])}."
        )
    reasons = "; ".join((trust.against or trust.reasons)[:3])
    if word == "trusted" or not is_compared:
        return f"The reference, {name}, is {word}: {reasons}."
    return f"The reference, {name}, is {word}: {reasons}. {MEANING[word]}."


def in_pixels(medians: Mapping[str, float]) -> str:
    """Median reprojection errors by name, the smallest first: `0.52 px for ekf and 0.61 px for isam2`."""
    return listed(f"{number(medians[name])} px for {name}" for name in sorted(medians, key=lambda name: medians[name]))


def causal_estimate(reference: str) -> str:
    """Description of the by-product of a smoother."""
    return (
        f"the causal estimate of {reference} (pose k from frames 0 to k, before {reference}'s final Gauss-Newton steps)"
    )


def sample_requirement() -> str:
    """Sample that `fgbaseline check` requires."""
    return f"fgbaseline check requires {MIN_SAMPLE_SIZE} over {limit_per_cent(MIN_COVERAGE)}"


def threshold(bounds: Iterable[float]) -> str:
    """Thresholds on distances of one kind: 5 m, or 1 % of the path lengths where that is less."""
    every = sorted(bounds)
    if every[0] >= FAR:
        return f"{every[0]:g} m ({limit_per_cent(FAR_SHARE)} of the path length, at most {FAR:g} m)"
    least, most = number(every[0]), number(every[-1])
    return f"{limit_per_cent(FAR_SHARE)} of the path length, {least if least == most else f'{least} to {most}'} m"


def threshold_sentences(quantity: str, most: Mapping[str, tuple[float, str]], onset: Mapping[str, str]) -> list[str]:
    """Largest `quantity` of all estimators and the exceedances, two sentences for each threshold.

    `most` has threshold (m) and maximum (with its unit) by name; `onset` has the times of exceedance, where there are
    any.
    """
    sentences = []
    for those in grouped((bound >= FAR, name) for name, (bound, _) in most.items()).values():
        each = listed(f"{name} {most[name][1]}" for name in those)
        beyond = "; ".join(f"{name} {onset[name]}" for name in onset if name in those)
        exceeded = f" Above the threshold: {beyond}." if beyond else ""
        text = threshold([most[name][0] for name in those])
        sentences.append(f"Maximum {quantity}: {each}; threshold {text}.{exceeded}")
    return sentences


def reference_sigma_sentence(name: str, sigma: Mapping[str, float | None]) -> str:
    """Sigma of the reference by `PoseSigma` of the results: its possible distance from the truth."""
    along, final, turn, final_turn = (
        number(sigma[key]) for key in ("position_rmse", "position_final", "rotation_rmse_deg", "rotation_final_deg")
    )
    return (
        f"Sigma of the reference {name}, with its start fixed: position (3D) {along} m RMS, {final} m at the end; "
        f"rotation {turn}° RMS, {final_turn}° at the end."
    )


def held_out_sentences(ranking: "pd.DataFrame", sample: str) -> list[str]:
    """Median held-out errors, paths without a significant difference from the first, and those with one within 1 %.

    `ranking` has a row for each path, best first, with `median` and `behind_low`; `sample` names what it is taken over.
    """
    medians = {str(name): number(float(median)) for name, median in ranking["median"].items()}
    best, *others = medians
    each = listed(f"{median} px for {name}" for name, median in medians.items())
    least = ranking["median"].iloc[0]
    tied = [name for name in others if not ranking["behind_low"][name] > 0.0]
    level = [name for name in others if name not in tied and is_level(ranking["median"][name], least)]
    return [
        f"Held-out error (median over {sample}): {each}.",
        *no_difference(best, tied, "held-out error"),
        *([f"The held-out error of {listed([best, *level])} is the same within {WITHIN}."] if level else []),
    ]


def no_difference(first: str, others: Iterable[str], quantity: str, over: str = "") -> list[str]:
    """Estimators that the paired bootstrap does not separate from the first; none without any."""
    names = list(others)
    end = f"between {first} and {listed(names)}{over} (paired bootstrap, 95 % interval)"
    return [f"No significant difference in {quantity} {end}."] if names else []


def position_rmse(comparison: Comparison) -> list[str]:
    """Position RMSEs in order, over the common poses; where these are not all poses, also over all of each."""
    name = comparison.reference.name
    others = [result for result in comparison.ranked if not result.entry.by_product]
    causal = [result for result in comparison.ranked if result.entry.by_product]
    by_products = [f"{result.name}, {causal_estimate(name)}: {_rmse(result)}." for result in causal]
    if not others:
        return by_products
    if comparison.ranking.same:
        path = float(others[0].divergence["traveled"][-1])
        share = f" ({per_cent(others[0].rmse / path)} of the path length, {number(path)} m)" if path > 0 else ""
        first, *rest = (f"{result.name} {_rmse(result)}" for result in others)
        each = listed([f"{first}{share}", *rest])
        return [f"Position RMSE against {_aligned(comparison)}: {each}.", *_order(comparison), *by_products]
    each = listed(
        f"{r.name} {_rmse(r)} over {counted(len(r.matched), 'pose')} "
        f"({per_cent(coverage(comparison, r))} of {name}'s time)"
        for r in others
    )
    return [*_over_common(comparison), f"Position RMSE over all poses of each estimate: {each}.", *by_products]


def _aligned(comparison: Comparison) -> str:
    """The reference, and the alignment of all estimates to it."""
    return f"{comparison.reference.name}, {next(iter(comparison.results.values())).matched.alignment.method}"


def _over_common(comparison: Comparison) -> list[str]:
    """Ranking of estimates that do not have the same stamps, and the estimates that are not ranked."""
    ranking, name = comparison.ranking, comparison.reference.name
    apart = [r.name for r in comparison.ranked if not r.entry.by_product and ranking.rank(r.name) is None]
    if len(ranking.rivals) < 2:
        return [f"Not ranked, too few poses in common: {listed([*ranking.rivals, *apart])}."]
    each = listed(f"{n} {number(ranking.rmse(n))} m" for n in ranking.rivals)
    having = "the others have" if apart else "all have"
    common = f"over the {counted(ranking.moments, 'pose')} that {having}"
    text = f"Position RMSE against {_aligned(comparison)}, {common}: {each}."
    missing = [f"Not ranked, too few poses in common with {name}: {listed(apart)}."] if apart else []
    return [text, *_order(comparison), *missing]


def _order(comparison: Comparison) -> list[str]:
    behind = {n: d for n, d in comparison.behind.items() if not _is_unresolved(comparison.results[n])}
    rmse = {name: comparison.ranking.rmse(name) for name in comparison.ranking.rivals}
    return significance_sentences(rmse, behind) if behind else []


def significance_sentences(rmse: Mapping[str, float], behind: Mapping[str, RmseDifference]) -> list[str]:
    """Paired differences from the smallest RMSE: claimed ones, significant ones within `MIN_DIFFERENCE`, others.

    `rmse` is by name, smallest first.
    """
    first = next(iter(rmse))
    larger, level, other = (
        f"Larger position RMSE than {first}, by paired bootstrap",
        f"Same position RMSE as {first} within {WITHIN}",
        f"No significant difference from {first}, by paired bootstrap",
    )

    def title(name: str) -> str:
        if is_claimed(behind[name], rmse[name], rmse[first]):
            return larger
        return level if behind[name].settled else other

    groups = grouped(
        (title(name), f"{name} ({_signed(d.value)} m [{_signed(d.low)}, {_signed(d.high)}])")
        for name, d in behind.items()
    )
    return [f"{title}: {listed(groups[title])}." for title in (larger, level, other) if title in groups]


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
    most, onset = dict[str, tuple[float, str]](), dict[str, str]()
    for result in comparison.ranked:
        largest = float(np.nanmax(result.divergence["position"]))
        most[result.name] = (result.bound, f"{resolved(largest, resolution(result.resolution, 'm'))} m")
        if result.passing is not None:
            t = result.passing.t - float(result.matched.reference.t[0])
            when = f"{number(t)} s" if result.matched.reference.stamped else f"frame {result.passing.frame}"
            onset[result.name] = f"first at {when}, {number(result.passing.traveled)} m along the path"
    return threshold_sentences("position error", most, onset)


def file_resolution(comparison: Comparison) -> list[str]:
    """States the resolution where a path is nearer to the reference than the files resolve."""
    each = [f"{r.name} {number(r.resolution['m'])} m" for r in comparison.ranked if r.rmse < r.resolution["m"]]
    nearer = f"Nearer to {comparison.reference.name} than the decimals of the files resolve"
    return [f"{nearer}: {listed(each)}."] if each else []


def _is_unresolved(result: Result) -> bool:
    return result.rmse < resolution(result.resolution, "m")


def error_decompositions(comparison: Comparison) -> list[str]:
    """Shares of heading and scale in the squared position error, where they are notable."""
    resolved_ones = [r for r in comparison.ranked if np.isfinite(r.shares.noise) and not _is_unresolved(r)]
    sentences = []
    for result in resolved_ones:
        if any(result.share_intervals.by_name[name][0] >= NOTABLE_SHARE for name in ("heading", "scale")):
            sentences.append(
                f"Squared position error of {result.name}: {_share(result, 'scale')} from scale (least-squares scale "
                f"{1.0 + 0.01 * result.shares.scale_percent:.4f}), {_share(result, 'heading')} from heading, "
                f"{100.0 * max(result.shares.noise, 0.0):.1f} % from the rest."
            )
    if len(sentences) < len(resolved_ones):
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
        own = path_length(matched.estimate.position) / float(matched.alignment.scale)
        path = path_length(matched.reference.position)
        if path > 0.0 and number(own) != number(path):
            share = f"{per_cent(abs(own / path - 1.0))} {'longer' if own > path else 'shorter'}"
            each.append(f"{result.name} {number(own)} m, {share}")
    return [f"Path length over the paired poses, compared with the reference's: {'; '.join(each)}."] if each else []
