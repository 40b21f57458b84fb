"""ROS 1 and ROS 2 bags, written by the library that reads them: images, inertial samples, trajectories."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from fgbaseline.data.formats import read_trajectory, write_tum
from fgbaseline.data.formats.files.bag_file import is_bag
from fgbaseline.data.formats.trajectories.bag_topic import read_bag_trajectory
from fgbaseline.data.tracking import ImageOptions, track
from fgbaseline.data.tracking.sources import open_recording
from fgbaseline.data.tracking.sources.image_recording import TruthFile
from fgbaseline.geometry import FloatArray, InputError, so3
from fgbaseline.reports.cli import group

from ..builders.rendered import IMU_YAML, Room, camchain_yaml

cv2 = pytest.importorskip("cv2")
pytest.importorskip("rosbags")
from rosbags.rosbag1 import Writer as Writer1  # noqa: E402
from rosbags.rosbag2 import StoragePlugin  # noqa: E402
from rosbags.rosbag2 import Writer as Writer2  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

N = 5
KINDS = ("ros1", "sqlite3", "mcap")
Write = Callable[[str, str, int, Any], None]


class BagWriter:
    """Bag of one of the kinds."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.ros1 = kind == "ros1"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        self.path = folder / ("run.bag" if self.ros1 else "run")
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        self.writer: AbstractContextManager[Any] = (
            Writer1(self.path) if self.ros1 else Writer2(self.path, version=9, storage_plugin=plugin)
        )
        self.connections: dict[str, Any] = {}

    def type(self, name: str) -> Any:
        return self.store.types[name]

    def header(self, stamp: int, frame: str = "map") -> Any:
        time = self.type("builtin_interfaces/msg/Time")(sec=stamp // 10**9, nanosec=stamp % 10**9)
        given = {"stamp": time, "frame_id": frame}
        return self.type("std_msgs/msg/Header")(**given, **({"seq": 0} if self.ros1 else {}))

    def write(self, topic: str, kind: str, stamp: int, message: Any) -> None:
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)  # type: ignore[attr-defined]
        dump = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], stamp + 1_000_000, dump(message, kind))  # type: ignore[attr-defined]

    def image(self, topic: str, stamp: int, image: Any) -> None:
        kind, (height, width) = "sensor_msgs/msg/Image", image.shape
        message = self.type(kind)(
            header=self.header(stamp), height=height, width=width, encoding="mono8", is_bigendian=0, step=width,
            data=image.ravel(),
        )  # fmt: skip
        self.write(topic, kind, stamp, message)

    def compressed(self, topic: str, stamp: int, image: Any) -> None:
        kind = "sensor_msgs/msg/CompressedImage"
        data = cv2.imencode(".png", image)[1].ravel()
        self.write(topic, kind, stamp, self.type(kind)(header=self.header(stamp), format="png", data=data))

    def vector(self, values: Any) -> Any:
        x, y, z = map(float, values)
        return self.type("geometry_msgs/msg/Vector3")(x=x, y=y, z=z)

    def imu(self, topic: str, stamp: int, row: Any) -> None:
        kind, none = "sensor_msgs/msg/Imu", np.zeros(9)
        message = self.type(kind)(
            header=self.header(stamp),
            orientation=self.quaternion(np.eye(3)),
            orientation_covariance=none,
            angular_velocity=self.vector(row[:3]),
            angular_velocity_covariance=none,
            linear_acceleration=self.vector(row[3:]),
            linear_acceleration_covariance=none,
        )
        self.write(topic, kind, stamp, message)

    def quaternion(self, R: FloatArray) -> Any:
        x, y, z, w = so3.quaternion_xyzw(R).tolist()
        return self.type("geometry_msgs/msg/Quaternion")(x=x, y=y, z=z, w=w)

    def pose(self, pose: FloatArray) -> Any:
        x, y, z = pose[:3, 3].tolist()
        point = self.type("geometry_msgs/msg/Point")(x=x, y=y, z=z)
        return self.type("geometry_msgs/msg/Pose")(position=point, orientation=self.quaternion(pose[:3, :3]))

    def trajectory(self, stamps: list[int], poses: FloatArray) -> None:
        """One topic of each type that has poses."""
        covariance = np.diag([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]).ravel()
        zero = self.vector([0, 0, 0])
        twist = self.type("geometry_msgs/msg/Twist")(linear=zero, angular=zero)
        twisted = self.type("geometry_msgs/msg/TwistWithCovariance")(twist=twist, covariance=np.zeros(36))
        path = []
        for stamp, pose in zip(stamps, poses, strict=True):
            header, given = self.header(stamp), self.pose(pose)
            uncertain = self.type("geometry_msgs/msg/PoseWithCovariance")(pose=given, covariance=covariance)
            transform = self.type("geometry_msgs/msg/Transform")(
                translation=self.vector(pose[:3, 3]), rotation=given.orientation
            )
            stamped = self.type("geometry_msgs/msg/PoseStamped")(header=header, pose=given)
            path.append(stamped)
            messages = {
                "/odom": ("nav_msgs/msg/Odometry", {"child_frame_id": "imu", "pose": uncertain, "twist": twisted}),
                "/pose": ("geometry_msgs/msg/PoseStamped", {"pose": given}),
                "/covariant": ("geometry_msgs/msg/PoseWithCovarianceStamped", {"pose": uncertain}),
                "/vicon/body": (
                    "geometry_msgs/msg/TransformStamped",
                    {"child_frame_id": "body", "transform": transform},
                ),
                "/path": ("nav_msgs/msg/Path", {"poses": list(path)}),
            }
            for topic, (kind, parts) in messages.items():
                self.write(topic, kind, stamp, self.type(kind)(header=header, **parts))


