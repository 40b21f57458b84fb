"""Which estimator is nearer, claimed only where the run settles it, and where each one leaves the reference.

A difference is claimed where the 95 % interval of the paired block bootstrap has its sign, over the frames that all
have, and where the two figures differ as printed. By-products of the reference and other minima of its graph are not
ranked.
"""

from dataclasses import dataclass
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from fgbaseline.compare import (
    MIN_COVERAGE,
    MIN_SAMPLE_SIZE,
    PairedRanking,
    RmseDifference,
    divergence_summary,
    is_insufficient,
    paired_ranking,
    rmse_difference,
)
from fgbaseline.compare.estimate_comparison import Result, Run, of_truth
from fgbaseline.data import Problem
from fgbaseline.data.problem import WRONG_MATCH
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.formatting import listed, number, per_cent

FAR = 5.0
"""m, at most"""
FAR_SHARE = 0.01
"""of the reference's path, at most"""
AROUND = 1.0
"""s before and after"""


@dataclass(frozen=True, slots=True)
class Departure:
    """The first frame farther from the reference than a distance."""

    frame: int
    seconds: float
    beyond: float
    """share of the frames with a pose from then on that are farther than that"""
    wrong: float | None
    """share of the matches within `AROUND` that the mask excluded as contradicting their tracks; None without a mask"""


def far(result: Result) -> float:
    """From how many metres on an estimator has left the reference: 5 m, or 1 % of the path where that is less."""
    return min(FAR, FAR_SHARE * path_length(result)) or FAR


def path_length(result: Result) -> float:
    """Length of the reference's path, m."""
    return 0.0 if result.divergence is None else float(np.nanmax(result.divergence["travelled"].to_numpy()))


def departure(run: Run, result: Result) -> Departure | None:
    """When `result` leaves the reference; None where it never does."""
    if result.divergence is None:
        return None
    position = result.divergence["position"].to_numpy(dtype=np.float64)
    beyond = position > far(result)
    if not beyond.any():
        return None
    k = int(np.argmax(beyond))
    t = run.problem.sequence.t
    near = np.abs(t - t[k]) <= AROUND
    share = float(beyond[k:][~np.isnan(position[k:])].mean())
    return Departure(k, float(t[k] - t[0]), share, wrong_share(run.problem, near))


def wrong_share(problem: Problem, frames: FloatArray | np.ndarray) -> float | None:
    """Share of the matches of the chosen frames (T,) that the mask excluded as wrong; None without mask or match."""
    wrong = np.isin(problem.excluded, WRONG_MATCH)
    there = frames[problem.sequence.observations.frame]
    return float(wrong[there].mean()) if wrong.any() and there.any() else None


class WrongSecond(NamedTuple):
    """A whole second of the recording."""

    second: float
    """counted from the first frame"""
    share: float
    """of its matches that the mask excluded as wrong"""


def worst_second(problem: Problem) -> WrongSecond | None:
    """The (first) second with the largest share of wrong matches; None without a mask or a match.

    Only seconds that have a frame are looked at: a span in nanoseconds has a billion others between two of them.
    """
    wrong = np.isin(problem.excluded, WRONG_MATCH)
    if not wrong.any():
        return None
    t, frame = problem.sequence.t, problem.sequence.observations.frame
    seconds, place = np.unique(np.floor(t - t[0]), return_inverse=True)
    every = np.bincount(place[frame], minlength=len(seconds))
    share = np.bincount(place[frame[wrong]], minlength=len(seconds)) / np.maximum(every, 1)
    worst = int(np.argmax(share))
    return WrongSecond(float(seconds[worst]), float(share[worst]))


SAME_GRAPH = ("isam2", "batch")
"""estimators that minimize one and the same graph"""
ROUGH = "the interval is rough, since the errors change so slowly that fewer than ten independent stretches fit"


