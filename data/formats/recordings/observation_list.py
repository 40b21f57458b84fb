"""Observations in an npz as a list, in place of the dense block `features`.

| key | shape |
|---|---|
| `observation_frame`, `observation_landmark` | (n,) whole numbers from 0 |
| `observation_pixel` | (4, n) px, rows uL, vL, uR, vR; NaN in uR and vR for one camera |
"""

import zipfile
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from fgbaseline.geometry import FgbaselineError, InputError

from ...observations import IntArray, Observations
from ..files.npz_archive import NpzArchive
from ..files.npz_member import write_member
from .monocular_observations import require_one_kind

FRAME, LANDMARK, PIXEL = "observation_frame", "observation_landmark", "observation_pixel"
LARGEST_INDEX = 2**40


class ObservationPieces(Protocol):
    """n observations in consecutive pieces, which need not be in memory together."""

    def __len__(self) -> int: ...

    def pieces(self) -> Iterator[Observations]:
        """The pieces, in order."""
        ...


def write_observations(archive: zipfile.ZipFile, observations: ObservationPieces) -> None:
    """Writes observations as a list, a piece at a time."""
    n = len(observations)
    write_member(archive, FRAME, (n,), (o.frame for o in observations.pieces()))
    write_member(archive, LANDMARK, (n,), (o.landmark for o in observations.pieces()))
    write_member(archive, PIXEL, (4, n), (o.pixel[:, row] for row in range(4) for o in observations.pieces()))


def read_observation_list(archive: NpzArchive, T: int) -> tuple[Observations, int]:
    """Observations over T frames, and the number of landmarks. Raises InputError naming the key."""
    if "features" in archive.keys:
        raise InputError(f"features and {FRAME} are both in the file; keep one of them")
    frame, landmark = (_indices(archive, key) for key in (FRAME, LANDMARK))
    pixel = archive.array(PIXEL)
    n = len(frame)
    if landmark.shape != (n,) or pixel.shape != (4, n):
        raise InputError(
            f"{PIXEL}: expected shape (4, {n}) and {LANDMARK} of shape ({n},), got {pixel.shape} and {landmark.shape}"
        )
    if n and frame.max() >= T:
        raise InputError(f"{FRAME}: frame {int(frame.max())} is named, but there are {T} time stamps")
    require_one_kind(PIXEL, frame, landmark, pixel.T)
    try:
        observations = Observations.sort(frame, landmark, pixel.T)
    except FgbaselineError:  # shapes and values are right: what is left is a repeat
        raise InputError(f"{FRAME}: a landmark is observed twice in one frame; keep one of the observations") from None
    return observations, int(landmark.max()) + 1 if n else 0


def _indices(archive: NpzArchive, key: str) -> IntArray:
    values = archive.array(key)
    if values.ndim != 1 or not ((values >= 0) & (values < LARGEST_INDEX) & (values == np.floor(values))).all():
        raise InputError(f"{key}: expected one row of whole numbers from 0, got shape {values.shape}")
    return values.astype(np.int64)
