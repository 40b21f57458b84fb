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
    is_claimed,
    is_level,
    paired_ranking,
)
from fgbaseline.compare.divergence_onset import reference_path_length
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.compare.overconfidence import (
    Overconfidence,
    large_reference_nees,
    overconfidence_bound,
    overconfident_estimates,
)
from fgbaseline.compare.reference_trust import BATCH_CRITERIA
from fgbaseline.compare.sample_sizes import insufficient_truth
from fgbaseline.compare.statistics.paired_bootstrap import MIN_DIFFERENCE
from fgbaseline.data import EventKind
from fgbaseline.data.wording import noun, plural

from ..formatting import counted, distance, limit_per_cent, listed, number, per_cent, resolved
from ..results.metric_registry import ate_resolution
from .evidence import causal_estimate, no_difference

IN_FULL = 3
"""overconfident estimators with their values; of the others only the names"""
FEW = 2
"""differences whose intervals stand in a sentence"""
WITHIN_SIGMAS = 3.0
"""sigmas of the reference up to which an order by divergence says nothing on accuracy"""


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
    smaller = [name for name in found.rmse if found.rmse[name] < own]
    pairs = {name: found.difference(reference, name) for name in smaller}
    level = [name for name in smaller if is_level(own, found.rmse[name])]
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

    length = number(reference_path_length(rivals[first]))
    over = f"RMSE over a path length of {length} m{_over(run, found)}{_unranked(run)}"
    larger = [name for name in others if is_claimed(found.behind[name], found.rmse[name], found.rmse[first])]
    level = [name for name in others if name not in larger]
    equal = [name for name in level if is_level(found.rmse[name], found.rmse[first])]
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
    length = reference_path_length(result)
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


def overconfidence_sentences(run: Run) -> list[str]:
    """One sentence on all overconfident estimators: the reference, then the largest error over its claimed sigma."""
    found = overconfident_estimates(run)
    if not found:
        return []
    each = "; ".join(_claim(run, estimate) for estimate in found[:IN_FULL])
    others = [estimate.name for estimate in found[IN_FULL:]]
    more = f"; likewise {listed(others)}" if others else ""
    return [f"Overconfident: {each}{more}."]


def _claim(run: Run, estimate: Overconfidence) -> str:
    origin = "ground truth" if estimate.from_truth else run.reference
    figures = {
        "median NEES of the pose": estimate.nees,
        "median reference NEES": estimate.reference_nees,
        f"median sigma ratio to {run.reference}": estimate.sigma_ratio,
    }
    known = [f"{name} {number(value)}" for name, value in figures.items() if np.isfinite(value)]
    measured = f"(RMSE{'; ' if known else ''}{', '.join(known)})"
    if estimate.sigma >= estimate.rmse:
        return (
            f"{estimate.name} differs from {origin} by {number(estimate.rmse)} m {measured}, less than its position "
            f"sigma of {number(estimate.sigma)} m (RMS), but its covariance is too small in rotation or in a single "
            "direction"
        )
    return (
        f"{estimate.name} claims a position sigma of {number(estimate.sigma)} m (RMS) but differs from {origin} by "
        f"{number(estimate.rmse)} m {measured}"
    )


def reference_nees_sentences(run: Run) -> list[str]:
    """Estimators that are not called overconfident, since their sigma covers the divergence, but have a large NEES."""
    each = [f"{name} {number(nees)}" for name, nees in large_reference_nees(run).items()]
    if not each:
        return []
    its, small = ("Its", "covariance is") if len(each) == 1 else ("Their", "covariances are")
    return [
        f"Median reference NEES: {listed(each)}; threshold {number(overconfidence_bound())} (97.5 % quantile of one "
        f"pose). {its} position sigma covers the divergence, but the pose {small} too small in rotation or in a single "
        "direction."
    ]
