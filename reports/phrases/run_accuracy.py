"""Sentences on ATE, divergence, and the position sigma that overconfident estimators claim beside their error.

A difference is claimed only where it is significant: where the 95 % interval of the paired block bootstrap excludes
zero, over the frames in which all estimators have a pose, and one is at least 1 % larger. The causal estimate of the
reference and other solvers of its graph do not compete with it: their divergence is reported, and they are not ranked.
"""

from collections.abc import Iterable, Mapping
from pathlib import PurePath

import numpy as np

from fgbaseline.compare import (
    PairedRanking,
    RmseDifference,
    Verdict,
    divergence_summary,
    paired_ranking,
    rmse_difference,
)
from fgbaseline.compare.divergence_onset import path_length
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.compare.reference_trust import BATCH_CRITERIA
from fgbaseline.compare.sample_sizes import insufficient_truth
from fgbaseline.data import EventKind
from fgbaseline.data.wording import noun, plural
from fgbaseline.geometry import FloatArray

from ..formatting import counted, distance, limit_per_cent, listed, number, per_cent, resolved
from ..results.metric_registry import ate_resolution
from .evidence import causal_estimate, no_difference, overconfidence_bound

IN_FULL = 3
"""overconfident estimators with their values; of the others only the names"""
FEW = 2
"""differences whose intervals stand in a sentence"""
MIN_DIFFERENCE = 0.01
"""smallest difference of two RMSE that is claimed, as a share of the smaller: paired errors make less significant, but
it has no consequence"""
WITHIN_SIGMAS = 3.0
"""sigmas of the reference up to which an order by divergence says nothing on accuracy"""


def is_claimed(difference: RmseDifference, larger: float, smaller: float) -> bool:
    """Whether an RMSE is larger than another, significantly and by more than `MIN_DIFFERENCE`."""
    return difference.settled and difference.value > 0.0 and larger > smaller and not _is_level(larger, smaller)


def _is_level(larger: float, smaller: float) -> bool:
    return larger <= (1.0 + MIN_DIFFERENCE) * smaller


def ate_sentences(run: Run) -> list[str]:
    """The ATE of each estimator, and whether the reference's is significantly larger."""
    truth = run.problem.sequence.truth
    if truth is None or insufficient_truth(run):
        return []
    source, n, T = PurePath(truth.source).name, int(truth.known.sum()), run.problem.n_frames
    coverage = f"all {counted(T, 'frame')}" if n == T else f"{number(n)} of {counted(T, 'frame')}"
    tables = {r.name: r.truth_aligned for r in run.answered if r.truth_aligned is not None}
    rmse = {name: divergence_summary(table)["rmse"] for name, table in tables.items()}
    known = sorted((name for name in rmse if not np.isnan(rmse[name])), key=lambda name: rmse[name])
    if not known:
        return [f"There is no ATE: no estimator has a pose where the ground truth ({source}, {coverage}) has one."]
    each = listed(f"{resolved(rmse[name], ate_resolution(run))} m for {name}" for name in known)
    alignment = "SE(3) alignment" if run.problem.imu is None else "alignment in yaw and position"
    sentences = [f"ATE (RMSE to the ground truth ({source}), after {alignment}, over {coverage}): {each}."]
    if run.reference not in known:
        return sentences
    errors = {name: tables[name]["position"].to_numpy() for name in known if run.results[name].ate_common is not None}
    return sentences + _against_reference(run, errors)


def _against_reference(run: Run, errors: dict[str, np.ndarray]) -> list[str]:
    reference = str(run.reference)
    found = paired_ranking({name: e for name, e in errors.items() if name == reference or name not in run.unranked})
    if reference not in found.rmse:
        return []
    own, text = found.rmse[reference], {n: resolved(value, ate_resolution(run)) for n, value in found.rmse.items()}
    smaller = [name for name in found.rmse if name != reference and found.rmse[name] < own]
    pairs = {name: rmse_difference(*_common(errors, (reference, name), found)) for name in smaller}
    level = [name for name in smaller if _is_level(own, found.rmse[name])]
    equal = [name for name in smaller if name in level or text[name] == text[reference]]
    better = [name for name in smaller if name not in equal and is_claimed(pairs[name], own, found.rmse[name])]
    over = _over(run, found)
    sentences = []
    if better:
        than = listed(f"{name} ({text[name]} m)" for name in better)
        sentences.append(
            f"The reference {reference} has a larger ATE ({text[reference]} m) than {than}, by paired bootstrap{over}; "
            f"divergence from it does not measure accuracy on this recording."
            f"{_uncertain({(reference, name): pairs[name] for name in better})}"
        )
    sentences += no_difference(reference, [name for name in smaller if name not in (*better, *equal)], "ATE", over)
    if equal:
        same = f"within {limit_per_cent(MIN_DIFFERENCE)}" if equal == level else "to the printed digits"
        sentences.append(f"The ATE of {listed([*equal, reference])} is the same {same}{over}: not ranked.")
    return sentences


