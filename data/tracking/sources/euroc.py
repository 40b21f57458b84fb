"""EuRoC ASL folder, and TUM-VI's export in this form.

```text
mav0/
  cam0/data/STAMP.png, data.csv, sensor.yaml    (TUM-VI: camchain.yaml beside mav0 or under dso/)
  cam1/                                         the same
  imu0/data.csv, sensor.yaml                    (TUM-VI: dso/imu_config.yaml)
  state_groundtruth_estimate0/data.csv          or mocap0/data.csv
```
"""

from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3

from ...formats.imu_attachment import read_imu
from ...formats.imu_yaml import ImuCalibration, calibration_or_assumed
from ...formats.named_file import reading, shown
from ...observations import IntArray
from ...plural import plural
from .camera_yaml import Rig, read_rig, read_sensor_yaml
from .image_files import file_pairs, image_files
from .image_recording import ImageRecording, TruthFile
from .pairing import pair, stamps_of_names

CHAINS = ("camchain.yaml", "camchain-imucam.yaml", "dso/camchain.yaml")
IMU_CONFIGS = ("imu_config.yaml", "dso/imu_config.yaml")
IMU = "imu0/data.csv"
TRUTHS = ("state_groundtruth_estimate0", "mocap0", "gt0")


def open_euroc(folder: Path) -> ImageRecording:
    """The recording in `folder`, `mav0` or its parent. Raises InputError that names what is missing."""
    mav = folder / "mav0" if (folder / "mav0").is_dir() else folder
    for name in ("cam0", "cam1"):
        if not (mav / name).is_dir():
            raise InputError(f"{shown(mav)}: the folder {name} is missing; a EuRoC folder has cam0 and cam1")
    calibration = _imu_calibration(mav)
    body_T_imu = None if calibration is None else calibration.body_T_imu
    rig = _rig(mav, body_T_imu)
    stamps, files, remarks = zip(*(_images(mav / name) for name in ("cam0", "cam1")), strict=True)
    paired = pair(stamps[0], stamps[1], shown(mav))
    both = [(files[0][a], files[1][b]) for a, b in zip(paired.left.tolist(), paired.right.tolist(), strict=True)]
    truth = next((file for name in TRUTHS if (file := mav / name / "data.csv").is_file()), None)
    samples, place = mav / IMU, folder.resolve()
    return ImageRecording(
        name=place.parent.name if place.name == "mav0" else place.name,
        form="euroc",
        source=shown(folder),
        t=paired.t + rig.time_shift,
        pairs=file_pairs(both),
        left=rig.left,
        right=rig.right,
        extrinsic_known=rig.extrinsic_known,
        imu=None if calibration is None else read_imu(samples, calibration._replace(body_T_imu=None)),
        imu_source=shown(samples),
        truth=None if truth is None else TruthFile(truth, "imu"),
        absent=(shown(samples),) if calibration is None else (),
        body_T_imu=body_T_imu,
        remarks=(*rig.remarks, *remarks[0], *remarks[1], *paired.remarks),
    )


def _rig(mav: Path, body_T_imu: FloatArray | None) -> Rig:
    chain = next((file for place in (mav, mav.parent) for name in CHAINS if (file := place / name).is_file()), None)
    sensors = [mav / name / "sensor.yaml" for name in ("cam0", "cam1")]
    missing = next((file for file in sensors if not file.is_file()), None)
    if missing is None:
        left, right = (read_sensor_yaml(file) for file in sensors)
        if body_T_imu is not None:
            left, right = (camera.on(se3.inverse(body_T_imu)) for camera in (left, right))
        return Rig(left, right, extrinsic_known=True)
    if chain is None:
        raise InputError(f"{shown(missing)}: the file is missing; add it, or Kalibr's camchain.yaml beside mav0")
    return read_rig(chain, None)


def _images(folder: Path) -> tuple[IntArray, list[Path], tuple[str, ...]]:
    """Stamps, ns, and files of a camera's images, and a remark on those that are listed and missing."""
    table = folder / "data.csv"
    if not table.is_file():
        files = image_files(folder / "data")
        stamps = stamps_of_names(files)
        if stamps is None:
            raise InputError(f"{shown(table)}: the file is missing, and the images' names are no stamps in ns")
        return _rising(stamps, files, folder)
    with reading(table):
        rows = [line.split(",") for line in table.read_text("utf-8-sig").splitlines() if line.strip()]
        rows = [row for row in rows if not row[0].lstrip().startswith("#")]
        wrong = next((row for row in rows if len(row) < 2 or not row[0].strip().isdecimal()), None)
        if wrong is not None or not rows:
            raise InputError(f"expected lines `stamp in ns,file name`, got {','.join(wrong or [])[:60]!r}")
    there = {file.name for file in image_files(folder / "data")}
    kept = [(int(row[0]), folder / "data" / row[1].strip()) for row in rows if row[1].strip() in there]
    stamps, files, _ = _rising(np.array([stamp for stamp, _ in kept], np.int64), [file for _, file in kept], folder)
    missing = len(rows) - len(kept)
    text = f"{shown(table)}: {plural(missing, 'image')} of {len(rows)} not found: skipped."
    return stamps, files, (text,) if missing else ()


def _rising(stamps: IntArray, files: list[Path], folder: Path) -> tuple[IntArray, list[Path], tuple[str, ...]]:
    if len(stamps) < 2 or not (np.diff(stamps) > 0).all():
        raise InputError(f"{shown(folder)}: expected two images or more with rising stamps, got {len(stamps)}")
    return stamps, files, ()


def _imu_calibration(mav: Path) -> ImuCalibration | None:
    """Calibration of the IMU; None where the folder has no samples."""
    if not (mav / IMU).is_file():
        return None
    files = [mav / "imu0" / "sensor.yaml", *(mav.parent / name for name in IMU_CONFIGS)]
    file = next((file for file in files if file.is_file()), None)
    return calibration_or_assumed(file, f"{shown(files[0])} is missing")
