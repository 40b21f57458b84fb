"""Images and inertial samples in a ROS 1 or ROS 2 bag; the topics are guessed from their types."""

from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...formats.files.bag_file import Bag, open_bag_file
from ...formats.files.file_errors import shown
from ...formats.inertial.imu_samples import RawSamples, imu_samples
from ...formats.inertial.imu_yaml import assumed_calibration, read_imu_calibration
from .camera_yaml import read_rig
from .image_files import EightBits, Raw, decoded
from .image_recording import ONE_CAMERA, ImagePair, ImageRecording
from .pairing import Paired, pair, seconds

IMAGES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")
IMU = "sensor_msgs/Imu"
SIDES = (("left", "right"), ("cam0", "cam1"), ("infra1", "infra2"), ("image_0", "image_1"), ("camera0", "camera1"))
ENCODINGS: dict[str, tuple[str, int]] = {
    "mono8": ("u1", 1),
    "8UC1": ("u1", 1),
    "mono16": ("u2", 1),
    "16UC1": ("u2", 1),
    "rgb8": ("u1", 3),
    "bgr8": ("u1", 3),
    "rgba8": ("u1", 4),
    "bgra8": ("u1", 4),
    "8UC3": ("u1", 3),
}
"""numpy's type and the number of channels"""
LUMA = np.array([0.299, 0.587, 0.114])
"""weights of red, green and blue"""


class Topics(NamedTuple):
    """Topics of a stereo pair or of one camera, and of the IMU where there is one."""

    left: str
    right: str | None
    imu: str | None

    @property
    def images(self) -> tuple[str, ...]:
        """Topics of images."""
        return (self.left,) if self.right is None else (self.left, self.right)


def open_bag(
    path: Path, calibration: Path | None, topics: tuple[str, ...], *, left_alone: bool = False
) -> ImageRecording:
    """The recording in a bag, with a calibration of the cameras in YAML. Raises InputError that names what is missing.

    `topics` are left, right and, if any, the IMU; without them they are guessed from types and names, and reported. One
    topic of images is one camera, as is `left_alone`.
    """
    if calibration is None:
        raise InputError(f"{shown(path)}: a bag needs the calibration of its cameras; add --calibration YAML")
    with open_bag_file(path) as bag:
        chosen = _chosen(bag, topics, left_alone=left_alone)
        stamps: dict[str, list[int]] = {topic: [] for topic in chosen.images}
        size = None
        samples: list[tuple[int, Any, Any]] = []
        for topic, stamp, message in bag.messages(tuple(filter(None, chosen))):
            if topic == chosen.imu:
                samples.append((stamp, message.angular_velocity, message.linear_acceleration))
                continue
            stamps[topic].append(stamp)
            if size is None and (image := _image(message, bag.source, topic)) is not None:
                size = image.shape[1], image.shape[0]
    rig = read_rig(calibration, size, left_alone=chosen.right is None)
    images = [np.array(stamps[topic], dtype=np.int64) for topic in chosen.images]
    for topic, each in zip(chosen.images, images, strict=True):
        if len(each) < 2 or not (np.diff(each) > 0).all():
            raise InputError(f"{shown(path)}: {topic} has {len(each)} images; expected two or more with rising stamps")
    remarks: tuple[str, ...]
    if chosen.right is None:
        t, pairs, remarks = seconds(images[0]), _single_reader(path, chosen.left), (ONE_CAMERA,)
    else:
        paired = pair(images[0], images[1], shown(path))
        t, remarks = paired.t, paired.remarks
        pairs = _reader(path, chosen.left, chosen.right, paired)
    used = ", ".join(filter(None, chosen))
    return ImageRecording(
        name=path.stem,
        form="rosbag",
        source=shown(path),
        t=t + rig.time_shift,
        pairs=pairs,
        left=rig.left,
        right=rig.right,
        extrinsic_known=rig.extrinsic_known,
        imu=_imu(samples, calibration),
        imu_source=f"{shown(path)}:{chosen.imu}",
        remarks=(f"Topics: {used}.", *rig.remarks, *remarks),
    )