def divergence_sentences(run: Run) -> list[str]:
    """The divergence of each estimator from the reference, and which differences are significant."""
    known = [r for r in run.compared if not np.isnan(r.divergence_rmse)]
    rivals = {r.name: r for r in known if r.name not in run.unranked}
    errors = {
        r.name: r.divergence["position"].to_numpy()
        for r in rivals.values()
        if r.divergence is not None and r.divergence_common is not None
    }
    found = paired_ranking(errors)
    sentences = []
    if found.rmse:
        sentences += _ranked(run, rivals, found)
    elif rivals:
        each = listed(f"{name} {distance(r.divergence_rmse)}" for name, r in rivals.items())
        sentences.append(f"Divergence from {run.reference} (RMSE, no frames in common, not ranked): {each}.")
    for result in known:
        if result.name in run.by_products:
            divergence = f"divergence {distance(result.divergence_rmse)} (RMSE)"
            sentences.append(f"{result.name}, {causal_estimate(str(run.reference))}: {divergence}.")
        elif result.name in run.same_graph:
            sentences.append(_same_graph(run, result))
    return sentences


def _same_graph(run: Run, result: Result) -> str:
    """Distance of another solver of the reference's graph, which may have started at the reference's solution."""
    away = distance(result.divergence_rmse)
    if EventKind.STARTED_AT_ISAM2 not in {event.kind for event in result.estimate.events}:
        return f"{result.name}, which minimizes the same cost as {run.reference}: divergence {away} (RMSE)."
    agrees = all(c.verdict is Verdict.TRUSTED for c in run.trust.criteria if c.code in BATCH_CRITERIA)
    ends = "stays at the same minimum" if agrees else "leaves it"
    return f"{result.name}, started at the solution of {run.reference}, {ends}: {away} (RMSE) from {run.reference}."


def _ranked(run: Run, rivals: dict[str, Result], found: PairedRanking) -> list[str]:
    first, *others = found.rmse

    def each(names: Iterable[str]) -> str:
        return listed(f"{name} {distance(found.rmse[name])}{_share(found.rmse[name], rivals[name])}" for name in names)

    over = f"RMSE over a path length of {number(path_length(rivals[first]))} m{_over(run, found)}{_unranked(run)}"
    larger = [name for name in others if is_claimed(found.behind[name], found.rmse[name], found.rmse[first])]
    level = [name for name in others if name not in larger]
    equal = [name for name in level if _is_level(found.rmse[name], found.rmse[first])]
    is_smallest = bool(larger) and not level
    title = "Smallest divergence" if is_smallest else "Divergence"
    sentences = [f"{title} from {run.reference} ({over}): {each([first, *level])}."]
    sentences += no_difference(first, [name for name in level if name not in equal], "divergence")
    if equal:
        sentences.append(
            f"The divergence of {listed([first, *equal])} is the same within {limit_per_cent(MIN_DIFFERENCE)}."
        )
    if larger:
        uncertain = _uncertain({(name, first): found.behind[name] for name in larger})
        sentences.append(f"Larger divergence than {first}, by paired bootstrap: {each(larger)}.{uncertain}")
        sentences += _closeness(run, found)
    return sentences


def _closeness(run: Run, found: PairedRanking) -> list[str]:
    """States that an order within few sigmas of the reference is not one by accuracy."""
    sigma = run.results[str(run.reference)].evidence.sigma.position_rmse
    if not max(found.rmse.values()) < WITHIN_SIGMAS * sigma:
        return []
    solved = f" Trusted means that {run.reference} solves this problem well, not that it is close to the truth."
    return [
        f"The divergences (RMSE) of {listed(found.rmse)} are below {WITHIN_SIGMAS:g} times the RMS position "
        f"sigma of {run.reference} ({WITHIN_SIGMAS:g} × {number(sigma)} m): the ranking shows which is closer to "
        f"{run.reference}, not which is closer to the truth.{solved if run.trust.verdict is Verdict.TRUSTED else ''}"
    ]


def _share(rmse: float, result: Result) -> str:
    length = path_length(result)
    return f" ({per_cent(rmse / length)} of the path length)" if length > 0 else ""


def _uncertain(differences: Mapping[tuple[str, str], RmseDifference]) -> str:
    """Intervals of differences (larger, smaller) that are not reliable, or of many the fewest blocks they rest on."""
    unreliable = {names: d for names, d in differences.items() if not d.reliable}
    if not unreliable:
        return ""
    why = "the errors stay correlated over much of the recording"
    if len(unreliable) > FEW:
        blocks = plural(min(int(d.blocks) for d in unreliable.values()), "block")
        n = len(unreliable)
        return f" The 95 % intervals of {n} of these differences are rough, from {blocks}: {why}."
    each = [
        f"{number(d.value)} m [{number(d.low)}, {number(d.high)}] ({larger} above {smaller}, "
        f"{plural(int(d.blocks), 'block')})"
        for (larger, smaller), d in unreliable.items()
    ]
    title = "The difference is" if len(each) == 1 else "The differences are"
    interval = "Its 95 % interval is" if len(each) == 1 else "Their 95 % intervals are"
    return f" {title} {listed(each)}. {interval} rough: {why}."


