"""What the numbers of a comparison mean, in words: the trust in the reference first, and none that flatters."""

from collections.abc import Callable, Mapping

import numpy as np

from fgbaseline.compare import SMALLEST_COVERAGE, SMALLEST_SAMPLE, RmseDifference, Verdict, too_small
from fgbaseline.compare.travel import distance_travelled

from ..formatting import counted, listed, number, per_cent
from .beyond_wording import claimed_said, held_out_said, maps_said, pixels_said, unmatched_said
from .comparison import Comparison, Result
from .recognized import recognized, up_of
from .samples import coverage, samples

MEANING = {
    Verdict.DOUBTFUL: "a small distance from it says more than a large one",
    Verdict.UNTRUSTED: "distances from it say how much two answers disagree, and not which one is right",
}


def caption(comparison: Comparison) -> str:
    """What was paired, how it was aligned and what the intervals are: under every table."""
    said: dict[str, list[str]] = {}
    for result in comparison.results.values():
        said.setdefault(result.matched.caption, []).append(result.name)
    parts = [text if len(said) == 1 else f"{listed(names)}: {text}" for text, names in said.items()]
    return (
        f"Compared with {comparison.reference.name}: {'. '.join(parts)}. {up_of(comparison)} "
        "In brackets 95 % confidence intervals of a block bootstrap."
    )


def verdict(comparison: Comparison) -> list[str]:
    """Sentences on a comparison, what everything else leans on first."""
    parts: tuple[Callable[[Comparison], list[str]], ...] = (
        _too_little,
        _reference,
        recognized,
        _nearest,
        _passing,
        _shares,
        _lengths,
        _offsets,
        _left_out,
        _open,
        _unsure,
        claimed_said,
        unmatched_said,
        pixels_said,
        maps_said,
        held_out_said,
    )
    return [sentence for part in parts for sentence in part(comparison)]


def _too_little(comparison: Comparison) -> list[str]:
    """Which estimates have so few pairs that no figure of theirs says much."""
    sentences = []
    for name, result in comparison.results.items():
        sample = samples(comparison, result)["translation"]
        if too_small(sample, SMALLEST_SAMPLE, SMALLEST_COVERAGE):
            n, poses = len(result.matched), len(result.entry.trajectory)
            sentences.append(
                f"Too little to judge {name} by: {number(n)} of its {number(poses)} poses "
                f"{'has' if n == 1 else 'have'} a partner in {comparison.reference.name}, over "
                f"{per_cent(sample['coverage'])} of its time; fgbaseline check asks for {SMALLEST_SAMPLE} over "
                f"{per_cent(SMALLEST_COVERAGE)}."
            )
    return sentences


def _interval(result: Result) -> tuple[float, float]:
    table = result.statistics["translation"]
    return float(table["low"]["rmse"]), float(table["high"]["rmse"])


def _reference(comparison: Comparison) -> list[str]:
    name, trust = comparison.reference.name, comparison.reference.trust
    if trust is None:
        return [f"The reference, {name}, is taken as given: its file does not say how far it can be trusted."]
    reasons = "; ".join(trust.reasons[:3])
    if trust.verdict is Verdict.TRUSTED:
        return [f"The reference, {name}, is trusted on its own evidence: {reasons}."]
    return [f"The reference, {name}, is {trust.verdict.name.lower()}: {reasons}; {MEANING[trust.verdict]}."]


def _nearest(comparison: Comparison) -> list[str]:
    """The order over the moments that all have; where these are not all moments, beside what each one covers."""
    ranking, name = comparison.ranking, comparison.reference.name
    sentences = [
        f"{result.name} is the same run, each pose as known when its frame came: {_with_interval(result)} away."
        for result in comparison.ranked
        if result.entry.by_product
    ]
    others = [result for result in comparison.ranked if not result.entry.by_product]
    if not others:
        return sentences
    if ranking.same:
        first, *rest = others
        text = f"{first.name} is {_with_interval(first)} from {name} (RMSE of the positions){_of_path(first)}"
        if rest:
            text = f"Nearest: {text}; then " + listed(f"{r.name} with {_with_interval(r)}" for r in rest)
        return [f"{text}.", *_order(comparison), *sentences]
    each = listed(f"{r.name} {_with_interval(r)} over {_covers(comparison, r)}" for r in others)
    return [*_over_common(comparison), f"Each over all of its own moments: {each}.", *sentences]


