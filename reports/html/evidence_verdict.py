"""What held-out tracks and covariances of a run mean, in words."""

from dataclasses import replace

import numpy as np

from fgbaseline.compare import CovarianceState, held_out_ranking
from fgbaseline.reports.comparison import Run
from fgbaseline.reports.evidence import frames_in_words

from ..formatting import counted, listed, number
from .accuracy_verdict import same_graph

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
