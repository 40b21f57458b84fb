"""Sentences on which estimator is nearer to the truth or to the reference: claimed only where the run settles it.

A difference is claimed where the 95 % interval of the paired block bootstrap has its sign, over the moments at which
all have a pose, and where the two figures differ as printed. The reference's by-products and other minima of its graph
are no competitors of it: their distance is reported, and they are not ranked.
"""

from pathlib import PurePath

import numpy as np

from fgbaseline.compare import PairedRanking, RmseDifference, divergence_summary, paired_ranking, rmse_difference
from fgbaseline.compare.divergence_onset import path_length
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.compare.sample_sizes import insufficient_truth
from fgbaseline.reports.formatting import listed, number, per_cent

ROUGH = "the interval is rough, since the errors change so slowly that fewer than ten independent stretches fit"


def claimed(difference: RmseDifference, larger: float, smaller: float) -> bool:
    """Whether a larger RMSE may be called so: the bootstrap settles the sign, and the two do not read the same."""
    return difference.settled and difference.value > 0.0 and larger > smaller and number(larger) != number(smaller)


def truth_sentences(run: Run) -> list[str]:
    """The errors to the truth, and whether it is settled that the reference has the larger one."""
    truth = run.problem.sequence.truth
    if truth is None or insufficient_truth(run):
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
    found = paired_ranking({name: e for name, e in errors.items() if name == reference or name not in run.unranked})
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
    known = [r for r in run.compared if not np.isnan(r.divergence_rmse)]
    rivals = {r.name: r for r in known if r.name not in run.unranked}
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
        each = listed(f"{name} is {number(r.divergence_rmse)} m" for name, r in rivals.items())
        sentences.append(f"{each} from {run.reference} (RMSE), in frames that they do not share: they are not ranked.")
    for result in known:
        away = f"{number(result.divergence_rmse)} m"
        if result.name in run.by_products:
            sentences.append(
                f"{result.name} is the same run, each pose as known when its frame came: what came later moved them by "
                f"{away} RMSE."
            )
        elif result.name in run.same_graph:
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