@pytest.fixture(scope="module")
def room() -> Room:
    return Room(N)


def calibration(folder: Path) -> Path:
    noise = "\n".join(f"  {line}" for line in IMU_YAML.splitlines()[1:])
    file = folder / "camchain-imucam.yaml"
    file.write_text(f"{camchain_yaml()}imu0:\n{noise}\n")
    return file


def stereo_bag(kind: str, folder: Path, room: Room, *, packed: bool = False) -> Path:
    bag = BagWriter(kind, folder)
    write = bag.compressed if packed else bag.image
    events: list[tuple[int, Callable[[], None]]] = []
    for k, stamp in enumerate(room.stamps):
        for side in ("right", "left"):
            late = 200_000 if side == "right" else 0
            image = room.image(k, right=side == "right")
            topic = f"/cam/{side}/image_raw"
            events.append((stamp, lambda topic=topic, at=stamp + late, image=image: write(topic, at, image)))  # type: ignore[misc]
    for stamp, row in zip(*room.imu(), strict=True):
        events.append((stamp, lambda at=stamp, row=row: bag.imu("/imu0", at, row)))  # type: ignore[misc]
    with bag.writer:
        for _, event in sorted(events, key=lambda each: each[0]):
            event()
    return bag.path


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("packed", [False, True])
def test_images_and_samples_of_a_bag(kind: str, packed: bool, room: Room, tmp_path: Path) -> None:
    path = stereo_bag(kind, tmp_path, room, packed=packed)
    assert is_bag(path)
    recording = open_recording(path, ImageOptions(calibration=calibration(tmp_path)))
    assert "Topics: /cam/left/image_raw, /cam/right/image_raw, /imu0." in recording.remarks
    np.testing.assert_allclose(recording.t, np.array(room.stamps) / 1e9, atol=1e-6)
    for k, pair in enumerate(recording.pairs()):
        assert pair.left is not None
        assert pair.right is not None
        assert (pair.left == room.image(k)).all()
        assert (pair.right == room.image(k, right=True)).all()
    assert k == N - 1
    sequence = track(path, ImageOptions(calibration=calibration(tmp_path))).sequence()
    assert sequence.imu is not None
    np.testing.assert_array_equal(sequence.imu.angular_velocity, room.imu()[1][:, :3])
    assert sequence.imu.noise.gyroscope_density == 1e-3


