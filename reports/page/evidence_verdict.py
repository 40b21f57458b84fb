"""What held-out tracks and covariances of a run mean, in words."""

import numpy as np

from fgbaseline.compare import CovarianceState
from fgbaseline.reports.comparison import Run
from fgbaseline.reports.evidence import frames_in_words

from .numbers import listed, number

MOST_FRAMES = 80
"""letters of a list of frames, from which on only the first are told"""


def held_out_sentences(run: Run) -> list[str]:
    """Which path predicts held-out tracks best, and who cannot be told from it."""
    if run.held_out is None:
        return []
    ranking, held = run.held_out.ranking, run.held_out.held
    if len(ranking) == 0 or run.held_out.errors is None:
        return [f"{number(held.n_tracks)} tracks were held out, but none of them is left to judge a path by."]
    names = [str(name) for name in ranking.index]
    medians = dict(zip(names, ranking["median"].tolist(), strict=True))
    sentence = (
        f"On {number(run.held_out.errors.inliers)} pieces of held-out tracks, which no estimator saw, where all have "
        f"poses ({number(run.held_out.errors.pieces)} of {number(held.n_pieces)} pieces), {names[0]} errs "
        f"by {number(medians[names[0]])} px in the median"
    )
    if len(names) > 1:
        sentence += ", then " + listed(f"{name} by {number(medians[name])} px" for name in names[1:])
    low = dict(zip(names, ranking["behind_low"].tolist(), strict=True))
    same = [name for name in names[1:] if low[name] <= 0.0]
    if same:
        sentence += f"; {listed(same)} cannot be told from {names[0]}"
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
                f"{result.name} gives {number(len(bad))} pose covariances that are not positive definite (frames "
                f"{where}); what is said of its consistency leaves them out."
            )
    return sentences
