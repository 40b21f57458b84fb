"""Observations withheld from diagnosis and estimators, for validation."""

from dataclasses import dataclass

import numpy as np

from .display import Displayed
from .observations import IntArray, Observations

MIN_PIECE = 6
"""observations of a piece of a track: three on each half"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class HeldOut(Displayed):
    """n observations of tracks removed from a sequence for validation."""

    observations: Observations
    """held-out observations as recorded, with the landmark numbers of the recording"""
    piece: IntArray
    """(n,) piece of a track of each observation, 0 to n_pieces - 1: consecutive observations of one point by odometry
    alone; -1 for copies, jumps and pieces shorter than `MIN_PIECE`"""
    n_pieces: int
    share: float
    seed: int

    @property
    def n_tracks(self) -> int:
        """The number of held-out tracks."""
        return len(np.unique(self.observations.landmark))
