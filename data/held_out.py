"""Observations kept from diagnosis and estimators, by which paths are validated."""

from dataclasses import dataclass

import numpy as np

from .observations import IntArray, Observations

MIN_PIECE = 6
"""observations of a piece of a track: three on each half"""


@dataclass(frozen=True, eq=False, slots=True)
class HeldOut:
    """n observations of tracks that were taken out of a sequence."""

    observations: Observations
    """as recorded, with the recording's landmark numbers"""
    piece: IntArray
    """(n,) the piece of a track that each belongs to, 0 to n_pieces - 1: consecutive sights of one point, as far as the
    cameras alone can tell; -1 for those that are copies, jump, or are left in pieces shorter than `MIN_PIECE`"""
    n_pieces: int
    share: float
    seed: int

    @property
    def n_tracks(self) -> int:
        """How many tracks were taken out."""
        return len(np.unique(self.observations.landmark))
