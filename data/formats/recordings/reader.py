"""Reader of recordings in all known forms, detected from the content and never from the file name."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...sequence import Sequence, require_scale
from ...time_unit import TimeUnit, in_seconds
from ..files.file_errors import FilePath, reading, regular_file, shown
from ..files.mat_file import MatFile
from ..files.npz_archive import NpzArchive
from ..inertial.imu_attachment import attach_imu, read_imu
from ..inertial.imu_yaml import NO_CALIBRATION, calibration_or_assumed
from ..inertial.velocity_csv import read_velocity_csv
from ..trajectories.kitti import read_extrinsic
from .ground_truth import BodyFrame, attach_truth
from .npz_reader import NO_VELOCITIES, read_course
from .utias import read_utias

ZIP = (b"PK\x03\x04", b"PK\x05\x06")
HDF5 = b"\x89HDF\r\n\x1a\n"
MATLAB_HEADER = 128
"""bytes: the text of a MATLAB 5 file, its version and the two letters of its byte order"""


def read(
    path: FilePath,
    truth: FilePath | None = None,
    truth_frame: BodyFrame | None = None,
    time_unit: TimeUnit | None = None,
    imu: FilePath | None = None,
    imu_calibration: FilePath | None = None,
    velocities: FilePath | None = None,
    extrinsic: FilePath | None = None,
) -> Sequence:
    """The recording in the file `path`: a course file, one of our own, or a UTIAS `.mat`.

    `time_unit` is that of its stamps; without it they are in seconds, unless they show another unit (`time_unit.py`).

    `imu` is a CSV of raw inertial samples, `imu_calibration` the YAML of their noise: they replace the velocities, as
    does a CSV of other `velocities`. `extrinsic` is a file with imu_T_cam in one line of 12 numbers.

    `truth` is a KITTI or TUM file with the poses of `truth_frame`, "camera" or "imu" (see `attach_truth`); without it
    the truth is what the recording itself has. Raises InputError, naming file, field and value, for anything else.
    """
    with reading(path), np.errstate(all="ignore"):  # absurd numbers are judged, not computed with
        given = None if extrinsic is None else read_extrinsic(extrinsic)
        moves = imu is not None or velocities is not None
        sequence = in_seconds(_read(regular_file(path), os.fspath(path), given, moves=moves), time_unit)
    if imu is not None and velocities is not None:
        raise InputError("imu: a recording has raw inertial samples or velocities; leave out --imu or --velocities")
    if velocities is not None:
        linear, angular = read_velocity_csv(velocities, sequence.t)
        sequence = replace(sequence, linear_velocity=linear, angular_velocity=angular, imu=None)
    if imu is not None:
        sequence = _with_imu(sequence, imu, imu_calibration)
        sequence = sequence if time_unit is not None else in_seconds(sequence)
    elif imu_calibration is not None:
        raise InputError(f"imu-calibration: {shown(imu_calibration)} is given without samples; add --imu FILE")
    with reading(path):
        require_scale(sequence)
    return sequence if truth is None else attach_truth(sequence, truth, truth_frame)


def _with_imu(sequence: Sequence, imu: FilePath, calibration: FilePath | None) -> Sequence:
    raw = read_imu(imu, calibration_or_assumed(calibration, NO_CALIBRATION))
    with reading(imu):
        return attach_imu(sequence, raw, shown(imu), velocities=NO_VELOCITIES not in sequence.remarks)


def _read(file: Path, source: str, given: FloatArray | None, *, moves: bool) -> Sequence:
    with file.open("rb") as opened:
        head = opened.read(1024)
    if head.startswith(ZIP):
        with NpzArchive(file) as archive:
            return read_course(archive, file.stem, source, given, moves=moves)
    if head.startswith(b"MATLAB") and head[MATLAB_HEADER - 2 : MATLAB_HEADER] in (b"IM", b"MI"):
        if HDF5 in head:
            raise InputError("this is a MATLAB 7.3 file (HDF5), which is not supported; save it with save(..., '-v7')")
        with MatFile(file) as mat:
            sequence = read_utias(mat, file.stem, source)
        return sequence if given is None else replace(sequence, imu_T_cam=given)
    raise InputError(f"{_what(head)}; expected an .npz of the course or of fgbaseline, or a UTIAS .mat")


def _what(head: bytes) -> str:
    if not head:
        return "the file is empty"
    if head.startswith(HDF5):
        return "this is an HDF5 file"
    if head.startswith(b"\x93NUMPY"):
        return "this is a single array (.npy)"
    if head.isascii() and b"\0" not in head:
        return "this is a text file and no recording"
    return f"this is not a recording (it begins with the bytes {head[:8].hex(' ')})"
