"""What the numbers of a run mean, in words: every sentence has a number or a reason, and none flatters."""

from collections.abc import Callable, Iterable
from pathlib import PurePath

import numpy as np

from fgbaseline.compare import Verdict, divergence_summary, reprojection_summary
from fgbaseline.data import Status
from fgbaseline.reports.common_frames import known
from fgbaseline.reports.comparison import Result, Run
from fgbaseline.reports.figures.health import DEGREES_OF_FREEDOM

from .coverage import coverage_sentences, little_truth_sentences
from .departure import AROUND, departure, far, path_length, wrong_seconds, wrong_share
from .evidence_verdict import covariance_sentences, held_out_sentences
from .numbers import listed, number, per_cent


def verdict(run: Run) -> list[str]:
    """Sentences on a run, what everything else leans on first."""
    parts: tuple[Callable[[Run], list[str]], ...] = (
        little_truth_sentences,
        _reference,
        coverage_sentences,
        _truth,
        _nearest,
        _departures,
        _ends,
        _consistency,
        covariance_sentences,
        held_out_sentences,
        _common_observations,
        _mask,
        _noise,
    )
    return [sentence for part in parts for sentence in part(run)]


def compared(run: Run) -> list[Result]:
    """The results that can be held against the reference, nearest first: not itself."""
    others = [r for r in run.answered if r.name != run.reference and r.divergence is not None]
    return sorted(others, key=lambda r: _divergence(r) if r.divergence_common else np.inf)


def by_products(run: Run) -> frozenset[str]:
    """What the reference's own run gave along: near to it by nature."""
    return frozenset() if run.reference is None else frozenset(run.results[run.reference].estimate.by_products)


def _reference(run: Run) -> list[str]:
    if run.reference is None:
        return [f"There is no reference, so nothing is compared: {listed(run.trust.reasons)}."]
    reasons = "; ".join(run.trust.reasons[:3])
    if run.trust.verdict is Verdict.TRUSTED:
        return [f"The reference, {run.reference}, is trusted on its own evidence: {reasons}."]
    meaning = {
        Verdict.DOUBTFUL: "a small distance from it says more than a large one",
        Verdict.UNTRUSTED: "distances from it say how much two answers disagree, and not which one is right",
    }[run.trust.verdict]
    so = f"; {meaning}" if compared(run) else ""
    return [f"The reference, {run.reference}, is {run.trust.verdict.name.lower()}: {reasons}{so}."]


def _truth(run: Run) -> list[str]:
    truth = run.problem.sequence.truth
    if truth is None or little_truth_sentences(run):
        return []
    source, n, T = PurePath(truth.source).name, int(truth.known.sum()), run.problem.n_frames
    coverage = (
        f"all {number(T)} frames"
        if n == T
        else f"{number(n)} of {number(T)} frames; the other {number(T - n)} are left out"
    )
    errors = {r.name: _ate(r) for r in run.answered}
    ranked = sorted((name for name in errors if np.isfinite(errors[name])), key=lambda name: errors[name])
    if not ranked:
        return [f"The truth ({source}; {coverage}) cannot be compared with: no estimator has a pose where it does."]
    each = listed(f"{number(errors[name])} m for {name}" for name in ranked)
    sentences = [f"Against the truth ({source}; {coverage}), the error of the aligned path is {each} (RMSE)."]
    reference = run.reference
    if reference in errors:
        better = [name for name in ranked if errors[name] < errors[reference] and name not in by_products(run)]
        if better:
            than = listed(f"{name} ({number(errors[name])} m)" for name in better)
            sentences.append(
                f"The reference is worse than {than} here: {reference} has {number(errors[reference])} m, "
                "so nearness to it is no merit on this recording."
            )
    return sentences


def _nearest(run: Run) -> list[str]:
    others = [r for r in compared(run) if np.isfinite(_divergence(r))]
    own = [r for r in others if r.name in by_products(run)]
    others = [r for r in others if r.name not in by_products(run)]
    sentences = []
    if others:
        first, *rest = (f"{number(_divergence(r))} m ({_of_path(r)})" for r in others)
        text = f"Nearest to {run.reference} is {others[0].name}, {first} away (RMSE along {_length(others[0])})"
        if rest:
            text += ", then " + listed(f"{r.name} with {away}" for r, away in zip(others[1:], rest, strict=True))
        sentences.append(text + ".")
    for result in own:
        sentences.append(
            f"{result.name} is the same run, each pose as known when its frame came: what came later moved them by "
            f"{number(_divergence(result))} m RMSE."
        )
    return sentences


