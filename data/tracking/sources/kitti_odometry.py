"""KITTI odometry folder: rectified images without motion.

```text
06/
  image_0/000000.png   image_1/000000.png
  calib.txt            P0 to P3
  times.txt            s, line k for frame k
  poses.txt            left camera; may be absent, or ../../poses/06.txt
```
"""

from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...formats.files.file_errors import reading, regular_file, shown
from ...formats.trajectories.kitti import read_times
from ...wording import plural
from ..rectification import CameraModel, Distortion
from .image_files import file_pairs, image_files, size_of
from .image_recording import ONE_CAMERA, ImageRecording, TruthFile


def open_kitti_odometry(folder: Path, *, left_alone: bool = False) -> ImageRecording:
    """The recording in `folder`, or that of its left camera. Raises InputError that names what is missing."""
    folders = ("image_0",) if left_alone else ("image_0", "image_1")
    for name in (*folders, "calib.txt", "times.txt"):
        if not (folder / name).exists():
            raise InputError(f"{shown(folder / name)} is missing; a KITTI odometry folder has image_0, image_1, "
                             "calib.txt and times.txt")  # fmt: skip
    t = read_times(folder / "times.txt")
    numbered = [_numbered(folder / name) for name in folders]
    last = max(map(max, numbered))
    if last >= len(t):
        raise InputError(f"{shown(folder / 'times.txt')}: it has {len(t)} stamps, but image {last} has none")
    common = sorted(set.intersection(*map(set, numbered)))
    if len(common) < 2:
        raise InputError(f"{shown(folder)}: {plural(len(common), 'pair')} of images; a recording needs at least 2")
    files = [tuple(each[k] for each in numbered) for k in common]
    size = size_of(files[0][0])
    P0, P1 = _projections(folder / "calib.txt")
    alone = sum(map(len, numbered)) - len(folders) * len(common)
    remarks = [ONE_CAMERA] if left_alone else [f"{plural(alone, 'image')} without a partner: skipped."] if alone else []
    cameras = rectified_cameras(P0, P1, size, np.eye(4))
    poses = _poses(folder) if len(common) == last + 1 else None  # line k is frame k
    return ImageRecording(
        name=folder.resolve().name,
        form="kitti-odometry",
        source=shown(folder),
        t=t[common],
        pairs=file_pairs(files),
        left=cameras[0],
        right=None if left_alone else cameras[1],
        extrinsic_known=False,
        truth=None if poses is None else TruthFile(poses, "camera"),
        remarks=tuple(remarks),
    )


def rectified_cameras(
    P0: FloatArray, P1: FloatArray, size: tuple[int, int], imu_T_cam: FloatArray
) -> tuple[CameraModel, CameraModel]:
    """Cameras of two projection matrices (3, 4) of KITTI: equal intrinsics, the second displaced along x."""
    intrinsics = (float(P0[0, 0]), float(P0[1, 1]), float(P0[0, 2]), float(P0[1, 2]))
    displaced = np.eye(4)
    displaced[0, 3] = (P0[0, 3] - P1[0, 3]) / P0[0, 0]
    left = CameraModel(intrinsics, Distortion.NONE, (), size, imu_T_cam)
    return left, CameraModel(intrinsics, Distortion.NONE, (), size, imu_T_cam @ displaced)


def _projections(file: Path) -> tuple[FloatArray, FloatArray]:
    with reading(file):
        lines = [line.partition(":")[2] or line for line in regular_file(file).read_text().splitlines() if line.strip()]
        try:
            P = [np.array(line.split(), dtype=np.float64).reshape(3, 4) for line in lines[:2]]
        except ValueError:
            raise InputError("expected P0 and P1 of 12 numbers each on its first two lines") from None
        if len(P) < 2 or not (np.isfinite(P).all() and P[0][0, 0] > 0.0):
            raise InputError("expected P0 and P1 of 12 numbers each on its first two lines")
    return P[0], P[1]


def _numbered(folder: Path) -> dict[int, Path]:
    files = image_files(folder)
    wrong = next((file for file in files if not file.stem.isdecimal()), None)
    if wrong is not None:
        raise InputError(f"{shown(wrong)}: expected the number of the frame as its name")
    return {int(file.stem): file for file in files}


def _poses(folder: Path) -> Path | None:
    """File of the true poses, where there is one."""
    place = folder.resolve()
    found = [place / "poses.txt", place.parents[1] / "poses" / f"{place.name}.txt", *sorted(place.glob("poses*.txt"))]
    return next((file for file in found if file.is_file()), None)
