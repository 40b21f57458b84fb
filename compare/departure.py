"""When an estimator first leaves the reference, and what the matches were like just then."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fgbaseline.data import Problem
from fgbaseline.data.problem import WRONG_MATCH
from fgbaseline.geometry import FloatArray

from .estimate_comparison import Result, Run

FAR = 5.0
"""m, at most"""
FAR_SHARE = 0.01
"""of the reference's path, at most"""
AROUND = 1.0
"""s before and after"""


@dataclass(frozen=True, slots=True)
class Departure:
    """The first frame farther from the reference than a distance."""

    frame: int
    seconds: float
    beyond: float
    """share of the frames with a pose from then on that are farther than that"""
    wrong: float | None
    """share of the matches within `AROUND` that the mask excluded as contradicting their tracks; None without a mask"""


def far(result: Result) -> float:
    """From how many metres on an estimator has left the reference: 5 m, or 1 % of the path where that is less."""
    return min(FAR, FAR_SHARE * path_length(result)) or FAR


def path_length(result: Result) -> float:
    """Length of the reference's path, m."""
    return 0.0 if result.divergence is None else float(np.nanmax(result.divergence["travelled"].to_numpy()))


def departure(run: Run, result: Result) -> Departure | None:
    """When `result` leaves the reference; None where it never does."""
    if result.divergence is None:
        return None
    position = result.divergence["position"].to_numpy(dtype=np.float64)
    beyond = position > far(result)
    if not beyond.any():
        return None
    k = int(np.argmax(beyond))
    t = run.problem.sequence.t
    near = np.abs(t - t[k]) <= AROUND
    share = float(beyond[k:][~np.isnan(position[k:])].mean())
    return Departure(k, float(t[k] - t[0]), share, wrong_share(run.problem, near))


def wrong_share(problem: Problem, frames: FloatArray | np.ndarray) -> float | None:
    """Share of the matches of the chosen frames (T,) that the mask excluded as wrong; None without mask or match."""
    wrong = np.isin(problem.excluded, WRONG_MATCH)
    there = frames[problem.sequence.observations.frame]
    return float(wrong[there].mean()) if wrong.any() and there.any() else None


class WrongSecond(NamedTuple):
    """A whole second of the recording."""

    second: float
    """counted from the first frame"""
    share: float
    """of its matches that the mask excluded as wrong"""


def worst_second(problem: Problem) -> WrongSecond | None:
    """The (first) second with the largest share of wrong matches; None without a mask or a match.

    Only seconds that have a frame are looked at: a span in nanoseconds has a billion others between two of them.
    """
    wrong = np.isin(problem.excluded, WRONG_MATCH)
    if not wrong.any():
        return None
    t, frame = problem.sequence.t, problem.sequence.observations.frame
    seconds, place = np.unique(np.floor(t - t[0]), return_inverse=True)
    every = np.bincount(place[frame], minlength=len(seconds))
    share = np.bincount(place[frame[wrong]], minlength=len(seconds)) / np.maximum(every, 1)
    worst = int(np.argmax(share))
    return WrongSecond(float(seconds[worst]), float(share[worst]))
