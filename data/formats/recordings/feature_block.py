"""Feature block (4, N, T) of a recording, -1 where unobserved, converted piece by piece into flat observations.

The dense block is never held: of 4 x 13289 x 3026 doubles (1.29 GB) less than 1 % are observations.

An entry is unobserved if all four rows are exactly -1. Otherwise all four must be finite pixel coordinates other than
exactly -1. If only some rows are -1, a tracker has lost one camera. A true coordinate of -1.0, which lies outside every
image, could not be distinguished from that. Reader and writer reject both cases.

An entry whose four rows are exactly 0 is unobserved as well: no stereo pair measures the outermost corner of both
images with zero disparity. Such entries are counted and reported.

One camera has NaN in the rows uR and vR of every observed entry.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FloatArray, InputError
from fgbaseline.geometry.stereo_camera import PIXEL_COMPONENTS

from ...finding import Finding
from ...observations import IntArray, Observations
from ..files.array_stream import ArrayStream
from .monocular_observations import require_one_kind

MOST_EQUAL = 0.01
"""share of the entries whose four rows may be equal by chance"""
UNOBSERVED = -1.0
FIRST_RIGHT = 2
"""row of the right camera"""
CHUNK = 2**19
"""values read at a time, a multiple of 8: 4 MB of doubles"""


@dataclass(frozen=True, slots=True)
class _Layout:
    """Order of the flat entries of a block: `frames_first` when neighbors are the same landmark in the next frame."""

    key: str
    n_frames: int
    n_landmarks: int
    frames_first: bool

    def place(self, index: IntArray) -> tuple[IntArray, IntArray]:
        """Frames and landmarks of flat entries (n,)."""
        if self.frames_first:
            return index % self.n_frames, index // self.n_frames
        return index // self.n_landmarks, index % self.n_landmarks


def read_features(stream: ArrayStream, n_frames: int) -> tuple[Observations, int, tuple[Finding, ...]]:
    """The observations in a streamed block (4, N, T), N, and what was wrong with the block.

    Raises InputError naming frame and landmark.
    """
    shape = stream.shape
    if len(shape) != 3 or shape[0] != 4 or shape[2] != n_frames:
        raise InputError(
            f"{stream.key}: expected shape (4, N, {n_frames}) for the {n_frames} time stamps, got {shape}; "
            "write uL, vL, uR, vR along the first axis and the frames along the last"
        )
    layout = _Layout(stream.key, n_frames, shape[1], frames_first=not stream.fortran_order)
    observations, findings = _read(stream, layout)
    return observations, shape[1], findings


def read_features_by_frame(stream: ArrayStream, n_frames: int) -> tuple[Observations, int, tuple[Finding, ...]]:
    """Observations of a block (4, T, N), as in `.mat` files; see `read_features`."""
    shape = stream.shape if len(stream.shape) != 2 else (*stream.shape, 1)  # MATLAB drops a last axis of length 1
    if len(shape) != 3 or shape[:2] != (4, n_frames):
        raise InputError(
            f"{stream.key}: expected shape (4, {n_frames}, N) for the {n_frames} time stamps, got {stream.shape}; "
            "save uL, vL, uR, vR along the first axis and the frames along the second"
        )
    observations, findings = _read(stream, _Layout(stream.key, n_frames, shape[2], frames_first=stream.fortran_order))
    return observations, shape[2], findings


def _read(stream: ArrayStream, layout: _Layout) -> tuple[Observations, tuple[Finding, ...]]:
    if layout.n_landmarks == 0:
        return Observations.none(), ()
    index, pixel, zeros = (_entries_together if stream.fortran_order else _entries_by_row)(stream, layout)
    return _observations(index, pixel, layout), _zeros_found(layout.key, zeros, len(index))


def _zeros_found(key: str, zeros: int, observed: int) -> tuple[Finding, ...]:
    if zeros == 0:
        return ()
    text = (
        f"{key}: {zeros:,} of {zeros + observed:,} entries that are not -1 are 0 in all four rows: 0 stands for "
        "unobserved there, and they are read as that."
    )
    return (Finding("zero_for_unobserved", text, zeros, 0, "entries", "counted"),)


def _entries_together(stream: ArrayStream, layout: _Layout) -> tuple[IntArray, FloatArray, int]:
    """Fortran order: the four rows of an entry lie side by side. Also how many entries are all zero."""
    indices, pixels, zeros = [np.empty(0, np.int64)], [np.empty((0, 4))], 0
    for start, n in _pieces(layout.n_frames * layout.n_landmarks, CHUNK // 4):
        values = stream.take(4 * n).reshape(n, 4)
        observed, zero = (values != UNOBSERVED).any(axis=1), (values == 0.0).all(axis=1)
        zeros += int(zero.sum())
        index = np.flatnonzero(observed & ~zero)
        _require_finite(start + index, values[index], layout)
        indices.append(start + index)
        pixels.append(values[index])
    return np.concatenate(indices), np.concatenate(pixels), zeros


def _entries_by_row(stream: ArrayStream, layout: _Layout) -> tuple[IntArray, FloatArray, int]:
    """C order: all entries of uL, then all of vL, and so on; the rows are brought together in the end."""
    rows = [_row(stream, row, layout) for row in range(4)]
    zero = np.stack([zero for _, _, zero in rows])
    everywhere = np.bitwise_and.reduce(zero)
    some = np.flatnonzero(np.unpackbits(np.bitwise_or.reduce(zero) & ~everywhere))
    index = rows[0][0]
    if len(some) or not all(np.array_equal(index, own) for own, _, _ in rows[1:]):
        index = np.unique(np.concatenate([some, *(own for own, _, _ in rows)]))
    pixel = np.full((len(index), 4), UNOBSERVED)
    for row, (own, values, is_zero) in enumerate(rows):
        pixel[(is_zero[index // 8] << (index % 8)) & 0x80 != 0, row] = 0.0
        pixel[np.searchsorted(index, own), row] = values
    return index, pixel, int(np.bitwise_count(everywhere).sum())


def _row(stream: ArrayStream, row: int, layout: _Layout) -> tuple[IntArray, FloatArray, NDArray[np.uint8]]:
    """Entries (n,) that are neither -1 nor 0, their values (n,), and a bit for each entry of the block that is 0."""
    indices, kept, zero = [np.empty(0, np.int64)], [np.empty(0)], [np.empty(0, np.uint8)]
    for start, n in _pieces(layout.n_frames * layout.n_landmarks, CHUNK):
        values = stream.take(n)
        index = np.flatnonzero((values != UNOBSERVED) & (values != 0.0))
        _require_finite(start + index, values[index, None], layout, row)
        indices.append(start + index)
        kept.append(values[index])
        zero.append(np.packbits(values == 0.0))
    return np.concatenate(indices), np.concatenate(kept), np.concatenate(zero)


def _pieces(total: int, size: int) -> Iterator[tuple[int, int]]:
    for start in range(0, total, size):
        yield start, min(size, total - start)


def _require_finite(index: IntArray, values: FloatArray, layout: _Layout, first_row: int = 0) -> None:
    """Refuses NaN and infinity among `values` (n, rows) of the entries `index` (n,); NaN in uR and vR may be right."""
    right = first_row + np.arange(values.shape[1]) >= FIRST_RIGHT
    finite = np.isfinite(values) | (np.isnan(values) & right)
    if finite.all():
        return
    entry, row = (int(i[0]) for i in np.nonzero(~finite))
    frame, landmark = layout.place(index[entry : entry + 1])
    raise InputError(
        f"{layout.key}: {PIXEL_COMPONENTS[first_row + row]} of landmark {landmark[0]} in frame {frame[0]} is "
        f"{values[entry, row]}; write -1 in all four rows where a landmark was not observed"
    )


def _observations(index: IntArray, pixel: FloatArray, layout: _Layout) -> Observations:
    frame, landmark = layout.place(index)
    half_seen = np.flatnonzero((pixel == UNOBSERVED).any(axis=1))
    if len(half_seen):
        i = half_seen[0]
        raise InputError(
            f"{layout.key}: landmark {landmark[i]} in frame {frame[i]} is {pixel[i].tolist()}, -1 in some rows only "
            f"({len(half_seen)} such entries); write -1 in all four rows where it was not observed, or four pixel "
            "coordinates of which none is exactly -1, or NaN in uR and vR of all observations for one camera"
        )
    same = np.flatnonzero((pixel == pixel[:, :1]).all(axis=1))
    if len(same) > max(1, MOST_EQUAL * len(pixel)):
        raise InputError(
            f"{layout.key}: {len(same):,} of {len(pixel):,} entries have the same number in all four rows, such as "
            f"{pixel[same[0], 0]:g}: no pixel coordinates; write -1 in all four rows where a landmark was not observed"
        )
    require_one_kind(layout.key, frame, landmark, pixel)
    return Observations.sort(frame, landmark, pixel)
