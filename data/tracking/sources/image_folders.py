"""Folders of images, of a pair or of one camera, with a calibration: Kalibr's camera chain or OpenCV's."""

from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...formats.files.file_errors import shown
from ...formats.trajectories.kitti import read_times
from ...wording import plural
from .camera_yaml import read_rig
from .image_files import file_pairs, image_files, size_of
from .image_recording import ONE_CAMERA, ImageRecording
from .pairing import pair, seconds, stamps_of_names


def open_two_folders(left: Path, right: Path | None, calibration: Path | None, times: Path | None) -> ImageRecording:
    """The recording in two folders, or in that of one camera. Raises InputError that names what is missing.

    Images are named by their stamps, or `times` has one line for each name.
    """
    if calibration is None:
        raise InputError(
            f"{shown(left)}: folders of images need a calibration; add --calibration YAML (Kalibr or OpenCV)"
        )
    both = [image_files(folder) for folder in (left, right) if folder is not None]
    rig = read_rig(calibration, size_of(both[0][0]), left_alone=right is None)
    stamps = [stamps_of_names(files) for files in both]
    files: list[tuple[Path, ...]]
    remarks: tuple[str, ...] = (ONE_CAMERA,) if right is None else ()
    t: FloatArray
    if times is not None:
        t = read_times(times)
        if len(t) != len(both[0]):
            raise InputError(f"{shown(times)}: it has {len(t)} stamps for {len(both[0])} images in {shown(left)}")
        partner = {file.stem: file for file in both[-1]}
        kept = [k for k, file in enumerate(both[0]) if file.stem in partner]
        files = [(both[0][k],) if right is None else (both[0][k], partner[both[0][k].stem]) for k in kept]
        alone = sum(map(len, both)) - len(both) * len(files)
        if len(files) < 2:
            raise InputError(
                f"{shown(right or left)}: {len(files)} of its images have the name of one in {shown(left)}"
            )
        remarks += (f"{plural(alone, 'image')} without a partner of its name: skipped.",) if alone else ()
        t = t[kept]
    elif stamps[0] is not None and right is None:
        t, files = seconds(stamps[0]), [(file,) for file in both[0]]
        if len(t) < 2 or not (np.diff(stamps[0]) > 0).all():
            raise InputError(f"{shown(left)}: expected two images or more with rising stamps, got {len(t)}")
    elif stamps[0] is not None and stamps[1] is not None:
        paired = pair(stamps[0], stamps[1], shown(left))
        remarks = paired.remarks
        t = paired.t
        files = [(both[0][a], both[1][b]) for a, b in zip(paired.left.tolist(), paired.right.tolist(), strict=True)]
    else:
        raise InputError(
            f"{shown(left)}: the images' names are not stamps; add --times FILE with a line for each image"
        )
    return ImageRecording(
        name=left.resolve().parent.name,
        form="two-folders",
        source=shown(left),
        t=t + rig.time_shift,
        pairs=file_pairs(files),
        left=rig.left,
        right=rig.right,
        extrinsic_known=rig.extrinsic_known,
        remarks=(*rig.remarks, *remarks),
    )
