"""Sentences that a run and a comparison share: trust in the reference, sample size, held-out tracks, thresholds."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE, is_level
from fgbaseline.compare.divergence_onset import FAR, FAR_SHARE
from fgbaseline.data.wording import capitalized, plural

from ..formatting import grouped, limit_per_cent, listed, number

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare import Trust

FIRST = 6
"""sentences of a verdict that stand above the table"""
MEANING: Mapping[str, str] = {
    "doubtful": "A small divergence from it still shows agreement; a large one may be an error of the reference",
    "untrusted": "Divergence from it does not measure accuracy",
}
"""consequence of a verdict other than `trusted`"""


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
    """Median held-out errors in a sentence, and the paths without a significant difference from the first in another.

    `ranking` has a row for each path, best first, with `median` and `behind_low`; `sample` names what it is taken over.
    """
    medians = {str(name): number(float(median)) for name, median in ranking["median"].items()}
    best, *others = medians
    each = listed(f"{median} px for {name}" for name, median in medians.items())
    least = ranking["median"].iloc[0]
    tied = [n for n in others if not ranking["behind_low"][n] > 0.0 or is_level(ranking["median"][n], least)]
    return [f"Held-out error (median over {sample}): {each}.", *no_difference(best, tied, "held-out error")]


def no_difference(first: str, others: Iterable[str], quantity: str, over: str = "") -> list[str]:
    """Estimators that the paired bootstrap does not separate from the first; none without any."""
    names = list(others)
    end = f"between {first} and {listed(names)}{over} (paired bootstrap, 95 % interval)"
    return [f"No significant difference in {quantity} {end}."] if names else []
