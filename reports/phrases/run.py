"""Conclusions of a run in sentences: what everything else rests on first, each with its number or reason."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from fgbaseline.compare import (
    CovarianceState,
    Verdict,
    divergence_summary,
    held_out_ranking,
    reprojection_summary,
)
from fgbaseline.compare.estimate_comparison import Run, frames_in_words, known, same_frames, share_of_time
from fgbaseline.data import Status
from fgbaseline.reports.formatting import counted, listed, number, per_cent
from fgbaseline.reports.phrases.run_accuracy import (
    AROUND,
    by_products,
    compared,
    departure,
    far,
    little_truth_sentences,
    nearest_sentences,
    same_graph,
    truth_sentences,
    worst_second,
    wrong_share,
)

DEGREES_OF_FREEDOM = 6
"""of a pose"""


def coverage_sentences(run: Run) -> list[str]:
    """What each estimator covers, where not all cover the same, and which frames rank them."""
    tables = {r.name: r.divergence for r in run.answered if r.divergence is not None}
    frames = {name: known(table) for name, table in tables.items()}
    if len(frames) < 2 or same_frames(frames.values()):
        return []
    t = run.problem.sequence.t
    each = listed(f"{name} {per_cent(share_of_time(t, there))}" for name, there in frames.items())
    common = {name: run.results[name].divergence_common for name in frames}
    counts = {c.frames for c in common.values() if c is not None}
    apart = [name for name, c in common.items() if c is None]
    text = f"The estimators do not cover the same share of the recording's time: {each}."
    if not counts:
        return [f"{text} They have no frame in common, so they are not ranked."]
    who = "the others have" if apart else "all have"
    ranked = f"{text} They are ranked by their errors over the {number(counts.pop())} frames that {who}"
    return [f"{ranked}; {listed(apart)} {'is' if len(apart) == 1 else 'are'} not ranked." if apart else f"{ranked}."]


MOST_FRAMES = 80
"""letters of a list of frames, from which on only the first are told"""


def held_out_sentences(run: Run) -> list[str]:
    """Which path predicts held-out tracks best, and which ones its interval does not separate from it.

    Other minima of the reference's graph are no competitors of it and left out.
    """
    if run.held_out is None:
        return []
    ranking, held, errors = run.held_out.ranking, run.held_out.held, run.held_out.errors
    if errors is not None and (left_out := list(same_graph(run) & set(ranking.index))):
        ranking = held_out_ranking(replace(errors, error=errors.error.drop(columns=left_out)))
    if len(ranking) == 0 or errors is None:
        return [f"{counted(held.n_tracks, 'track was', 'tracks were')} held out; none is left to judge by."]
    names = [str(name) for name in ranking.index]
    medians = dict(zip(names, ranking["median"].tolist(), strict=True))
    sentence = (
        f"On {counted(errors.inliers, 'piece')} of held-out tracks, which no estimator saw, where all have "
        f"poses ({number(errors.pieces)} of {counted(held.n_pieces, 'piece')}), {names[0]} errs "
        f"by {number(medians[names[0]])} px in the median"
    )
    if len(names) > 1:
        sentence += ", " + listed(f"{name} by {number(medians[name])} px" for name in names[1:])
    low = dict(zip(names, ranking["behind_low"].tolist(), strict=True))
    best = number(medians[names[0]])
    same = [name for name in names[1:] if not low[name] > 0.0 or number(medians[name]) == best]
    if same:
        sentence += f"; the bootstrap does not separate {listed(same)} from {names[0]}"
    return [sentence + ". That judges motion over a second or two as these cameras see it, not drift."]


def covariance_sentences(run: Run) -> list[str]:
    """Who gives covariances that are none, and where."""
    sentences = []
    for result in run.answered:
        bad = np.flatnonzero(result.evidence.covariance == CovarianceState.NOT_POSITIVE_DEFINITE)
        if len(bad):
            where = frames_in_words(bad)
            if len(where) > MOST_FRAMES:
                where = f"first {bad[0]}, last {bad[-1]}"
            sentences.append(
                f"{result.name} gives {counted(len(bad), 'pose covariance that is', 'pose covariances that are')} not "
                f"positive definite ({'frame' if len(bad) == 1 else 'frames'} "
                f"{where}); what is said of its consistency leaves them out."
            )
    return sentences


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
