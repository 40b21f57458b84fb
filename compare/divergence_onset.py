"""Onset of divergence: the first frame at which an estimate leaves the reference, and the share of wrong matches
there."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fgbaseline.data import Problem
from fgbaseline.data.problem import WRONG_MATCH
from fgbaseline.geometry import FloatArray

if TYPE_CHECKING:
    from .estimate_comparison import Result, Run

FAR = 5.0
"""m, largest threshold"""
FAR_SHARE = 0.01
"""largest threshold, as a share of the reference path"""
AROUND = 1.0
"""s before and after the onset"""


@dataclass(frozen=True, slots=True)
class DivergenceOnset:
    """First frame beyond the divergence threshold."""

    frame: int
    seconds: float
    beyond: float
    """share of the later frames with a pose that are beyond the threshold"""
    wrong: float | None
    """share of the matches within `AROUND` that the mask excluded as wrong; None without a mask"""


def divergence_threshold(result: "Result") -> float:
    """Position difference (m) at which an estimate has left the reference: 5 m, or 1 % of the path if less."""
    return min(FAR, FAR_SHARE * path_length(result)) or FAR


def path_length(result: "Result") -> float:
    """Length of the reference's path, m."""
    return 0.0 if result.divergence is None else float(np.nanmax(result.divergence["travelled"].to_numpy()))


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


def wrong_share(problem: Problem, frames: FloatArray | np.ndarray) -> float | None:
    """Share of wrong matches, as excluded by the mask, in the chosen frames (T,); None without mask or match."""
    wrong = np.isin(problem.excluded, WRONG_MATCH)
    there = frames[problem.sequence.observations.frame]
    return float(wrong[there].mean()) if wrong.any() and there.any() else None


class WrongSecond(NamedTuple):
    """One second of the recording, with its share of wrong matches."""

    second: float
    """s from the first frame"""
    share: float
    """share of its matches that the mask excluded as wrong"""


def worst_second(problem: Problem) -> WrongSecond | None:
    """Second with the largest share of wrong matches (the first of equals); None without a mask or a match.

    Only seconds that contain a frame are visited, because stamps in wrong units may span billions of seconds.
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
