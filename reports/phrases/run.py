"""Verdict on a run: sentences that each have a number or a reason, and none flatters."""

from collections.abc import Callable

import numpy as np

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE, Verdict, reprojection_summary, time_coverage
from fgbaseline.compare.estimate_comparison import Run, known, same_frames
from fgbaseline.compare.sample_sizes import insufficient_truth, truth_sample
from fgbaseline.data import Status
from fgbaseline.reports.formatting import counted, listed, number, per_cent

from .run_accuracy import nearest_sentences, truth_sentences
from .run_evidence import (
    consistency_sentences,
    covariance_sentences,
    departure_sentences,
    held_out_sentences,
    mask_sentences,
)


def verdict(run: Run) -> list[str]:
    """All sentences, in the order in which later ones rest on earlier ones."""
    parts: tuple[Callable[[Run], list[str]], ...] = (
        _little_truth,
        _reference,
        _coverage,
        truth_sentences,
        nearest_sentences,
        departure_sentences,
        _ends,
        consistency_sentences,
        covariance_sentences,
        held_out_sentences,
        _common_observations,
        mask_sentences,
        _noise,
    )
    return [sentence for part in parts for sentence in part(run)]


def _little_truth(run: Run) -> list[str]:
    sample = truth_sample(run)
    if sample is None or not insufficient_truth(run):
        return []
    n = int(sample["n"])
    return [
        f"Too little truth to judge by: {number(n)} of {number(run.problem.n_frames)} frames "
        f"{'has' if n == 1 else 'have'} one, over {per_cent(sample['coverage'])} of the recording's time; "
        f"fgbaseline check asks for {MIN_SAMPLE_SIZE} over {per_cent(MIN_COVERAGE)}."
    ]


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
    so = f"; {meaning}" if run.compared else ""
    return [f"The reference, {run.reference}, is {run.trust.verdict.name.lower()}: {reasons}{so}."]


def _coverage(run: Run) -> list[str]:
    tables = {r.name: r.divergence for r in run.answered if r.divergence is not None}
    frames = {name: known(table) for name, table in tables.items()}
    if len(frames) < 2 or same_frames(frames.values()):
        return []
    t = run.problem.sequence.t
    each = listed(f"{name} {per_cent(time_coverage(t[there], t))}" for name, there in frames.items())
    common = {name: run.results[name].divergence_common for name in frames}
    counts = {c.frames for c in common.values() if c is not None}
    apart = [name for name, c in common.items() if c is None]
    text = f"The estimators do not cover the same share of the recording's time: {each}."
    if not counts:
        return [f"{text} They have no frame in common, so they are not ranked."]
    who = "the others have" if apart else "all have"
    ranked = f"{text} They are ranked by their errors over the {number(counts.pop())} frames that {who}"
    return [f"{ranked}; {listed(apart)} {'is' if len(apart) == 1 else 'are'} not ranked." if apart else f"{ranked}."]


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


def _noise(run: Run) -> list[str]:
    problem = run.problem
    if problem.diagnosed:
        return []
    if problem.imu is not None:
        return [
            f"Not diagnosed: {number(float(np.sqrt(problem.pixel_variance)))} px are assumed as noise (one sigma), not "
            "estimated from this recording; the noise of the inertial samples is as given."
        ]
    sigma = np.sqrt(np.median(np.diagonal(problem.increment_covariance, axis1=1, axis2=2), axis=0))
    return [
        f"Not diagnosed: {number(float(np.sqrt(problem.pixel_variance)))} px, {number(float(sigma[:3].max()))} m and "
        f"{number(float(np.rad2deg(sigma[3:].max())))}° per frame are assumed as noise (one sigma), not estimated from "
        "this recording."
    ]