def by_products(run: Run) -> frozenset[str]:
    """Answers that the reference's own run gives as well."""
    return frozenset() if run.reference is None else frozenset(run.results[run.reference].estimate.by_products)


def same_graph(run: Run) -> frozenset[str]:
    """Other minima of the reference's graph."""
    return frozenset(SAME_GRAPH) - {run.reference} if run.reference in SAME_GRAPH else frozenset()


def unranked(run: Run) -> frozenset[str]:
    """No competitors of the reference."""
    return by_products(run) | same_graph(run)


def compared(run: Run) -> list[Result]:
    """The results other than the reference that are held against it, by their RMSE."""
    others = [r for r in run.answered if r.name != run.reference and r.divergence is not None]
    return sorted(others, key=divergence_rmse)


def divergence_rmse(result: Result) -> float:
    """From the reference, m."""
    return float("nan") if result.divergence is None else divergence_summary(result.divergence)["rmse"]


def claimed(difference: RmseDifference, larger: float, smaller: float) -> bool:
    """Whether a larger RMSE may be called so: the bootstrap settles the sign, and the two do not read the same."""
    return difference.settled and difference.value > 0.0 and larger > smaller and number(larger) != number(smaller)


def little_truth_sentences(run: Run) -> list[str]:
    """That the truth is too little to judge by, where it is."""
    sample = of_truth(run)
    if sample is None or not is_insufficient(sample, MIN_SAMPLE_SIZE, MIN_COVERAGE):
        return []
    n = int(sample["n"])
    return [
        f"Too little truth to judge by: {number(n)} of {number(run.problem.n_frames)} frames "
        f"{'has' if n == 1 else 'have'} one, over {per_cent(sample['coverage'])} of the recording's time; "
        f"fgbaseline check asks for {MIN_SAMPLE_SIZE} over {per_cent(MIN_COVERAGE)}."
    ]


def truth_sentences(run: Run) -> list[str]:
    """The errors to the truth, and whether it is settled that the reference has the larger one."""
    truth = run.problem.sequence.truth
    if truth is None or little_truth_sentences(run):
        return []
    source, n, T = PurePath(truth.source).name, int(truth.known.sum()), run.problem.n_frames
    coverage = (
        f"all {number(T)} frames"
        if n == T
        else f"{number(n)} of {number(T)} frames; the other {number(T - n)} are left out"
    )
    tables = {r.name: r.truth_aligned for r in run.answered if r.truth_aligned is not None}
    rmse = {name: divergence_summary(table)["rmse"] for name, table in tables.items()}
    known = sorted((name for name in rmse if not np.isnan(rmse[name])), key=lambda name: rmse[name])
    if not known:
        return [f"The truth ({source}; {coverage}) cannot be compared with: no estimator has a pose where it does."]
    each = listed(f"{number(rmse[name])} m for {name}" for name in known)
    sentences = [f"Against the truth ({source}; {coverage}), the error of the aligned path is {each} (RMSE)."]
    if run.reference not in known:
        return sentences
    errors = {name: tables[name]["position"].to_numpy() for name in known if run.results[name].ate_common is not None}
    return sentences + _against_reference(run, errors)


def _against_reference(run: Run, errors: dict[str, np.ndarray]) -> list[str]:
    reference = str(run.reference)
    found = paired_ranking({name: e for name, e in errors.items() if name == reference or name not in unranked(run)})
    if reference not in found.rmse:
        return []
    own = found.rmse[reference]
    smaller = [name for name in found.rmse if name != reference and found.rmse[name] < own]
    pairs = {name: rmse_difference(*_common(errors, (reference, name), found)) for name in smaller}
    better = [name for name in smaller if claimed(pairs[name], own, found.rmse[name])]
    equal = [name for name in smaller if number(found.rmse[name]) == number(own)]
    unsettled = [name for name in smaller if name not in (*better, *equal)]
    over = _over(run, found)
    sentences = []
    if better:
        than = listed(f"{name} ({number(found.rmse[name])} m)" for name in better)
        rough = "" if all(pairs[name].reliable for name in better) else f" ({ROUGH})"
        sentences.append(
            f"The reference is worse than {than} here, by paired bootstrap of the RMSE{over}: {reference} has "
            f"{number(own)} m, so divergence from it does not measure accuracy on this recording{rough}."
        )
    if unsettled:
        sentences.append(
            f"This recording does not settle whether {listed(unsettled)} or {reference} has the smaller error{over}."
        )
    if equal:
        sentences.append(f"The errors of {listed([*equal, reference])} agree to the digits printed{over}: not ranked.")
    return sentences