def _chosen(bag: Bag, given: tuple[str, ...], *, left_alone: bool) -> Topics:
    types = bag.topics
    images = [name for name, kind in types.items() if kind in IMAGES]
    imus = [name for name, kind in types.items() if kind == IMU]
    listed = ", ".join(f"{name} ({kind})" for name, kind in types.items() if kind in (*IMAGES, IMU)) or "none"
    if given:
        wrong = next((name for name in given if name not in (*images, *imus)), None)
        if wrong is not None:
            raise InputError(f"{bag.source}: {wrong} is not a topic of images or inertial samples; it has {listed}")
        n = sum(name in images for name in given)
        if n not in (1, 2) or len(given) - n > 1 or given[:n] != tuple(name for name in given if name in images):
            raise InputError(f"topics: expected LEFT,RIGHT or LEFT, and IMU after them if any, got {','.join(given)}")
        if n == 2 and given[0] == given[1]:
            raise InputError(f"topics: left and right are both {given[0]}; give the topics of two cameras")
        return Topics(given[0], given[1] if n == 2 and not left_alone else None, given[n] if len(given) > n else None)
    if len(images) == 1 and len(imus) <= 1:
        return Topics(images[0], None, imus[0] if imus else None)
    pairs = [(a, b) for a, b in combinations(images, 2) if any(_same_but(a, b, *sides) for sides in SIDES)]
    if len(images) == 2:
        pairs = pairs or [(images[0], images[1])]
    if len(pairs) != 1 or len(imus) > 1:
        raise InputError(f"{bag.source}: its topics are not clear; add --topics LEFT,RIGHT,IMU; it has {listed}")
    left, right = pairs[0]
    return Topics(left, None if left_alone else right, imus[0] if imus else None)


def _same_but(first: str, second: str, left: str, right: str) -> bool:
    return left in first and first.replace(left, right) == second


def _single_reader(path: Path, topic: str) -> Callable[[], Iterator[ImagePair]]:
    """Reader of the images of one camera."""

    def images() -> Iterator[ImagePair]:
        convert = EightBits()
        with open_bag_file(path) as bag:
            for k, (_, _, message) in enumerate(bag.messages((topic,))):
                image = convert(_image(message, bag.source, topic))
                yield ImagePair(image, None, f"{bag.source}: image {k} of {topic}")

    return images


def _reader(path: Path, first_topic: str, second_topic: str, paired: Paired) -> Callable[[], Iterator[ImagePair]]:
    """Reader of the pairs, which keeps few images at a time."""
    left, right = paired.left, paired.right

    def pairs() -> Iterator[ImagePair]:
        convert = EightBits(), EightBits()
        waiting: tuple[dict[int, Raw | None], dict[int, Raw | None]] = {}, {}
        seen = [0, 0]
        wanted = [set(left.tolist()), set(right.tolist())]
        done = 0
        with open_bag_file(path) as bag:
            for topic, _, message in bag.messages((first_topic, second_topic)):
                side = 0 if topic == first_topic else 1
                if seen[side] in wanted[side]:
                    waiting[side][seen[side]] = _image(message, bag.source, topic)
                seen[side] += 1
                while done < len(left) and int(left[done]) in waiting[0] and int(right[done]) in waiting[1]:
                    first = convert[0](waiting[0].pop(int(left[done])))
                    second = convert[1](waiting[1].pop(int(right[done])))
                    yield ImagePair(first, second, f"{bag.source}: image {int(left[done])} of {first_topic}")
                    done += 1

    return pairs


def _image(message: Any, source: str, topic: str) -> Raw | None:
    """Grey image of a message; None where it is damaged."""
    if not hasattr(message, "encoding"):
        return decoded(bytes(message.data))
    if message.encoding not in ENCODINGS:
        raise InputError(f"{source}: {topic} has images in {message.encoding}; known are {', '.join(ENCODINGS)}")
    kind, channels = ENCODINGS[message.encoding]
    dtype = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    data, row = np.asarray(message.data, dtype=np.uint8), message.width * channels * dtype.itemsize
    if len(data) < message.step * message.height or message.step < row or message.height == 0:
        return None
    rows = np.ascontiguousarray(data[: message.step * message.height].reshape(message.height, -1)[:, :row])
    image: Raw = rows.view(dtype).reshape(message.height, message.width, channels)
    if channels == 1:
        return image[:, :, 0].astype(dtype.newbyteorder("="))
    colors = image[:, :, :3] if message.encoding.startswith("rgb") else image[:, :, 2::-1]
    grey: Raw = np.rint(colors @ LUMA).astype(np.uint8)
    return grey


def _imu(samples: list[tuple[int, Any, Any]], calibration: Path) -> RawSamples | None:
    """Inertial samples with the noise of the calibration, where it has it."""
    if not samples:
        return None
    t = np.array([stamp / 10**9 for stamp, _, _ in samples])
    rate, force = (_vectors([sample[i] for sample in samples]) for i in (1, 2))
    try:
        found = read_imu_calibration(calibration)
    except InputError:
        found = assumed_calibration(f"{shown(calibration)} states no noise of the IMU")
    kept, findings = imu_samples(t, rate, force, found.noise, found.gravity)
    return RawSamples(kept, found.remarks, findings)


def _vectors(values: list[Any]) -> FloatArray:
    return np.array([[value.x, value.y, value.z] for value in values])
