"""What the numbers of a comparison mean, in words: the trust in the reference first, and none that flatters."""

from collections.abc import Callable

import numpy as np

from fgbaseline.compare import Verdict

from ..page.numbers import listed, number, per_cent
from .beyond_wording import claimed_said, held_out_said, maps_said, pixels_said, unmatched_said
from .comparison import Comparison, Result
from .ranking import ranked, rmse
from .recognized import recognized, up_of

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
        _reference,
        recognized,
        _nearest,
        _passing,
        _shares,
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
    sentences[1:1] = _order(comparison, first)
    return sentences


def _order(comparison: Comparison, first: Result) -> list[str]:
    """Whether the recording settles who is nearest: by blocks of moments drawn for both."""
    unsettled: list[str] = []
    settled: list[str] = []
    for name, d in comparison.behind.items():
        said = f"{name} ({_signed(d.value)} m [{_signed(d.low)}, {_signed(d.high)}])"
        (settled if d.settled else unsettled).append(said)
    sentences = []
    if settled:
        sentences.append(f"Farther than {first.name}, by paired bootstrap of their RMSE: {listed(settled)}.")
    if unsettled:
        sentences.append(
            f"This recording does not settle whether {first.name} is nearer than {listed(unsettled)}: the paired "
            "interval of the difference holds zero."
        )
    return sentences


def _signed(metres: float) -> str:
    return number(metres) if not metres < 0 else f"\N{MINUS SIGN}{number(-metres)}"


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
        heading, scale, rest = (_share(result, name) for name in ("heading", "scale", "noise"))
        sentences.append(
            f"Of {result.name}'s squared distance {heading} is heading, {scale} scale (its path is "
            f"{number(abs(s.scale_percent))} % too {long}) and {rest} the rest."
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
        f"Without a partner, and left out: {number(here)} {'pose' if here == 1 else 'poses'} of {listed(names)}, "
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
