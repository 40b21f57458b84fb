"""Tracks of a recording in a temporary file: memory does not grow with the observations."""

import tempfile
import weakref
from collections.abc import Iterator
from contextlib import suppress
from typing import IO

import numpy as np

from fgbaseline.geometry import InputError

from ..observations import Observations
from .stereo_tracker import Tracks

POINT = np.dtype([("number", "<i4"), ("pixel", "<f4", (4,))])
"""Track and pixel of an observation; single precision is what OpenCV gives."""
FRAMES = 256
"""frames that are read at a time"""


class TrackFile:
    """Tracked points, appended frame by frame; tracks with one observation are left out of what is read back.

    The file has no name and disappears with the object. It lies where `tempfile` puts it (`TMPDIR`), and takes 20 bytes
    an observation. In memory are the number of points of each frame and that of each track.
    """

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 (open as long as this object)
        weakref.finalize(self, _close, self._file)
        self._points: list[int] = []
        self._seen = np.zeros(1024, dtype=np.int32)

    def append(self, tracks: Tracks) -> None:
        """Appends the points of the next frame. Raises InputError where the file cannot be written."""
        points = np.empty(len(tracks.number), POINT)
        points["number"], points["pixel"] = tracks.number, tracks.pixel
        try:
            self._file.write(points.tobytes())
            self._file.flush()
        except OSError as error:
            raise InputError(
                f"{tempfile.gettempdir()}: the tracks cannot be kept there ({error.strerror}); set TMPDIR to a folder "
                "with room"
            ) from error
        self._points.append(len(points))
        while len(points) and points["number"].max() >= len(self._seen):
            self._seen = np.concatenate([self._seen, np.zeros_like(self._seen)])
        self._seen[points["number"]] += 1  # a track is at most once in a frame

    @property
    def n_landmarks(self) -> int:
        """Number of tracks with two or more observations."""
        return int(np.count_nonzero(self._seen > 1))

    def __len__(self) -> int:
        return int(self._seen[self._seen > 1].sum(dtype=np.int64))

    def pieces(self) -> Iterator[Observations]:
        """Observations of some frames after the other."""
        is_track = self._seen > 1  # a feature observed once does not constrain the motion
        landmark_of = np.cumsum(is_track, dtype=np.int64) - 1
        offset = 0
        for first in range(0, len(self._points), FRAMES):
            counts = self._points[first : first + FRAMES]
            self._file.seek(offset)
            points = np.frombuffer(self._file.read(sum(counts) * POINT.itemsize), POINT)
            offset = self._file.tell()
            frame = np.repeat(np.arange(first, first + len(counts)), counts)
            chosen = is_track[points["number"]]
            yield Observations(
                frame[chosen], landmark_of[points["number"][chosen]], points["pixel"][chosen].astype(np.float64)
            )

    def observations(self) -> Observations:
        """All observations, in memory."""
        n, done = len(self), 0
        frame, landmark, pixel = np.empty(n, np.int64), np.empty(n, np.int64), np.empty((n, 4))
        for piece in self.pieces():
            part = slice(done, done := done + len(piece))
            frame[part], landmark[part], pixel[part] = piece.frame, piece.landmark, piece.pixel
        return Observations(frame, landmark, pixel)


def _close(file: IO[bytes]) -> None:
    with suppress(OSError):  # a full disk has been reported
        file.close()