def _over_common(comparison: Comparison) -> list[str]:
    """The ranking of estimates that do not have the same moments, and what is left out of it."""
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


def _covers(comparison: Comparison, result: Result) -> str:
    pairs = number(len(result.matched))
    return f"{pairs} moments ({per_cent(coverage(comparison, result))} of {comparison.reference.name}'s time)"


def _of_path(result: Result) -> str:
    path = float(result.departure["travelled"].iloc[-1])
    return f", {per_cent(result.rmse / path)} of its path of {number(path)} m" if path > 0 else ""


def _order(comparison: Comparison) -> list[str]:
    """Whether the recording settles who is nearest: by blocks of moments drawn for both."""
    return order_in_words(comparison.ranking.rivals[0], comparison.behind) if comparison.behind else []


def order_in_words(first: str, behind: Mapping[str, RmseDifference]) -> list[str]:
    """What the differences of others from the `first`, which is the nearest, say of the order."""
    unsettled: list[str] = []
    settled: list[str] = []
    for name, d in behind.items():
        said = f"{name} ({_signed(d.value)} m [{_signed(d.low)}, {_signed(d.high)}])"
        (settled if d.settled else unsettled).append(said)
    sentences = []
    if settled:
        sentences.append(f"Farther than {first}, by paired bootstrap of their RMSE: {listed(settled)}.")
    if unsettled:
        sentences.append(
            f"This recording does not settle whether {first} is nearer than {listed(unsettled)}: the paired "
            "interval of the difference is not above zero."
        )
    return sentences


def _signed(metres: float) -> str:
    return number(metres) if not metres < 0 else f"\N{MINUS SIGN}{number(-metres)}"


def _with_interval(result: Result) -> str:
    low, high = _interval(result)
    if not (np.isfinite(low) and np.isfinite(high)):
        return f"{number(result.rmse)} m"
    return f"{number(result.rmse)} m [{number(low)}, {number(high)}]"


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
        s = result.shares
        if not np.isfinite(s.noise):
            continue
        heading, scale, rest = (_share(result, name) for name in ("heading", "scale", "noise"))
        sentences.append(
            f"Of {result.name}'s squared distance {heading} is heading, {scale} scale (least-squares scale "
            f"{1.0 + 0.01 * s.scale_percent:.4f} of its positions on the reference's) and {rest} the rest."
        )
    return sentences


def _lengths(comparison: Comparison) -> list[str]:
    """By how much the path of each estimate is longer or shorter, over the paired poses, as it came."""
    sentences = []
    for result in comparison.results.values():
        matched = result.matched
        own = float(distance_travelled(matched.estimate.position)[-1]) / float(matched.alignment.scale)
        path = float(distance_travelled(matched.reference.position)[-1])
        if not path > 0.0 or number(own) == number(path):
            continue
        than = "longer" if own > path else "shorter"
        sentences.append(
            f"The path of {result.name} over the paired poses is {number(own)} m long, "
            f"{number(100.0 * abs(own / path - 1.0))} % {than} than the reference's."
        )
    return sentences


def _share(result: Result, name: str) -> str:
    value, low, high = (float(x) for x in result.share_intervals.loc[name, ["value", "low", "high"]].to_numpy())
    if not np.isfinite(low):
        return per_cent(max(value, 0.0))
    return f"{100.0 * max(value, 0.0):.0f} % [{100.0 * low:.0f}, {100.0 * high:.0f}]"


def _offsets(comparison: Comparison) -> list[str]:
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


def _left_out(comparison: Comparison) -> list[str]:
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


def _open(comparison: Comparison) -> list[str]:
    return [
        f"The positions of {result.name} leave {listed(result.matched.alignment.free)} of the alignment open; there "
        "the orientations decided."
        for result in comparison.results.values()
        if result.matched.alignment.free
    ]


def _unsure(comparison: Comparison) -> list[str]:
    names = [r.name for r in comparison.results.values() if not r.statistics["translation"].attrs["reliable"]]
    if not names:
        return []
    return [
        f"The errors of {listed(names)} change so slowly that fewer than ten independent stretches fit into the path: "
        "their intervals are rough."
    ]