def test_topics_are_given_where_types_leave_them_open(room: Room, tmp_path: Path) -> None:
    bag = BagWriter("ros1", tmp_path)
    with bag.writer:
        for k, stamp in enumerate(room.stamps):
            for topic in ("/a", "/b", "/c"):
                bag.image(topic, stamp, room.image(k, right=topic == "/c"))
    options = ImageOptions(calibration=calibration(tmp_path))
    with pytest.raises(InputError, match=r"not clear; add --topics .*/a \(sensor_msgs/Image\), /b"):
        open_recording(bag.path, options)
    recording = open_recording(bag.path, ImageOptions(calibration=calibration(tmp_path), topics=("/a", "/c")))
    assert "Topics: /a, /c." in recording.remarks
    for topics, sentence in (
        (("/a", "/d"), "/d is not a topic of images"),
        (("/a", "/c", "/b"), "expected LEFT,RIGHT or LEFT, and IMU after them if any, got /a,/c,/b"),
        (("/a", "/a"), "left and right are both /a"),
    ):
        with pytest.raises(InputError, match=sentence):
            open_recording(bag.path, ImageOptions(calibration=calibration(tmp_path), topics=topics))
    with pytest.raises(InputError, match="needs the calibration of its cameras"):
        open_recording(bag.path)


@pytest.mark.parametrize("kind", KINDS)
def test_one_topic_of_images_is_one_camera(kind: str, room: Room, tmp_path: Path) -> None:
    bag = BagWriter(kind, tmp_path)
    with bag.writer:
        for k, stamp in enumerate(room.stamps):
            bag.image("/cam0/image_raw", stamp, room.image(k))
        for stamp, row in zip(*room.imu(), strict=True):
            bag.imu("/imu0", stamp, row)
    file = calibration(tmp_path)
    recording = open_recording(bag.path, ImageOptions(calibration=file))
    assert "Topics: /cam0/image_raw, /imu0." in recording.remarks
    assert recording.right is None
    images = [pair.left for pair in recording.pairs()]
    assert all((image == room.image(k)).all() for k, image in enumerate(images) if image is not None)
    assert len(images) == N
    assert track(bag.path, ImageOptions(calibration=file)).sequence().monocular


def test_the_left_topic_of_a_pair_alone(room: Room, tmp_path: Path) -> None:
    path, file = stereo_bag("ros1", tmp_path, room), calibration(tmp_path)
    for options in (
        ImageOptions(calibration=file, cameras="left"),
        ImageOptions(calibration=file, topics=("/cam/left/image_raw", "/imu0")),
    ):
        recording = open_recording(path, options)
        assert recording.right is None
        assert recording.imu is not None
        assert "Topics: /cam/left/image_raw, /imu0." in recording.remarks
    with pytest.raises(InputError, match="topics: expected LEFT,RIGHT or LEFT, and IMU after them if any"):
        open_recording(path, ImageOptions(calibration=file, topics=("/imu0", "/cam/left/image_raw")))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("topic", ["/odom", "/pose", "/covariant", "/vicon/body", "/path"])
