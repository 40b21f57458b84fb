"""`write_npz`: a recording in our own npz (keys: `npz_reader`), the same bytes for the same recording."""

import zipfile
from collections.abc import Iterator

import numpy as np

from fgbaseline.geometry import Camera, FloatArray, InputError, StereoCamera

from ...observations import IntArray
from ...sequence import Sequence
from ..files.atomic_write import atomic_write
from ..files.file_errors import FilePath
from ..files.npz_member import write_member
from ..inertial.imu_arrays import imu_arrays, state_truth_arrays
from .feature_block import CHUNK, UNOBSERVED
from .observation_list import ObservationPieces, write_observations


def write_npz(
    sequence: Sequence, path: FilePath, *, tracks: ObservationPieces | None = None, force: bool = True
) -> None:
    """Writes a recording with its truth, all or nothing; `read` gives every array back bit by bit.

    The dense feature block is made and compressed a few landmarks at a time. `tracks`, the observations in pieces, are
    written as a list in its place, for recordings of many short tracks. Raises InputError when the file cannot be
    written, exists and `force` is false, or a pixel coordinate is exactly -1, which in the block means 'not observed'.
    """
    if tracks is None and (sequence.observations.pixel == UNOBSERVED).any():
        raise InputError("features: a pixel coordinate is exactly -1, which in an npz means that it was not observed")
    with atomic_write(path, force=force) as file, zipfile.ZipFile(file, "w") as archive:
        _write(archive, _arrays(sequence))
        if tracks is not None:
            write_observations(archive, tracks)
        elif sequence.n_landmarks:
            shape = (4, sequence.n_landmarks, sequence.n_frames)
            write_member(archive, "features", shape, _feature_chunks(sequence))


def write_tracks(
    path: FilePath,
    t: FloatArray,
    camera: Camera,
    tracks: ObservationPieces,
    imu_T_cam: FloatArray | None,
    *,
    force: bool = True,
) -> None:
    """Writes tracks of frames t (T,), s, without motion: `read` needs it, and `imu_T_cam` (4, 4), from elsewhere.

    Raises InputError when the file cannot be written, or exists and `force` is false.
    """
    arrays = {"time_stamps": t[None, :], **_calibration(camera)}
    if imu_T_cam is not None:
        arrays["imu_T_cam"] = imu_T_cam
    with atomic_write(path, force=force) as file, zipfile.ZipFile(file, "w") as archive:
        _write(archive, arrays)
        write_observations(archive, tracks)


def _write(archive: zipfile.ZipFile, arrays: dict[str, FloatArray]) -> None:
    for key, array in arrays.items():
        write_member(archive, key, array.shape, [array])


def _calibration(camera: Camera) -> dict[str, FloatArray]:
    b = {"b": np.array(camera.baseline)} if isinstance(camera, StereoCamera) else {}
    return {"K": camera.K, **b}


def _arrays(s: Sequence) -> dict[str, FloatArray]:
    arrays = {
        "time_stamps": s.t[None, :],
        **_measured(s),
        **_calibration(s.camera),
        "imu_T_cam": s.imu_T_cam,
        "up_imu": s.up if s.up_imu is None else s.up_imu,
    }
    if s.truth is not None:
        arrays["ground_truth"] = s.truth.world_T_imu
        if s.truth.landmarks is not None:
            arrays["landmarks"] = s.truth.landmarks.T
        arrays |= state_truth_arrays(s.truth)
    return arrays


def _measured(s: Sequence) -> dict[str, FloatArray]:
    if s.imu is not None:
        return imu_arrays(s.imu)
    return {"linear_velocity": s.linear_velocity.T, "angular_velocity": s.angular_velocity.T}


def _feature_chunks(s: Sequence) -> Iterator[FloatArray]:
    """The block (4, N, T) row by row and, within a row, a few landmarks at a time: pieces (n, T)."""
    order = s.observations.by_track()
    frame, landmark, pixel = (a[order] for a in (s.observations.frame, s.observations.landmark, s.observations.pixel))
    n = max(1, CHUNK // s.n_frames)
    starts = np.arange(0, s.n_landmarks, n)
    bounds: IntArray = np.searchsorted(landmark, [*starts, s.n_landmarks]).astype(np.int64)
    for row in range(4):
        for start, begin, end in zip(starts.tolist(), bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
            chunk = np.full((min(n, s.n_landmarks - start), s.n_frames), UNOBSERVED)
            chunk[landmark[begin:end] - start, frame[begin:end]] = pixel[begin:end, row]
            yield chunk