def nearest_sentences(run: Run) -> list[str]:
    """The RMSE of each from the reference, and which is settled to be nearer than which."""
    known = [r for r in compared(run) if not np.isnan(divergence_rmse(r))]
    rivals = {r.name: r for r in known if r.name not in unranked(run)}
    sentences = []
    errors = {
        r.name: r.divergence["position"].to_numpy()
        for r in rivals.values()
        if r.divergence is not None and r.divergence_common is not None
    }
    found = paired_ranking(errors)
    if found.rmse:
        sentences.append(_nearest(run, rivals, found))
    elif rivals:
        each = listed(f"{name} is {number(divergence_rmse(r))} m" for name, r in rivals.items())
        sentences.append(f"{each} from {run.reference} (RMSE), in frames that they do not share: they are not ranked.")
    for result in known:
        away = f"{number(divergence_rmse(result))} m"
        if result.name in by_products(run):
            sentences.append(
                f"{result.name} is the same run, each pose as known when its frame came: what came later moved them by "
                f"{away} RMSE."
            )
        elif result.name in same_graph(run):
            same = "another minimum of the same graph"
            sentences.append(f"{result.name}, {same}, is {away} from {run.reference} (RMSE).")
    return sentences


def _nearest(run: Run, rivals: dict[str, Result], found: PairedRanking) -> str:
    first, *others = found.rmse
    along = f"RMSE along a path of {number(path_length(rivals[first]))} m{_over(run, found)}"

    def away(name: str) -> str:
        length = path_length(rivals[name])
        share = f" ({per_cent(found.rmse[name] / length)} of the path)" if length > 0 else ""
        return f"{number(found.rmse[name])} m{share}"

    if not others:
        return f"{first} is {away(first)} from {run.reference} ({along})."
    farther = [name for name in others if claimed(found.behind[name], found.rmse[name], found.rmse[first])]
    level = [name for name in others if name not in farther]
    if level:
        text = f"{first} is {away(first)} from {run.reference} ({along}), " + listed(
            f"{name} {away(name)}" for name in level
        )
        equal = [name for name in level if number(found.rmse[name]) == number(found.rmse[first])]
        unsettled = [name for name in level if name not in equal]
        if unsettled:
            text += f"; this recording does not settle whether {first} is nearer than {listed(unsettled)}"
        if equal:
            text += f"; {listed([first, *equal])} agree to the digits printed"
    else:
        text = f"Nearest to {run.reference} is {first}, {away(first)} away ({along})"
    if farther:
        rough = "" if all(found.behind[name].reliable for name in farther) else f" ({ROUGH})"
        each = listed(f"{name} with {away(name)}" for name in farther)
        text += f"; farther than {first}, by paired bootstrap{rough}: {each}"
    return text + "."


def _over(run: Run, found: PairedRanking) -> str:
    T = run.problem.n_frames
    return "" if found.moments == T else f", over the {number(found.moments)} of {number(T)} frames that all have"


def _common(
    errors: dict[str, np.ndarray], names: tuple[str, str], found: PairedRanking
) -> tuple[np.ndarray, np.ndarray]:
    """The errors of two estimates at the moments that all ranked ones have."""
    everywhere = ~np.any([np.isnan(errors[name]) for name in found.rmse], axis=0)
    first, second = (errors[name][everywhere] for name in names)
    return first, second