def test_trajectories_of_a_bag(kind: str, topic: str, room: Room, tmp_path: Path) -> None:
    bag = BagWriter(kind, tmp_path)
    with bag.writer:
        bag.trajectory(room.stamps, room.world_T_imu)
    found = read_trajectory(f"{bag.path}:{topic}")
    write_tum(tmp_path / "same.tum", found.t, found.world_T_body)
    assert found.name == topic.strip("/").replace("/", "-")
    np.testing.assert_array_equal(found.t, np.array([stamp / 10**9 for stamp in room.stamps]))
    np.testing.assert_allclose(found.world_T_body, room.world_T_imu, atol=1e-12)
    covariance = read_bag_trajectory(bag.path, topic, None).covariance()
    assert (covariance is not None) == (topic in ("/odom", "/covariant"))
    if covariance is not None:  # of x, y, z and rotations about them, in the axes that the first pose shares
        np.testing.assert_allclose(covariance[0], np.diag([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]), atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_truth_may_be_a_topic_of_a_bag(kind: str, room: Room, tmp_path: Path) -> None:
    bag = BagWriter(kind, tmp_path)
    with bag.writer:
        bag.trajectory(room.stamps, room.world_T_imu)
    sequence = track(room.write_euroc(tmp_path / "room")).sequence(TruthFile(Path(f"{bag.path}:/odom"), "imu"))
    assert sequence.truth is not None
    assert sequence.truth.source.endswith(":/odom")
    np.testing.assert_allclose(sequence.truth.world_T_imu, room.world_T_imu, atol=1e-9)


def test_topics_of_a_bag_are_compared(room: Room, tmp_path: Path) -> None:
    bag = BagWriter("mcap", tmp_path)
    with bag.writer:
        bag.trajectory(room.stamps, room.world_T_imu)
    topics = [f"{bag.path}:{topic}" for topic in ("/pose", "/odom", "/covariant", "/vicon/body", "/path")]
    result = CliRunner().invoke(group, ["compare", *topics, "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    for name in ("odom", "covariant", "vicon-body", "path"):
        assert name in result.output


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_in_place_of_a_trajectory_is_refused_with_what_to_name(kind: str, room: Room, tmp_path: Path) -> None:
    bag = BagWriter(kind, tmp_path)
    with bag.writer:
        bag.trajectory(room.stamps, room.world_T_imu)
    with pytest.raises(InputError, match=r"not one trajectory; name a topic of the bag, as in run.bag:/odom"):
        read_trajectory(bag.path)


def test_a_ros_2_bag_without_its_description_is_refused_with_what_is_missing(room: Room, tmp_path: Path) -> None:
    path = stereo_bag("mcap", tmp_path, room)
    (path / "metadata.yaml").unlink()
    options = ImageOptions(calibration=calibration(tmp_path))
    with pytest.raises(InputError, match=r"metadata.yaml is missing.*give run.mcap itself"):
        open_recording(path, options)
    assert len(open_recording(path / "run.mcap", options).t) == N


def test_a_topic_without_poses_is_refused_with_those_that_have_them(room: Room, tmp_path: Path) -> None:
    bag = BagWriter("ros1", tmp_path)
    with bag.writer:
        bag.trajectory(room.stamps, room.world_T_imu)
        bag.imu("/imu0", room.stamps[-1], np.zeros(6))
    with pytest.raises(InputError, match=r"/imu0 is of type sensor_msgs/Imu; topics with poses: /covariant, /odom"):
        read_trajectory(f"{bag.path}:/imu0")
    with pytest.raises(InputError, match="/none is not in the bag"):
        read_trajectory(f"{bag.path}:/none")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("with_topic", [False, True])
def test_an_empty_bag_is_refused_as_one(kind: str, with_topic: bool, tmp_path: Path) -> None:
    bag = BagWriter(kind, tmp_path)
    with bag.writer:
        if with_topic:
            bag.writer.add_connection("/odom", "nav_msgs/msg/Odometry", typestore=bag.store)  # type: ignore[attr-defined]
    with pytest.raises(InputError, match=f"{bag.path.name}: the bag has no messages"):
        open_recording(bag.path, ImageOptions(calibration=calibration(tmp_path)))
    with pytest.raises(InputError, match=f"{bag.path.name}: the bag has no messages"):
        read_trajectory(f"{bag.path}:/odom")
