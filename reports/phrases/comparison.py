"""Sentences on a comparison: the caption of its tables, and its verdict, the trust in the reference first."""

from collections.abc import Mapping

import numpy as np

from fgbaseline.compare import (
    MIN_COVERAGE,
    MIN_SAMPLE_SIZE,
    RmseDifference,
    Verdict,
    distance_traveled,
    is_insufficient,
)
from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.samples import coverage, samples

from ..formatting import MINUS, interval, listed, number, per_cent
from . import comparison_evidence as evidence

MEANING = {
    Verdict.DOUBTFUL: "a small distance from it says more than a large one",
    Verdict.UNTRUSTED: "distances from it say how much two answers disagree, and not which one is right",
}


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
        "In brackets 95 % confidence intervals of a block bootstrap."
    )


def verdict(comparison: Comparison) -> list[str]:
    """All sentences, in the order in which later ones rest on earlier ones."""
    parts = (
        _too_little,
        _reference,
        evidence.remarks,
        _nearest,
        _passing,
        _shares,
        _lengths,
        evidence.offsets,
        evidence.left_out,
        evidence.undetermined,
        evidence.rough_intervals,
        evidence.reported_covariances,
        evidence.unmatched,
        evidence.reprojection,
        evidence.maps,
        evidence.held_out,
    )
    return [sentence for part in parts for sentence in part(comparison)]


def _too_little(comparison: Comparison) -> list[str]:
    """Estimates with so few pairs that their figures judge nothing."""
    sentences = []
    for name, result in comparison.results.items():
        sample = samples(comparison, result)["translation"]
        if is_insufficient(sample, MIN_SAMPLE_SIZE, MIN_COVERAGE):
            n, poses = len(result.matched), len(result.entry.trajectory)
            sentences.append(
                f"Too little to judge {name} by: {number(n)} of its {number(poses)} poses "
                f"{'has' if n == 1 else 'have'} a partner in {comparison.reference.name}, over "
                f"{per_cent(sample['coverage'])} of its time; fgbaseline check asks for {MIN_SAMPLE_SIZE} over "
                f"{per_cent(MIN_COVERAGE)}."
            )
    return sentences


def _reference(comparison: Comparison) -> list[str]:
    name, trust = comparison.reference.name, comparison.reference.trust
    if trust is None:
        return [f"The reference, {name}, is taken as given: its file does not say how far it can be trusted."]
    reasons = "; ".join(trust.reasons[:3])
    if trust.verdict is Verdict.TRUSTED:
        return [f"The reference, {name}, is trusted on its own evidence: {reasons}."]
    return [f"The reference, {name}, is {trust.verdict.name.lower()}: {reasons}; {MEANING[trust.verdict]}."]


def _nearest(comparison: Comparison) -> list[str]:
    """Order over the common moments; where these are not all moments, with the coverage of each estimate."""
    name = comparison.reference.name
    others = [result for result in comparison.ranked if not result.entry.by_product]
    by_products = [
        f"{result.name} is the same run, each pose as known when its frame came: {_rmse(result)} away."
        for result in comparison.ranked
        if result.entry.by_product
    ]
    if not others:
        return by_products
    if comparison.ranking.same:
        first, *rest = others
        path = float(first.departure["travelled"].iloc[-1])
        share = f", {per_cent(first.rmse / path)} of its path of {number(path)} m" if path > 0 else ""
        text = f"{first.name} is {_rmse(first)} from {name} (RMSE of the positions){share}"
        if rest:
            text = f"Nearest: {text}; then " + listed(f"{r.name} with {_rmse(r)}" for r in rest)
        return [f"{text}.", *_order(comparison), *by_products]
    each = listed(
        f"{r.name} {_rmse(r)} over {number(len(r.matched))} moments ({per_cent(coverage(comparison, r))} of {name}'s "
        "time)"
        for r in others
    )
    return [*_over_common(comparison), f"Each over all of its own moments: {each}.", *by_products]