def _departures(run: Run) -> list[str]:
    sentences = []
    overall = wrong_share(run.problem, np.ones(run.problem.n_frames, dtype=np.bool_))
    for result in compared(run):
        if result.divergence is None or result.name in by_products(run) or not known(result.divergence).any():
            continue
        limit, left = f"{far(result):.3g} m", departure(run, result)
        if left is None:
            most = number(divergence_summary(result.divergence)["max"])
            sentences.append(f"{result.name} stays within {limit} of {run.reference} throughout: {most} m at most.")
            continue
        stay = "for good" if left.beyond == 1.0 else f"and is that far in {per_cent(left.beyond)} of the frames after"
        when = f"at {left.seconds:.1f} s (frame {left.frame})"
        text = f"{result.name} is first more than {limit} from {run.reference} {when}, {stay}"
        if left.wrong is not None and overall is not None:
            text += (
                f"; within {AROUND:g} s of that the mask excluded {per_cent(left.wrong)} of the matches "
                f"({per_cent(overall)} in the whole recording)"
            )
        sentences.append(text + ".")
    return sentences


def _ends(run: Run) -> list[str]:
    sentences = []
    for status in (Status.FAILED, Status.RECOVERED):
        reasons: dict[str, list[str]] = {}
        for result in run.results.values():
            if result.estimate.status is status:
                reasons.setdefault(result.estimate.reason or "no reason was given", []).append(result.name)
        sentences += [f"{listed(names)} {status.value}: {reason.rstrip('.')}." for reason, names in reasons.items()]
    for result in run.answered:
        missing = int(np.isnan(result.estimate.world_T_imu[:, 0, 0]).sum())
        if missing:
            sentences.append(f"{result.name} has no pose in {missing} of {run.problem.n_frames} frames.")
    return sentences


def _consistency(run: Run) -> list[str]:
    mean = {r.name: _mean(r.nees) for r in run.answered if r.nees is not None}
    known = {name: value for name, value in mean.items() if np.isfinite(value)}
    if not known:
        return []
    each = (
        f"{number(np.sqrt(value / DEGREES_OF_FREEDOM))} times for {name} (NEES {number(value)})"
        for name, value in sorted(
            known.items(), key=lambda item: abs(np.log(max(item[1], 1e-300) / DEGREES_OF_FREEDOM))
        )
    )
    return [
        f"True errors against those the covariances claim: {listed(each)}; {DEGREES_OF_FREEDOM} is the NEES of a "
        "filter that knows its errors."
    ]


def _common_observations(run: Run) -> list[str]:
    if run.common is None or not run.common.any():
        return []
    common = np.flatnonzero(run.common)
    medians = {}
    for result in run.answered:
        if result.estimate.used.any():
            table = result.reprojection
            medians[result.name] = reprojection_summary(table[table["observation"].isin(common)])["median"]
    if len(medians) < 2:
        return []
    ranked = sorted(medians, key=lambda name: medians[name])
    each = listed(f"{number(medians[name])} px for {name}" for name in ranked)
    return [
        f"Over the {number(len(common))} observations that all of them used, the median reprojection error is {each}."
    ]


def _mask(run: Run) -> list[str]:
    overall = wrong_share(run.problem, np.ones(run.problem.n_frames, dtype=np.bool_))
    shares = wrong_seconds(run.problem)
    if overall is None or shares is None:
        return []
    worst = int(np.argmax(shares))
    return [
        f"The mask excluded {per_cent(overall)} of the matches for contradicting their own tracks as the velocities "
        f"carry them along, most in the second from {worst} s on: {per_cent(shares[worst])}."
    ]


def _noise(run: Run) -> list[str]:
    problem = run.problem
    if problem.diagnosed:
        return []
    sigma = np.sqrt(np.median(np.diagonal(problem.increment_covariance, axis1=1, axis2=2), axis=0))
    return [
        f"Not diagnosed: {number(float(np.sqrt(problem.pixel_variance)))} px, {number(float(sigma[:3].max()))} m and "
        f"{number(float(np.rad2deg(sigma[3:].max())))}° per frame are assumed as noise (one sigma), not estimated from "
        "this recording."
    ]


def _divergence(result: Result) -> float:
    return float("nan") if result.divergence_common is None else result.divergence_common.rmse


def _ate(result: Result) -> float:
    return float("nan") if result.ate_common is None else result.ate_common.rmse


def _of_path(result: Result) -> str:
    length = path_length(result)
    return f"{per_cent(_divergence(result) / length)} of the path" if length > 0 else "no path"


def _length(result: Result) -> str:
    return f"a path of {number(path_length(result))} m"


def _mean(values: Iterable[float]) -> float:
    finite = np.asarray([v for v in values if np.isfinite(v)], dtype=np.float64)
    return float(finite.mean()) if len(finite) else float("nan")
