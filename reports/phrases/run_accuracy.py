"""Sentences on ATE and divergence; a difference is claimed only where it is significant.

It is significant where the 95 % interval of the paired block bootstrap excludes zero, over the frames in which all
estimators have a pose, and where the printed figures differ. By-products of the reference and other minima of its graph
do not compete with it: their divergence is reported, and they are not ranked.
"""

from collections.abc import Iterable
from pathlib import PurePath

import numpy as np

from fgbaseline.compare import PairedRanking, RmseDifference, divergence_summary, paired_ranking, rmse_difference
from fgbaseline.compare.divergence_onset import path_length
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.compare.sample_sizes import insufficient_truth

from ..formatting import RESOLUTION, counted, listed, number, per_cent, resolved
from ..results.metrics import ate_resolution
from .evidence import ROUGH, no_difference


def is_claimed(difference: RmseDifference, larger: float, smaller: float) -> bool:
    """Whether an RMSE is significantly larger than another, and printed as a larger number."""
    return difference.settled and difference.value > 0.0 and larger > smaller and number(larger) != number(smaller)


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
    sentences = [f"ATE (RMSE after {alignment} to the ground truth, {source}, {coverage}): {each}."]
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
    equal = [name for name in smaller if text[name] == text[reference]]
    better = [name for name in smaller if name not in equal and is_claimed(pairs[name], own, found.rmse[name])]
    over = _over(run, found)
    sentences = []
    if better:
        than = listed(f"{name} ({text[name]} m)" for name in better)
        sentences.append(
            f"The reference {reference} has a larger ATE ({text[reference]} m) than {than}, by paired bootstrap{over}; "
            f"divergence from it does not measure accuracy on this recording.{_rough(pairs[name] for name in better)}"
        )
    sentences += no_difference(reference, [name for name in smaller if name not in (*better, *equal)], "ATE", over)
    if equal:
        sentences.append(
            f"The ATE of {listed([*equal, reference])} is the same to the printed digits{over}: not ranked."
        )
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
        each = listed(f"{name} {resolved(r.divergence_rmse, RESOLUTION)} m" for name, r in rivals.items())
        sentences.append(f"Divergence from {run.reference} (RMSE, no frames in common, not ranked): {each}.")
    for result in known:
        divergence = f"divergence {resolved(result.divergence_rmse, RESOLUTION)} m (RMSE)"
        if result.name in run.by_products:
            sentences.append(
                f"{result.name}, a by-product of {run.reference} with pose k from data up to frame k: {divergence}."
            )
        elif result.name in run.same_graph:
            sentences.append(f"{result.name}, another minimum of the graph of {run.reference}: {divergence}.")
    return sentences


def _ranked(run: Run, rivals: dict[str, Result], found: PairedRanking) -> list[str]:
    first, *others = found.rmse

    def each(names: Iterable[str]) -> str:
        return listed(
            f"{name} {resolved(found.rmse[name], RESOLUTION)} m{_share(found.rmse[name], rivals[name])}"
            for name in names
        )

    over = f"RMSE over a path of {number(path_length(rivals[first]))} m{_over(run, found)}"
    larger = [name for name in others if is_claimed(found.behind[name], found.rmse[name], found.rmse[first])]
    level = [name for name in others if name not in larger]
    equal = [name for name in level if number(found.rmse[name]) == number(found.rmse[first])]
    is_smallest = bool(larger) and not level
    title = "Smallest divergence" if is_smallest else "Divergence"
    sentences = [f"{title} from {run.reference} ({over}): {each([first, *level])}."]
    sentences += no_difference(first, [name for name in level if name not in equal], "divergence")
    if equal:
        sentences.append(f"The divergence of {listed([first, *equal])} is the same to the printed digits.")
    if larger:
        rough = _rough(found.behind[name] for name in larger)
        sentences.append(f"Larger divergence than {first}, by paired bootstrap: {each(larger)}.{rough}")
    return sentences


def _share(rmse: float, result: Result) -> str:
    length = path_length(result)
    return f" ({per_cent(rmse / length)} of the path)" if length > 0 else ""


def _rough(differences: Iterable[RmseDifference]) -> str:
    return "" if all(difference.reliable for difference in differences) else f" {ROUGH}"


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