def _unranked(run: Run) -> str:
    """Clause on the results of the reference's own graph, which may be closer to it than all that are ranked."""
    names = [r.name for r in run.results.values() if r.name in run.same_graph | run.by_products]
    known = [name for name in names if name != run.reference and run.results[name].divergence is not None]
    if not known:
        return ""
    return f"; {listed(known)}, of the same graph, {noun(len(known), 'is', 'are')} not ranked"


def _over(run: Run, found: PairedRanking) -> str:
    T = run.problem.n_frames
    return "" if found.moments == T else f", over the {number(found.moments)} of {counted(T, 'frame')} that all have"


def _common(
    errors: dict[str, np.ndarray], names: tuple[str, str], found: PairedRanking
) -> tuple[np.ndarray, np.ndarray]:
    """The errors of two estimates in the frames that all ranked ones have."""
    everywhere = ~np.any([np.isnan(errors[name]) for name in found.rmse], axis=0)
    first, second = (errors[name][everywhere] for name in names)
    return first, second


def overconfidence_sentences(run: Run) -> list[str]:
    """One sentence on all overconfident estimators: the reference, then the largest error over its claimed sigma."""
    found = sorted(
        (r for r in run.answered if is_overconfident(run, r)),
        key=lambda r: (r.name != run.reference, -_actual(run, r)[0] / _claimed(r)),
    )
    if not found:
        return []
    each = "; ".join(_claim(run, result) for result in found[:IN_FULL])
    others = [result.name for result in found[IN_FULL:]]
    more = f"; likewise {listed(others)}" if others else ""
    return [f"Overconfident: {each}{more}."]


def is_overconfident(run: Run, result: Result) -> bool:
    """Whether covariances contradict errors: the median NEES to ground truth exceeds the bound of a single pose.

    Against the reference it counts only beside a claimed sigma below the divergence; P smaller than P_ref in most
    frames counts in the same way.
    """
    if _is_inconsistent(result):
        return True
    difference = None if result.name in run.unranked else result.evidence.difference
    if difference is None or not 0.0 < _claimed(result) < _actual(run, result)[0]:
        return False
    return difference.is_overconfident or _median(difference.nees) > overconfidence_bound()


def _is_inconsistent(result: Result) -> bool:
    return result.nees is not None and _median(result.nees) > overconfidence_bound()


def reference_nees_sentences(run: Run) -> list[str]:
    """Estimators whose median reference NEES exceeds the bound of one pose although their sigma covers the divergence.

    They are not called overconfident, since their position sigma is not below their RMSE.
    """
    medians = {}
    for result in run.answered:
        difference = None if result.name in run.unranked else result.evidence.difference
        if difference is None or is_overconfident(run, result) or 2 * difference.left_out.sum() > run.problem.n_frames:
            continue
        medians[result.name] = _median(difference.nees)
    each = [f"{name} {number(nees)}" for name, nees in medians.items() if nees > overconfidence_bound()]
    if not each:
        return []
    its, small = ("Its", "covariance is") if len(each) == 1 else ("Their", "covariances are")
    return [
        f"Median reference NEES: {listed(each)}; threshold {number(overconfidence_bound())} (97.5 % quantile of one "
        f"pose). {its} position sigma covers the divergence, but the pose {small} too small in rotation or in a single "
        "direction."
    ]


def _claim(run: Run, result: Result) -> str:
    distance, other = _actual(run, result)
    ratio, difference = result.evidence.sigma_ratio, result.evidence.difference
    if difference is not None and difference.is_overconfident:
        difference = None  # its NEES is that of the few frames in which P - P_ref is positive definite
    figures = {
        "median NEES of the pose": float("nan") if result.nees is None else _median(result.nees),
        "median reference NEES": float("nan") if difference is None else _median(difference.nees),
        f"median sigma ratio to {run.reference}": float("nan") if ratio is None else float(ratio["position"].median()),
    }
    known = ", ".join(f"{name} {number(value)}" for name, value in figures.items() if np.isfinite(value))
    measured = f"; {known}" if known else ""
    claimed = number(_claimed(result))
    if _claimed(result) >= distance:
        return (
            f"{result.name} differs from {other} by {number(distance)} m (RMSE{measured}), less than its position "
            f"sigma of {claimed} m (RMS), but its covariance is too small in rotation or in a single direction"
        )
    return (
        f"{result.name} claims a position sigma of {claimed} m (RMS) but differs from {other} by {number(distance)} m "
        f"(RMSE{measured})"
    )


def _actual(run: Run, result: Result) -> tuple[float, str]:
    """RMSE of the positions, m, unaligned, and what it is measured from: ground truth where NEES rests on it."""
    table = result.truth if _is_inconsistent(result) or result.name == run.reference else result.divergence
    distance = float("nan") if table is None else float(np.sqrt(np.nanmean(table["position"].to_numpy() ** 2)))
    return distance, "ground truth" if table is result.truth else str(run.reference)


def _claimed(result: Result) -> float:
    return result.evidence.sigma.position_rmse


def _median(values: FloatArray) -> float:
    known = values[~np.isnan(values)]
    return float(np.median(known)) if len(known) else float("nan")
