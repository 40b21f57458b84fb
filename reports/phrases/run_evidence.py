"""Sentences on evidence beside the accuracy: departures from the reference, mask, consistency, held-out tracks."""

from dataclasses import replace

import numpy as np

from fgbaseline.compare import CovarianceState, divergence_summary, held_out_ranking
from fgbaseline.compare.divergence_onset import (
    AROUND,
    divergence_onset,
    divergence_threshold,
    worst_second,
    wrong_share,
)
from fgbaseline.compare.estimate_comparison import Run, known
from fgbaseline.reports.formatting import counted, listed, number, per_cent
from fgbaseline.reports.results.evidence import frame_ranges

DEGREES_OF_FREEDOM = 6
"""of a pose"""
LONGEST_LIST = 80
"""letters of a list of frames, from which on only the first and the last are named"""


def departure_sentences(run: Run) -> list[str]:
    """When each estimator first leaves the reference, and how many matches were wrong just then."""
    sentences = []
    overall = wrong_share(run.problem, np.ones(run.problem.n_frames, dtype=np.bool_))
    for result in run.compared:
        if result.divergence is None or result.name in run.by_products or not known(result.divergence).any():
            continue
        limit, left = f"{divergence_threshold(result):.3g} m", divergence_onset(run, result)
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


def mask_sentences(run: Run) -> list[str]:
    """Share of the matches that the mask excluded as wrong, and the worst second."""
    overall = wrong_share(run.problem, np.ones(run.problem.n_frames, dtype=np.bool_))
    worst = worst_second(run.problem)
    if overall is None or worst is None:
        return []
    return [
        f"The mask excluded {per_cent(overall)} of the matches for contradicting their own tracks as the velocities "
        f"carry them along, most in the second from {worst.second:.0f} s on: {per_cent(worst.share)}."
    ]


def consistency_sentences(run: Run) -> list[str]:
    """Root of the mean NEES over its degrees of freedom, the most consistent estimator first."""
    known = {r.name: r.nees[~np.isnan(r.nees)] for r in run.answered if r.nees is not None}
    mean = {name: float(nees.mean()) for name, nees in known.items() if len(nees)}
    if not mean:
        return []
    each = (
        f"{number(np.sqrt(value / DEGREES_OF_FREEDOM))} for {name} (NEES {number(value)})"
        for name, value in sorted(mean.items(), key=lambda item: abs(np.log(max(item[1], 1e-300) / DEGREES_OF_FREEDOM)))
    )
    return [f"Normalized error RMS, the root of the mean NEES / {DEGREES_OF_FREEDOM} (expected 1): {listed(each)}."]


def covariance_sentences(run: Run) -> list[str]:
    """Estimators with covariances that are not positive definite, and in which frames."""
    sentences = []
    for result in run.answered:
        bad = np.flatnonzero(result.evidence.covariance == CovarianceState.NOT_POSITIVE_DEFINITE)
        if len(bad):
            where = frame_ranges(bad)
            if len(where) > LONGEST_LIST:
                where = f"first {bad[0]}, last {bad[-1]}"
            sentences.append(
                f"{result.name} gives {counted(len(bad), 'pose covariance that is', 'pose covariances that are')} not "
                f"positive definite ({'frame' if len(bad) == 1 else 'frames'} "
                f"{where}); what is said of its consistency leaves them out."
            )
    return sentences


def held_out_sentences(run: Run) -> list[str]:
    """Path that predicts held-out tracks best, and those that its interval does not separate from it.

    Other minima of the reference's graph are left out: they are no competitors of it.
    """
    if run.held_out is None:
        return []
    ranking, held, errors = run.held_out.ranking, run.held_out.held, run.held_out.errors
    if errors is not None and (left_out := list(run.same_graph & set(ranking.index))):
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
