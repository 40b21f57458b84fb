"""Reader of recordings in all known forms, detected from the content and never from the file name."""

import os
from pathlib import Path

import numpy as np

from fgbaseline.geometry import InputError

from ..imu import ASSUMED_NOISE, STANDARD_GRAVITY
from ..sequence import Sequence
from ..time_unit import TimeUnit, in_seconds
from .course import NO_VELOCITIES, read_course
from .ground_truth import BodyFrame, attach_truth
from .imu_arrays import assumed_noise
from .imu_attachment import attach_imu
from .imu_csv import read_imu_csv
from .imu_yaml import ImuCalibration, read_imu_calibration
from .mat_file import MatFile
from .named_file import FilePath, reading, regular_file, shown
from .npz_archive import NpzArchive
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
) -> Sequence:
    """The recording in the file `path`: a course file, one of our own, or a UTIAS `.mat`.

    `time_unit` is that of its stamps; without it they are in seconds, unless they show another unit (`time_unit.py`).

    `imu` is a CSV of raw inertial samples, `imu_calibration` the YAML of their noise: they replace the velocities.

    `truth` is a KITTI or TUM file with the poses of `truth_frame`, "camera" or "imu" (see `attach_truth`); without it
    the truth is what the recording itself has. Raises InputError, naming file, field and value, for anything else.
    """
    with reading(path), np.errstate(all="ignore"):  # absurd numbers are judged, not computed with
        file = regular_file(path)
        sequence = in_seconds(_read(file, os.fspath(path), has_imu_file=imu is not None), time_unit)
    if imu is not None:
        sequence = _with_imu(sequence, imu, imu_calibration)
        sequence = sequence if time_unit is not None else in_seconds(sequence)
    elif imu_calibration is not None:
        raise InputError(f"imu-calibration: {shown(imu_calibration)} is given without samples; add --imu FILE")
    return sequence if truth is None else attach_truth(sequence, truth, truth_frame)


def _with_imu(sequence: Sequence, imu: FilePath, calibration: FilePath | None) -> Sequence:
    found = ImuCalibration(ASSUMED_NOISE, STANDARD_GRAVITY, (assumed_noise("no imu-calibration is given"),))
    if calibration is not None:
        found = read_imu_calibration(calibration)
    raw = read_imu_csv(imu, found.noise, found.gravity)
    with reading(imu):
        raw = raw._replace(remarks=(*found.remarks, *raw.remarks))
        return attach_imu(sequence, raw, shown(imu), velocities=NO_VELOCITIES not in sequence.remarks)


def _read(file: Path, source: str, *, has_imu_file: bool) -> Sequence:
    with file.open("rb") as opened:
        head = opened.read(1024)
    if head.startswith(ZIP):
        with NpzArchive(file) as archive:
            return read_course(archive, file.stem, source, has_imu_file=has_imu_file)
    if head.startswith(b"MATLAB") and head[MATLAB_HEADER - 2 : MATLAB_HEADER] in (b"IM", b"MI"):
        if HDF5 in head:
            raise InputError("this is a MATLAB 7.3 file (HDF5), which is not supported; save it with save(..., '-v7')")
        with MatFile(file) as mat:
            return read_utias(mat, file.stem, source)
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
    return f"this is no recording (it begins with the bytes {head[:8].hex(' ')})"
