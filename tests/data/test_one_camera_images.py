"""Images of one camera: tracks of rendered images, whose true tracks are known, and every form of recording."""

import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fgbaseline.data import read
from fgbaseline.data.tracking import ImageOptions, MonocularTracker, Pictures, TrackerSettings, Tracks, track
from fgbaseline.data.tracking.rectification import CameraModel, Distortion, rectify
from fgbaseline.data.tracking.sources import open_recording
from fgbaseline.geometry import FloatArray, InputError, MonocularCamera, se3
from fgbaseline.geometry.monocular_camera import left_of
from fgbaseline.reports.cli import group

from ..builders.rendered import CAMERA, IMU_T_CAM, START_NS, Room, camchain_yaml

cv2 = pytest.importorskip("cv2")
N = 12
LEFT = left_of(CAMERA)
WRONG = 2.0
"""px from its true point: a wrong match"""


@pytest.fixture(scope="module")
def room() -> Room:
    return Room(N)


def tracked(room: Room, settings: TrackerSettings) -> list[Tracks]:
    tracker = MonocularTracker(LEFT, settings)
    return [tracker.step(room.image(k)) for k in range(room.n_frames)]


def test_tracks_keep_their_point(room: Room) -> None:
    """Drift from the point of the first frame below 0.05 px a frame; fewer than 1 % of the observations are wrong."""
    first: dict[int, tuple[int, FloatArray]] = {}
    errors, ages = [], []
    for k, found in enumerate(tracked(room, TrackerSettings())):
        assert np.isnan(found.pixel[:, 2:]).all()
        points, _ = room.points(k, found.pixel[:, :2])
        for i, name in enumerate(found.number.tolist()):
            born, point = first.setdefault(name, (k, points[i]))
            errors.append(np.abs(found.pixel[i] - room.project(k, point[None])[0])[:2].max())
            ages.append(k - born)
    error, age = np.array(errors), np.array(ages)
    assert len(error) > N * 150
    assert np.mean(error > WRONG) < 0.01
    right = (age > 3) & (error < WRONG)
    assert np.median(error[right] / age[right]) < 0.05


def test_the_epipolar_constraint_ends_wrong_tracks() -> None:
    """At big steps and without the forward-backward check Lucas-Kanade goes wrong; the constraint ends most of it."""
    room = Room(N)
    room.__dict__["world_T_imu"] = Room.poses_at(0.25 * np.arange(N))
    shares = []
    for gate in (1e3, 1.0):
        found = tracked(room, TrackerSettings(forward_backward=1e3, reprojection_gate=gate, pyramid_levels=1))
        errors = []
        for k, (before, now) in enumerate(pairwise(found)):
            _, i, j = np.intersect1d(before.number, now.number, return_indices=True)
            points, _ = room.points(k, before.pixel[i, :2])
            errors.append(np.abs(now.pixel[j, :2] - room.project(k + 1, points)[:, :2]).max(axis=1))
        shares.append(float(np.mean(np.concatenate(errors) > WRONG)))
    assert shares[0] > 0.02
    assert shares[1] < 0.3 * shares[0]


