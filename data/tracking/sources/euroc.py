"""EuRoC ASL folder, and TUM-VI's export in this form.

```text
mav0/
  cam0/data/STAMP.png, data.csv, sensor.yaml    (TUM-VI: camchain.yaml beside mav0 or under dso/)
  cam1/                                         the same; absent with one camera
  imu0/data.csv, sensor.yaml                    (TUM-VI: dso/imu_config.yaml)
  state_groundtruth_estimate0/data.csv          or mocap0/data.csv
```
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3

from ...formats.files.file_errors import reading, shown
from ...formats.inertial.imu_attachment import read_imu
from ...formats.inertial.imu_yaml import ImuCalibration, calibration_or_assumed
from ...observations import IntArray
from ...wording import plural
from .camera_yaml import Rig, read_rig, read_sensor_yaml
from .image_files import file_pairs, image_files
from .image_recording import ONE_CAMERA, ImageRecording, TruthFile
from .pairing import pair, seconds, stamps_of_names

CHAINS = ("camchain.yaml", "camchain-imucam.yaml", "dso/camchain.yaml")
IMU_CONFIGS = ("imu_config.yaml", "dso/imu_config.yaml")
IMU = "imu0/data.csv"
TRUTHS = ("state_groundtruth_estimate0", "mocap0", "gt0")


class _Images(NamedTuple):
    """Images of a camera."""

    stamp: IntArray
    """(n,) ns"""
    file: list[Path]
    remarks: tuple[str, ...] = ()


def open_euroc(folder: Path, *, left_alone: bool = False) -> ImageRecording:
    """The recording in `folder`, `mav0` or its parent; one camera where `left_alone`, or where there is no cam1.

    Raises InputError that names what is missing.
    """
    mav = folder / "mav0" if (folder / "mav0").is_dir() else folder
    if not (mav / "cam0").is_dir():
        raise InputError(f"{shown(mav)}: the folder cam0 is missing; a EuRoC folder has cam0, and cam1 for a pair")
    left_alone |= not (mav / "cam1").is_dir()
    calibration = _imu_calibration(mav)
    body_T_imu = None if calibration is None else calibration.body_T_imu
    rig = _rig(mav, body_T_imu, left_alone=left_alone)
    left = _images(mav / "cam0")
    files: list[tuple[Path, ...]]
    if left_alone:
        t, files, remarks = seconds(left.stamp), [(file,) for file in left.file], (ONE_CAMERA, *left.remarks)
    else:
        right = _images(mav / "cam1")
        paired = pair(left.stamp, right.stamp, shown(mav))
        files = [
            (left.file[a], right.file[b]) for a, b in zip(paired.left.tolist(), paired.right.tolist(), strict=True)
        ]
        t, remarks = paired.t, (*left.remarks, *right.remarks, *paired.remarks)
    truth = next((file for name in TRUTHS if (file := mav / name / "data.csv").is_file()), None)
    samples, place = mav / IMU, folder.resolve()
    return ImageRecording(
        name=place.parent.name if place.name == "mav0" else place.name,
        form="euroc",
        source=shown(folder),
        t=t + rig.time_shift,
        pairs=file_pairs(files),
        left=rig.left,
        right=rig.right,
        extrinsic_known=rig.extrinsic_known,
        imu=None if calibration is None else read_imu(samples, calibration._replace(body_T_imu=None)),
        imu_source=shown(samples),
        truth=None if truth is None else TruthFile(truth, "imu"),
        absent=(shown(samples),) if calibration is None else (),
        body_T_imu=body_T_imu,
        remarks=(*rig.remarks, *remarks),
    )


def _rig(mav: Path, body_T_imu: FloatArray | None, *, left_alone: bool) -> Rig:
    chain = next((file for place in (mav, mav.parent) for name in CHAINS if (file := place / name).is_file()), None)
    sensors = [mav / name / "sensor.yaml" for name in (("cam0",) if left_alone else ("cam0", "cam1"))]
    missing = next((file for file in sensors if not file.is_file()), None)
    if missing is None:
        cameras = [read_sensor_yaml(file) for file in sensors]
        if body_T_imu is not None:
            cameras = [camera.on(se3.inverse(body_T_imu)) for camera in cameras]
        return Rig(cameras[0], None if left_alone else cameras[1], extrinsic_known=True)
    if chain is None:
        raise InputError(f"{shown(missing)}: the file is missing; add it, or Kalibr's camchain.yaml beside mav0")
    return read_rig(chain, None, left_alone=left_alone)


def _images(folder: Path) -> _Images:
    """Images of a camera, with a remark on those that are listed and missing."""
    table = folder / "data.csv"
    if not table.is_file():
        files = image_files(folder / "data")
        stamps = stamps_of_names(files)
        if stamps is None:
            raise InputError(f"{shown(table)}: the file is missing, and the images' names are not stamps in ns")
        return _rising(stamps, files, folder)
    with reading(table):
        rows = [line.split(",") for line in table.read_text("utf-8-sig").splitlines() if line.strip()]
        rows = [row for row in rows if not row[0].lstrip().startswith("#")]
        wrong = next((row for row in rows if len(row) < 2 or not row[0].strip().isdecimal()), None)
        if wrong is not None or not rows:
            raise InputError(f"expected lines `stamp in ns,file name`, got {','.join(wrong or [])[:60]!r}")
    there = {file.name for file in image_files(folder / "data")}
    kept = [(int(row[0]), folder / "data" / row[1].strip()) for row in rows if row[1].strip() in there]
    if not kept:
        raise InputError(
            f"{shown(table)}: none of its {plural(len(rows), 'image')}, such as {rows[0][1].strip()}, is in "
            f"{shown(folder / 'data')}, which has {min(there)}"
        )
    found = _rising(np.array([stamp for stamp, _ in kept], np.int64), [file for _, file in kept], folder)
    missing = len(rows) - len(kept)
    text = f"{shown(table)}: {plural(missing, 'image')} of {len(rows)} not found: skipped."
    return found._replace(remarks=(text,)) if missing else found


def _rising(stamps: IntArray, files: list[Path], folder: Path) -> _Images:
    if len(stamps) < 2 or not (np.diff(stamps) > 0).all():
        raise InputError(f"{shown(folder)}: expected two images or more with rising stamps, got {len(stamps)}")
    return _Images(stamps, files)


def _imu_calibration(mav: Path) -> ImuCalibration | None:
    """Calibration of the IMU; None where the folder has no samples."""
    if not (mav / IMU).is_file():
        return None
    files = [mav / "imu0" / "sensor.yaml", *(mav.parent / name for name in IMU_CONFIGS)]
    file = next((file for file in files if file.is_file()), None)
    return calibration_or_assumed(file, f"{shown(files[0])} is missing")