def _over_common(comparison: Comparison) -> list[str]:
    """Ranking of estimates that do not have the same moments, and the estimates left out of it."""
    ranking, name = comparison.ranking, comparison.reference.name
    apart = [r.name for r in comparison.ranked if not r.entry.by_product and ranking.rank(r.name) is None]
    if len(ranking.rivals) < 2:
        return [f"Not ranked, since they do not have enough moments in common: {listed([*ranking.rivals, *apart])}."]
    places = [f"{n} with {number(ranking.rmse(n))} m" for n in ranking.rivals]
    text = (
        f"Over the {number(ranking.moments)} moments that {'the others' if apart else 'all'} have, "
        f"{places[0]} is nearest to {name} (RMSE of the positions), then {listed(places[1:])}."
    )
    missing = [f"Not ranked, since it has too few moments of {name}: {listed(apart)}."] if apart else []
    return [text, *_order(comparison), *missing]


def _order(comparison: Comparison) -> list[str]:
    return order_in_words(comparison.ranking.rivals[0], comparison.behind) if comparison.behind else []


def order_in_words(first: str, behind: Mapping[str, RmseDifference]) -> list[str]:
    """Whether paired differences from the nearest, `first`, settle the order."""
    settled: dict[bool, list[str]] = {True: [], False: []}
    for name, d in behind.items():
        settled[d.settled].append(f"{name} ({_signed(d.value)} m [{_signed(d.low)}, {_signed(d.high)}])")
    sentences = []
    if settled[True]:
        sentences.append(f"Farther than {first}, by paired bootstrap of their RMSE: {listed(settled[True])}.")
    if settled[False]:
        sentences.append(
            f"This recording does not settle whether {first} is nearer than {listed(settled[False])}: the paired "
            "interval of the difference is not above zero."
        )
    return sentences


def _signed(meters: float) -> str:
    return number(meters) if not meters < 0 else f"{MINUS}{number(-meters)}"


def _rmse(result: Result) -> str:
    """RMSE of the positions with its interval: `0.52 m [0.41, 0.66]`."""
    low, high = (float(result.statistics["translation"][bound]["rmse"]) for bound in ("low", "high"))
    value, mark, bounds = interval(result.rmse, low, high).partition(" [")
    return f"{value} m{mark}{bounds}"


def _passing(comparison: Comparison) -> list[str]:
    sentences = []
    for result in comparison.ranked:
        bound = f"{number(result.bound)} m"
        if result.passing is None:
            most = float(result.departure["position"].max())
            where = "throughout" if comparison.ranking.same else f"over its {number(len(result.matched))} moments"
            within = f"stays within {bound} {where}: " if most <= result.bound else "is "
            sentences.append(f"{result.name} {within}{number(most)} m off at most.")
            continue
        t = result.passing.t - float(result.matched.reference.t[0])
        when = f"after {number(t)} s" if result.matched.reference.stamped else f"at frame {result.passing.frame}"
        along = f"{number(result.passing.travelled)} m along the path"
        sentences.append(f"{result.name} is first more than {bound} off {when}, {along}.")
    return sentences


def _shares(comparison: Comparison) -> list[str]:
    sentences = []
    for result in comparison.ranked:
        if np.isfinite(result.shares.noise):
            heading, scale, rest = (_share(result, name) for name in ("heading", "scale", "noise"))
            sentences.append(
                f"Of {result.name}'s squared distance {heading} is heading, {scale} scale (least-squares scale "
                f"{1.0 + 0.01 * result.shares.scale_percent:.4f} of its positions on the reference's) and {rest} the "
                "rest."
            )
    return sentences


def _share(result: Result, name: str) -> str:
    value, low, high = (float(x) for x in result.share_intervals.loc[name, ["value", "low", "high"]].to_numpy())
    if not np.isfinite(low):
        return per_cent(max(value, 0.0))
    return f"{100.0 * max(value, 0.0):.0f} % [{100.0 * low:.0f}, {100.0 * high:.0f}]"


def _lengths(comparison: Comparison) -> list[str]:
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
