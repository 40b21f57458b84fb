"""Recording of images: stamps, cameras and motion, with pairs, or images of one camera, read one at a time."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from fgbaseline.geometry import FloatArray

from ...formats.inertial.imu_samples import RawSamples
from ...formats.recordings.ground_truth import BodyFrame
from ...sequence import Truth
from ..rectification import CameraModel, Image

ONE_CAMERA = "One camera: its tracks have no right pixels, and raw inertial samples determine their scale."


class ImagePair(NamedTuple):
    """Grey images of one instant; None where one cannot be read."""

    left: Image | None
    right: Image | None
    """None with one camera"""
    name: str
    """name of the pair in messages"""


class TruthFile(NamedTuple):
    """Trajectory file with the truth, and the body whose poses it has."""

    path: Path
    body: BodyFrame


@dataclass(frozen=True, eq=False, slots=True)
class ImageRecording:
    """T stereo pairs, or images of one camera, with their calibration and, where it is known, the motion of the IMU."""

    name: str
    form: str
    source: str
    t: FloatArray
    """(T,) s, in the clock of the motion"""
    pairs: Callable[[], Iterator[ImagePair]]
    """reads the T pairs in order, one at a time"""
    left: CameraModel
    right: CameraModel | None
    """None with one camera"""
    extrinsic_known: bool = True
    """whether `left.imu_T_cam` is that of an IMU; otherwise both poses are relative to the left camera"""
    velocities: tuple[FloatArray, FloatArray] | None = None
    """linear (T, 3) m/s and angular (T, 3) rad/s, in the IMU's frame"""
    imu: RawSamples | None = None
    imu_source: str = ""
    up_imu: FloatArray | None = None
    truth: Truth | TruthFile | None = None
    absent: tuple[str, ...] = ()
    """names of the expected motion files that are missing"""
    body_T_imu: FloatArray | None = None
    """(4, 4) where a truth file has the poses of another body than the IMU"""
    remarks: tuple[str, ...] = ()
