"""Stereo observations as flat arrays sorted by frame: never the dense 4 x N x T block."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FgbaselineError, FloatArray

from .display import Displayed
from .frames import table

if TYPE_CHECKING:
    import pandas as pd

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
PIECE = 2**16
"""observations in a piece"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Observations(Displayed):
    """n stereo observations, sorted by frame and within a frame by landmark; the arrays are read-only."""

    frame: IntArray
    """(n,) index of the frame"""
    landmark: IntArray
    """(n,) index of the landmark: the column of the recorded feature block"""
    pixel: FloatArray
    """(n, 4) uL, vL, uR, vR in pixels"""

    def __post_init__(self) -> None:
        n = len(self.frame)
        if self.landmark.shape != (n,) or self.pixel.shape != (n, 4):
            raise FgbaselineError(
                f"observations need (n,), (n,) and (n, 4) arrays, not {self.frame.shape}, "
                f"{self.landmark.shape} and {self.pixel.shape}"
            )
        step = np.diff(self.frame)
        if np.any((step < 0) | ((step == 0) & (np.diff(self.landmark) <= 0))):
            raise FgbaselineError("observations must be sorted by frame, then landmark, without repeats")
        for array in (self.frame, self.landmark, self.pixel):
            array.flags.writeable = False

    def __reduce__(
        self,
    ) -> tuple[type, tuple[object, ...]]:  # pickle calls the constructor, which makes the arrays read-only
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    def __len__(self) -> int:
        return len(self.frame)

    @staticmethod
    def sort(frame: IntArray, landmark: IntArray, pixel: FloatArray) -> "Observations":
        """Observations sorted by frame and landmark, from arrays in any order."""
        order = np.lexsort((landmark, frame))
        return Observations(
            np.asarray(frame, dtype=np.int64)[order],
            np.asarray(landmark, dtype=np.int64)[order],
            np.ascontiguousarray(np.asarray(pixel, dtype=np.float64)[order]),
        )

    @staticmethod
    def none() -> "Observations":
        """Empty set of observations."""
        return Observations(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 4)))

    def to_frame(self) -> "pd.DataFrame":
        """Table with the columns frame, landmark, uL, vL, uR, vR (px), a row for each observation."""
        pixels = dict(zip(("uL", "vL", "uR", "vR"), self.pixel.T, strict=True))
        return table({"frame": self.frame, "landmark": self.landmark, **pixels}, "observation")

    def select(self, chosen: BoolArray | IntArray) -> "Observations":
        """Observations where `chosen` (n,) is true, or with the increasing indices `chosen`."""
        return Observations(self.frame[chosen], self.landmark[chosen], self.pixel[chosen])

    def pieces(self) -> Iterator["Observations"]:
        """Observations a few at a time, in order."""
        for first in range(0, len(self), PIECE):
            yield self.select(np.arange(first, min(first + PIECE, len(self))))

    def of_frames(self, first: int, last: int) -> "Observations":
        """Observations of the frames first to last, both included."""
        start, stop = np.searchsorted(self.frame, [first, last + 1])
        return Observations(self.frame[start:stop], self.landmark[start:stop], self.pixel[start:stop])

    def frame_starts(self, n_frames: int) -> IntArray:
        """Index ranges (n_frames + 1,): the observations of frame k are `[k]` up to `[k + 1]`."""
        return np.searchsorted(self.frame, np.arange(n_frames + 1)).astype(np.int64)

    def by_frame(self, n_frames: int) -> Iterator[slice]:
        """One slice into the arrays for each frame."""
        starts = self.frame_starts(n_frames)
        for k in range(n_frames):
            yield slice(int(starts[k]), int(starts[k + 1]))

    def ties(self, n_frames: int) -> IntArray:
        """Number (n_frames - 1,) of landmarks observed both up to frame k and from frame k + 1 on."""
        change = np.zeros(n_frames + 1, dtype=np.int64)
        if len(self) > 0:
            order = self.by_track()
            ends = np.flatnonzero(np.diff(self.landmark[order])) + 1
            np.add.at(change, self.frame[order[np.append(0, ends)]], 1)
            np.add.at(change, self.frame[order[np.append(ends, len(order)) - 1]], -1)
        return np.cumsum(change)[: n_frames - 1]

    def counts(self, n_landmarks: int) -> IntArray:
        """Number (n_landmarks,) of observations of each landmark."""
        return np.bincount(self.landmark, minlength=n_landmarks).astype(np.int64)

    def by_track(self) -> IntArray:
        """Indices (n,) that sort the observations by landmark, then frame."""
        return np.lexsort((self.frame, self.landmark)).astype(np.int64)
