"""Sentences that a run and a comparison share: trust in the reference, sample size, held-out tracks, thresholds."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE
from fgbaseline.compare.divergence_onset import FAR, FAR_SHARE

from ..formatting import listed, number, per_cent

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare import Trust

DEGREES_OF_FREEDOM = 6
"""of a pose"""
MEANING: Mapping[str, str] = {
    "doubtful": "a small divergence from it counts, a large one may be its own error",
    "untrusted": "divergence from it does not measure accuracy",
}
"""of a reference that is not trusted"""
ROUGH = "The interval is rough: fewer than 10 independent blocks fit the path."


def reference_sentence(name: str, trust: "Trust", *, is_compared: bool = True) -> str:
    """Trust in a reference, with its first three reasons and what it means for divergence from it."""
    word, reasons = trust.verdict.name.lower(), "; ".join(trust.reasons[:3])
    if word == "trusted" or not is_compared:
        return f"The reference, {name}, is {word}: {reasons}."
    return f"The reference, {name}, is {word}: {reasons}; {MEANING[word]}."


def sample_requirement() -> str:
    """Sample that `fgbaseline check` requires."""
    return f"fgbaseline check requires {MIN_SAMPLE_SIZE} over {per_cent(MIN_COVERAGE)}"


def threshold(bound: float) -> str:
    """Threshold on a distance: 1 % of the path or, where that is more, 5 m."""
    return (
        f"threshold {number(bound)} m"
        if bound >= FAR
        else f"threshold {per_cent(FAR_SHARE)} of the path, {number(bound)} m"
    )


def held_out_sentences(ranking: "pd.DataFrame", sample: str) -> list[str]:
    """Median held-out errors in a sentence, and the paths without a significant difference from the first in another.

    `ranking` has a row for each path, best first, with `median` and `behind_low`; `sample` names what it is taken over.
    """
    medians = {str(name): number(float(median)) for name, median in ranking["median"].items()}
    best, *others = medians
    each = listed(f"{median} px for {name}" for name, median in medians.items())
    tied = [name for name in others if not ranking["behind_low"][name] > 0.0 or medians[name] == medians[best]]
    return [f"Held-out error (median over {sample}): {each}.", *no_difference(best, tied, "held-out error")]


def no_difference(first: str, others: Iterable[str], quantity: str, over: str = "") -> list[str]:
    """Estimators that the paired bootstrap does not separate from the first; none without any."""
    names = list(others)
    end = f"between {first} and {listed(names)}{over} (paired bootstrap, 95 % interval)"
    return [f"No significant difference in {quantity} {end}."] if names else []
