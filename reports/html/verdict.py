"""What the numbers of a run mean, in words: every sentence has a number or a reason, and none flatters."""

from collections.abc import Callable, Iterable

import numpy as np

from fgbaseline.compare import Verdict, divergence_summary, reprojection_summary
from fgbaseline.data import Status
from fgbaseline.reports.common_frames import known
from fgbaseline.reports.comparison import Run
from fgbaseline.reports.figures.panels import DEGREES_OF_FREEDOM

from ..formatting import counted, listed, number, per_cent
from .accuracy_verdict import by_products, compared, nearest_sentences, truth_sentences
from .coverage import coverage_sentences, little_truth_sentences
from .departure import AROUND, departure, far, worst_second, wrong_share
from .evidence_verdict import covariance_sentences, held_out_sentences


def verdict(run: Run) -> list[str]:
    """Sentences on a run, what everything else leans on first."""
    parts: tuple[Callable[[Run], list[str]], ...] = (
        little_truth_sentences,
        _reference,
        coverage_sentences,
        truth_sentences,
        nearest_sentences,
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
    known = {name: value for name, value in mean.items() if not np.isnan(value)}
    if not known:
        return []
    each = (
        f"{number(np.sqrt(value / DEGREES_OF_FREEDOM))} for {name} (NEES {number(value)})"
        for name, value in sorted(
            known.items(), key=lambda item: abs(np.log(max(item[1], 1e-300) / DEGREES_OF_FREEDOM))
        )
    )
    return [f"Normalized error RMS, the root of the mean NEES / {DEGREES_OF_FREEDOM} (expected 1): {listed(each)}."]


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
        f"Over the {counted(len(common), 'observation')} that all of them used, the median reprojection error is "
        f"{each}."
    ]


def _mask(run: Run) -> list[str]:
    overall = wrong_share(run.problem, np.ones(run.problem.n_frames, dtype=np.bool_))
    worst = worst_second(run.problem)
    if overall is None or worst is None:
        return []
    return [
        f"The mask excluded {per_cent(overall)} of the matches for contradicting their own tracks as the velocities "
        f"carry them along, most in the second from {worst.second:.0f} s on: {per_cent(worst.share)}."
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


def _mean(values: Iterable[float]) -> float:
    known = np.asarray([v for v in values if not np.isnan(v)], dtype=np.float64)
    return float(known.mean()) if len(known) else float("nan")