def test_a_gyroscope_predicts_through_a_fast_turn() -> None:
    room, angle = Room(2), 0.2
    poses = room.world_T_imu.copy()
    poses[1, :2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    room.__dict__["world_T_imu"] = poses
    camera = poses @ IMU_T_CAM
    rotation = (se3.inverse(camera[1]) @ camera[0])[:3, :3]
    kept = []
    for given in (rotation, None):
        tracker = MonocularTracker(LEFT, TrackerSettings(pyramid_levels=2))
        start, end = tracker.step(room.image(0)), tracker.step(room.image(1), rotation=given)
        common = np.isin(end.number, start.number)
        at = np.searchsorted(start.number, end.number[common])
        true = room.project(1, room.points(0, start.pixel[:, :2])[0])[at, :2]
        kept.append(int((np.abs(end.pixel[common, :2] - true).max(axis=1) < WRONG).sum()))
    assert kept[0] > 2 * kept[1]
    assert kept[0] > 50


@pytest.mark.parametrize(
    ("distortion", "coefficients"),
    [(Distortion.RADTAN, (-0.28, 0.07, 2e-4, 2e-5)), (Distortion.EQUIDISTANT, (0.01, -0.02, 0.01, -0.003))],
)
def test_distortion_is_removed(distortion: Distortion, coefficients: tuple[float, ...]) -> None:
    """A pixel of the undistorted image shows what the camera model has in the direction of its ray."""
    model = CameraModel((458.0, 457.0, 367.0, 248.0), distortion, coefficients, (752, 480), IMU_T_CAM)
    rectified = rectify(model, None)
    camera = rectified.camera
    assert isinstance(camera, MonocularCamera)
    assert rectified.maps is not None
    u, v = np.meshgrid(np.arange(752, dtype=np.float32), np.arange(480, dtype=np.float32))
    shown = np.stack([cv2.remap(axis, *rectified.maps[0], cv2.INTER_LINEAR) for axis in (u, v)], axis=2)
    at = np.stack(np.meshgrid(np.arange(40, 712, 60), np.arange(40, 440, 60)), axis=2).reshape(-1, 2)
    ray = np.column_stack([(at - [camera.cu, camera.cv]) / [camera.fu, camera.fv], np.ones(len(at))])
    project = cv2.fisheye.projectPoints if distortion is Distortion.EQUIDISTANT else cv2.projectPoints
    zero = np.zeros((3, 1))
    expected = project(ray[:, None], zero, zero, model.K, np.array(coefficients))[0][:, 0]
    np.testing.assert_allclose(shown[at[:, 1], at[:, 0]], expected, atol=0.05)


def assert_one_camera(file: Path, folder: Path) -> None:
    """The file has the tracks of the folder's left images."""
    found, direct = read(file), track(folder, ImageOptions(cameras="left"))
    assert found.monocular
    assert np.isnan(found.observations.pixel[:, 2:]).all()
    assert found.observations.pixel.tobytes() == direct.observations.pixel.tobytes()


def test_cam0_alone_and_the_left_camera_of_a_pair_have_the_same_tracks(euroc: Path, written: Path) -> None:
    left, out = euroc.parent / "left.npz", euroc.parent / "alone.npz"
    runner = CliRunner()
    result = runner.invoke(group, ["track", str(written), "--cameras", "left", "--out", str(left)])
    assert result.exit_code == 0, result.output
    assert "One camera: its tracks have no right pixels" in result.output
    shutil.rmtree(euroc / "mav0" / "cam1")
    assert runner.invoke(group, ["track", str(euroc), "--out", str(out)]).exit_code == 0
    for file in (left, out):
        assert_one_camera(file, written)
    with pytest.raises(InputError, match=r"cameras: .*room_01 has one camera; leave out --cameras stereo"):
        open_recording(euroc, ImageOptions(cameras="stereo"))
    shutil.rmtree(euroc / "mav0" / "imu0")
    with pytest.raises(InputError, match="only raw inertial samples determine the scale; add --imu CSV"):
        track(euroc, motion=True)


def test_damaged_images_of_one_camera_are_left_out(euroc: Path) -> None:
    files = sorted((euroc / "mav0" / "cam0" / "data").iterdir())
    files[3].write_bytes(b"\x89PNG")
    found = track(euroc, ImageOptions(cameras="left"))
    assert f"1 image of {N} cannot be read: {files[3]}; left out." in found.recording.remarks
    assert found.left_out == (3,)


def test_a_kitti_folder_with_its_left_camera(euroc: Path, tmp_path: Path) -> None:
    folder = tmp_path / "06"
    (folder / "image_0").mkdir(parents=True)
    for k, file in enumerate(sorted((euroc / "mav0" / "cam0" / "data").iterdir())):
        shutil.copy(file, folder / "image_0" / f"{k:06d}.png")
    row = f"{CAMERA.fu} 0 {CAMERA.cu} {{}} 0 {CAMERA.fv} {CAMERA.cv} 0 0 0 1 0"
    (folder / "calib.txt").write_text(f"P0: {row.format(0)}\nP1: {row.format(-CAMERA.fu * CAMERA.baseline)}\n")
    (folder / "times.txt").write_text("\n".join(str(k / 20) for k in range(N)))
    with pytest.raises(InputError, match="image_1 is missing"):
        open_recording(folder)
    found = track(folder, ImageOptions(cameras="left"))
    found.write(tmp_path / "06.npz")
    assert isinstance(found.camera, MonocularCamera)
    samples, extrinsic = tmp_path / "imu.csv", tmp_path / "imu_T_cam.txt"
    stamps, rows = Room(N).imu()
    lines = [[(at - START_NS) / 1e9, *row] for at, row in zip(stamps, rows.tolist(), strict=True)]
    samples.write_text("\n".join(",".join(map(repr, line)) for line in lines))
    extrinsic.write_text(" ".join(map(repr, IMU_T_CAM[:3].ravel().tolist())))
    back = read(tmp_path / "06.npz", imu=samples, extrinsic=extrinsic)
    assert back.monocular
    assert back.observations.pixel.tobytes() == found.observations.pixel.tobytes()


@pytest.mark.parametrize("form", ["kalibr", "opencv"])
def test_one_folder_with_a_calibration(euroc: Path, tmp_path: Path, form: str) -> None:
    file, folder = tmp_path / "calibration.yaml", euroc / "mav0" / "cam0" / "data"
    if form == "kalibr":
        file.write_text(camchain_yaml().split("cam1:")[0])
    else:
        storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
        storage.write("camera_matrix", LEFT.K)
        storage.write("distortion_coefficients", np.zeros((5, 1)))
        storage.release()
    with pytest.raises(InputError, match="add --right FOLDER, or --cameras left for one"):
        open_recording(folder, ImageOptions(calibration=file))
    recording = open_recording(folder, ImageOptions(calibration=file, cameras="left"))
    assert recording.right is None
    assert recording.extrinsic_known == (form == "kalibr")
    assert recording.left.intrinsics == (CAMERA.fu, CAMERA.fv, CAMERA.cu, CAMERA.cv)
    images = [pair.left for pair in recording.pairs()]
    assert len(images) == N
    assert all(image is not None for image in images)
    with pytest.raises(InputError, match=r"right: .* is given with --cameras left"):
        open_recording(folder, ImageOptions(calibration=file, cameras="left", right=folder))


def test_pictures_of_one_camera_are_one_a_frame(room: Room) -> None:
    pictures = Pictures()
    pictures.add(0, 0.0, room.image(0))
    assert [len(each.images) for each in pictures.pairs.values()] == [1]
