"""What the numbers of a comparison mean, in words: the trust in the reference first, and none that flatters."""

from collections.abc import Callable

import numpy as np

from fgbaseline.compare import Verdict

from ..page.numbers import listed, number, per_cent
from .comparison import Comparison, Result

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
        f"Compared with {comparison.reference.name}: {'. '.join(parts)}. "
        "In brackets 95 % confidence intervals of a block bootstrap."
    )


def verdict(comparison: Comparison) -> list[str]:
    """Sentences on a comparison, what everything else leans on first."""
    parts: tuple[Callable[[Comparison], list[str]], ...] = (
        _reference,
        _nearest,
        _passing,
        _shares,
        _offsets,
        _left_out,
        _open,
        _unsure,
        _pixels,
        _held_out,
    )
    return [sentence for part in parts for sentence in part(comparison)]


def ranked(comparison: Comparison) -> list[Result]:
    """Nearest to the reference first, by the RMSE of their positions."""
    return sorted(comparison.results.values(), key=rmse)


def rmse(result: Result) -> float:
    """Of the positions, m."""
    return float(result.statistics["translation"]["value"]["rmse"])


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
    own = [result for result in ranked(comparison) if result.entry.by_product]
    sentences = [
        f"{result.name} is the same run, each pose as known when its frame came: {_with_interval(result)} away."
        for result in own
    ]
    others = [result for result in ranked(comparison) if not result.entry.by_product]
    if not others:
        return sentences
    first, *rest = others
    path = float(first.departure["travelled"].iloc[-1])
    of_path = f", {per_cent(rmse(first) / path)} of its path of {number(path)} m" if path > 0 else ""
    text = f"{first.name} is {_with_interval(first)} from {comparison.reference.name} (RMSE of the positions){of_path}"
    if rest:
        text = f"Nearest: {text}; then " + listed(f"{r.name} with {_with_interval(r)}" for r in rest)
    sentences.insert(0, text + ".")
    if rest and _interval(rest[0])[0] <= _interval(first)[1]:
        sentences.insert(
            1,
            f"The intervals of {first.name} and {rest[0].name} overlap: this recording does not settle their order.",
        )
    return sentences


def _with_interval(result: Result) -> str:
    low, high = _interval(result)
    if not (np.isfinite(low) and np.isfinite(high)):
        return f"{number(rmse(result))} m"
    return f"{number(rmse(result))} m [{number(low)}, {number(high)}]"


def _passing(comparison: Comparison) -> list[str]:
    sentences = []
    for result in ranked(comparison):
        bound = f"{number(result.bound)} m"
        if result.passing is None:
            most = float(result.departure["position"].max())
            within = f"stays within {bound} throughout: " if most <= result.bound else "is "
            sentences.append(f"{result.name} {within}{number(most)} m off at most.")
            continue
        t = result.passing.t - float(result.matched.reference.t[0])
        when = f"after {number(t)} s" if result.matched.reference.stamped else f"at frame {result.passing.frame}"
        along = f"{number(result.passing.travelled)} m along the path"
        sentences.append(f"{result.name} is first more than {bound} off {when}, {along}.")
    return sentences


def _shares(comparison: Comparison) -> list[str]:
    sentences = []
    for result in ranked(comparison):
        s = result.shares
        if not np.isfinite(s.noise):
            continue
        long = "long" if s.scale_percent > 0 else "short"
        heading, scale, rest = (per_cent(max(share, 0.0)) for share in (s.heading, s.scale, s.noise))
        sentences.append(
            f"Of {result.name}'s squared distance {heading} is heading, {scale} scale (its path is "
            f"{number(abs(s.scale_percent))} % too {long}) and {rest} the rest."
        )
    return sentences


def _offsets(comparison: Comparison) -> list[str]:
    sentences = []
    for result in comparison.results.values():
        found = result.offset
        if found is None:
            continue
        text = (
            f"The stamps of {result.name} fit best {1e3 * found.seconds:+.3g} ms later "
            f"({1e3 * found.low:+.3g} to {1e3 * found.high:+.3g} ms fit nearly as well)"
        )
        sentences.append(text + ("." if found.determined else "; the path does not determine it."))
    return sentences


def _left_out(comparison: Comparison) -> list[str]:
    same: dict[tuple[int, int], list[str]] = {}
    for result in comparison.results.values():
        counts = (result.matched.left_out_estimate, result.matched.left_out_reference)
        same.setdefault(counts, []).append(result.name)
    return [
        f"{number(here)} poses of {listed(names)} and {number(there)} of {comparison.reference.name} have no partner "
        "and take no part."
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


def _pixels(comparison: Comparison) -> list[str]:
    every = {comparison.reference.name: comparison.reference_pixels}
    every |= {name: result.pixels for name, result in comparison.results.items()}
    medians = {
        name: float(pixels.along["error"].median())
        for name, pixels in every.items()
        if pixels is not None and pixels.along is not None
    }
    if len(medians) < 2:
        return []
    order = sorted(medians, key=lambda name: medians[name])
    each = listed(f"{number(medians[name])} px for {name}" for name in order)
    return [
        f"With landmarks triangulated along each path in the same way, the median reprojection error is {each}: it "
        "ranks them locally, by what happens within the life of a track."
    ]


def _held_out(comparison: Comparison) -> list[str]:
    table = comparison.held_out
    if table is None or len(table) < 2:
        return []
    each = listed(
        f"{number(float(median))} px for {name}" for name, median in zip(table.index, table["median"], strict=True)
    )
    tied = [str(name) for name, low in zip(table.index[1:], table["behind_low"][1:], strict=True) if low <= 0.0]
    said = f"; {listed(tied)} cannot be told from {table.index[0]}" if tied else ""
    return [f"On tracks that were held out, one half predicted from the other, the median error is {each}{said}."]
