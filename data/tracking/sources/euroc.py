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

from ...formats.imu_arrays import assumed_noise
from ...formats.imu_csv import read_imu_csv
from ...formats.imu_samples import RawSamples
from ...formats.imu_yaml import ImuCalibration, read_imu_calibration
from ...formats.named_file import reading, shown
from ...imu import ASSUMED_NOISE, STANDARD_GRAVITY
from ...observations import IntArray
from ...plural import plural
from .camera_yaml import Rig, pose, read_rig, read_sensor_yaml, read_yaml
from .image_files import file_pairs, image_files
from .image_recording import ImageRecording, TruthFile
from .pairing import pair, stamps_of_names

CHAINS = ("camchain.yaml", "camchain-imucam.yaml", "dso/camchain.yaml")
IMU_CONFIGS = ("imu_config.yaml", "dso/imu_config.yaml")
TRUTHS = ("state_groundtruth_estimate0", "mocap0", "gt0")
NOT_APPLIED = "Its pose in the body"
"""beginning of a remark of the IMU's calibration that does not hold here"""


def open_euroc(folder: Path) -> ImageRecording:
    """The recording in `folder`, `mav0` or its parent. Raises InputError that names what is missing."""
    mav = folder / "mav0" if (folder / "mav0").is_dir() else folder
    for name in ("cam0", "cam1"):
        if not (mav / name).is_dir():
            raise InputError(f"{shown(mav)}: the folder {name} is missing; a EuRoC folder has cam0 and cam1")
    body_T_imu = _imu_pose(mav)
    rig = _rig(mav)
    stamps, files, remarks = zip(*(_images(mav / name) for name in ("cam0", "cam1")), strict=True)
    paired = pair(stamps[0], stamps[1], shown(mav))
    both = [(files[0][a], files[1][b]) for a, b in zip(paired.left.tolist(), paired.right.tolist(), strict=True)]
    truth = next((file for name in TRUTHS if (file := mav / name / "data.csv").is_file()), None)
    imu, imu_remarks = _imu(mav)
    place = folder.resolve()
    return ImageRecording(
        name=place.parent.name if place.name == "mav0" else place.name,
        form="euroc",
        source=shown(folder),
        t=np.array([stamp / 10**9 for stamp in paired.stamp.tolist()]) + rig.time_shift,
        pairs=file_pairs(both),
        left=rig.left,
        right=rig.right,
        extrinsic_known=rig.extrinsic_known,
        imu=imu,
        imu_source=shown(mav / "imu0" / "data.csv"),
        truth=None if truth is None else TruthFile(truth, "imu"),
        body_T_imu=body_T_imu,
        remarks=(*rig.remarks, *remarks[0], *remarks[1], *paired.remarks, *imu_remarks),
    )


def _rig(mav: Path) -> Rig:
    chain = next((file for place in (mav, mav.parent) for name in CHAINS if (file := place / name).is_file()), None)
    sensors = [mav / name / "sensor.yaml" for name in ("cam0", "cam1")]
    missing = next((file for file in sensors if not file.is_file()), None)
    if missing is None:
        left, right = (read_sensor_yaml(file) for file in sensors)
        body_T_imu = _imu_pose(mav)
        if body_T_imu is not None:
            left, right = (camera.on(se3.inverse(body_T_imu)) for camera in (left, right))
        return Rig(left, right, extrinsic_known=True)
    if chain is None:
        raise InputError(f"{shown(missing)}: the file is missing; add it, or Kalibr's camchain.yaml beside mav0")
    return read_rig(chain, None)


def _imu_pose(mav: Path) -> FloatArray | None:
    """Pose of the IMU in the body (4, 4); None where it is the body."""
    file = mav / "imu0" / "sensor.yaml"
    if not file.is_file():
        return None
    with reading(file):
        tree = read_yaml(file)
        found = pose(tree["T_BS"], "T_BS") if "T_BS" in tree else np.eye(4)
    return None if np.allclose(found, np.eye(4), atol=1e-9) else found


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
    text = f"{shown(table)} lists {plural(missing, 'image')} that are not there: skipped."
    return stamps, files, (text,) if missing else ()


def _rising(stamps: IntArray, files: list[Path], folder: Path) -> tuple[IntArray, list[Path], tuple[str, ...]]:
    if len(stamps) < 2 or not (np.diff(stamps) > 0).all():
        raise InputError(f"{shown(folder)}: expected two images or more with rising stamps, got {len(stamps)}")
    return stamps, files, ()


def _imu(mav: Path) -> tuple[RawSamples | None, tuple[str, ...]]:
    """Raw samples with the noise of the folder; None where there are none."""
    table = mav / "imu0" / "data.csv"
    if not table.is_file():
        return None, ()
    configs = [mav / "imu0" / "sensor.yaml", *(mav.parent / name for name in IMU_CONFIGS)]
    config = next((file for file in configs if file.is_file()), None)
    if config is None:
        remark = assumed_noise(f"{shown(configs[0])} is missing")
        found = ImuCalibration(ASSUMED_NOISE, STANDARD_GRAVITY, (remark,))
    else:
        found = read_imu_calibration(config)
    raw = read_imu_csv(table, found.noise, found.gravity)
    return raw, tuple(remark for remark in found.remarks if not remark.startswith(NOT_APPLIED))
