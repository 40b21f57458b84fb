"""Onset of divergence: first frame beyond a threshold from the reference, and the share of wrong matches around it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fgbaseline.data import Excluded, Problem
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.problem import WRONG_MATCH

if TYPE_CHECKING:
    from .estimate_comparison import Result, Run

FAR = 5.0
"""m, upper bound of the threshold"""
FAR_SHARE = 0.01
"""threshold as a share of the length of the reference path, up to `FAR`"""
AROUND = 1.0
"""s, half width of the interval around the onset in which wrong matches are counted"""


@dataclass(frozen=True, slots=True)
class DivergenceOnset:
    """First frame beyond the divergence threshold."""

    frame: int
    seconds: float
    """s from the first frame"""
    beyond: float
    """share of the frames beyond the threshold, of those from `frame` on that have a pose"""
    wrong: float | None
    """`wrong_share` in the frames within `AROUND` of the onset"""


def divergence_threshold(result: "Result") -> float:
    """Divergence threshold, m: 1 % of the length of the reference path, at most 5 m; 5 m without a path."""
    return min(FAR, FAR_SHARE * reference_path_length(result)) or FAR


def reference_path_length(result: "Result") -> float:
    """Length of the reference's path, m."""
    return 0.0 if result.divergence is None else float(np.nanmax(result.divergence["traveled"].to_numpy()))


def divergence_onset(run: "Run", result: "Result") -> DivergenceOnset | None:
    """Onset of the divergence of `result`; None if it stays within the threshold."""
    if result.divergence is None:
        return None
    position = result.divergence["position"].to_numpy(dtype=np.float64)
    beyond = position > divergence_threshold(result)
    if not beyond.any():
        return None
    k = int(np.argmax(beyond))
    t = run.problem.sequence.t
    near = np.abs(t - t[k]) <= AROUND
    share = float(beyond[k:][~np.isnan(position[k:])].mean())
    return DivergenceOnset(k, float(t[k] - t[0]), share, wrong_share(run.problem, near))


class MaskShare(NamedTuple):
    """Number of observations of the chosen features, and of those that the mask excluded for any reason."""

    observations: int
    excluded: int


def mask_share(problem: Problem) -> MaskShare:
    """Counts of the mask over the observations of the chosen features."""
    chosen = problem.of_chosen_features
    return MaskShare(int(chosen.sum()), int((chosen & (problem.excluded != Excluded.NO)).sum()))


def wrong_share(problem: Problem, frames: BoolArray) -> float | None:
    """Share of the observations that the mask excluded as `WRONG_MATCH` in frames (T,); None where it excluded none.

    The share is of the observations of the chosen features, as all shares of this module.
    """
    wrong = _suspected(problem)
    there = frames[problem.sequence.observations.frame] & problem.of_chosen_features
    return float(wrong[there].mean()) if wrong.any() and there.any() else None


class WorstSecond(NamedTuple):
    """One second of the recording, with its share of observations excluded as `WRONG_MATCH`."""

    second: float
    """s from the first frame"""
    share: float


def worst_second(problem: Problem) -> WorstSecond | None:
    """Second with the largest share of wrong matches (the first of equals); None where the mask excluded none.

    Only seconds that contain a frame are visited, because stamps in wrong units may span billions of seconds.
    """
    wrong = _suspected(problem)
    if not wrong.any():
        return None
    t, frame = problem.sequence.t, problem.sequence.observations.frame
    seconds, place = np.unique(np.floor(t - t[0]), return_inverse=True)
    every = np.bincount(place[frame[problem.of_chosen_features]], minlength=len(seconds))
    share = np.bincount(place[frame[wrong]], minlength=len(seconds)) / np.maximum(every, 1)
    worst = int(np.argmax(share))
    return WorstSecond(float(seconds[worst]), float(share[worst]))


def _suspected(problem: Problem) -> BoolArray:
    """Mask (n,) of the observations of chosen features that are excluded as `WRONG_MATCH`."""
    return np.isin(problem.excluded, WRONG_MATCH) & problem.of_chosen_features
