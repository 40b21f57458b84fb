"""Recordings of images in every form that is read, written from rendered images: what is found, and what is refused."""

import shutil
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fgbaseline.data import Sequence, read
from fgbaseline.data.formats import write_npz
from fgbaseline.data.tracking import ImageOptions, TrackerSettings, track
from fgbaseline.data.tracking.pipeline import opened_images, track_images
from fgbaseline.data.tracking.sources import ImageRecording, open_recording
from fgbaseline.geometry import InputError
from fgbaseline.reports.cli import group

from ..builders.rendered import CAMERA, IMU_T_CAM, START_NS, Room, camchain_yaml, displaced, sensor_yaml

cv2 = pytest.importorskip("cv2")
N = 6


@pytest.fixture(scope="module")
def room() -> Room:
    return Room(N)


def tum_vi(euroc: Path, shift: float = 0.0) -> Path:
    for i in (0, 1):
        (euroc / "mav0" / f"cam{i}" / "sensor.yaml").unlink()
    (euroc / "dso").mkdir()
    (euroc / "dso" / "camchain.yaml").write_text(camchain_yaml(shift, model="equidistant"))
    (euroc / "mav0" / "state_groundtruth_estimate0").rename(euroc / "mav0" / "mocap0")
    return euroc


def kitti_odometry(euroc: Path, folder: Path) -> Path:
    for i in (0, 1):
        (folder / f"image_{i}").mkdir(parents=True)
        for k, file in enumerate(sorted((euroc / "mav0" / f"cam{i}" / "data").iterdir())):
            shutil.copy(file, folder / f"image_{i}" / f"{k:06d}.png")
    row = f"{CAMERA.fu} 0 {CAMERA.cu} {{}} 0 {CAMERA.fv} {CAMERA.cv} 0 0 0 1 0"
    (folder / "calib.txt").write_text(f"P0: {row.format(0)}\nP1: {row.format(-CAMERA.fu * CAMERA.baseline)}\n")
    (folder / "times.txt").write_text("\n".join(str(k / 20) for k in range(N)))
    return folder


def check(recording: ImageRecording, room: Room) -> None:
    np.testing.assert_allclose(recording.t, np.array(room.stamps) / 1e9, atol=1e-6)
    np.testing.assert_allclose(recording.left.imu_T_cam, IMU_T_CAM, atol=1e-9)
    assert recording.right is not None
    np.testing.assert_allclose(recording.right.imu_T_cam, displaced(1), atol=1e-9)
    pairs = list(recording.pairs())
    assert len(pairs) == N
    assert pairs[2].left is not None
    assert pairs[2].right is not None
    assert (pairs[2].left == room.image(2)).all()
    assert (pairs[2].right == room.image(2, right=True)).all()


@pytest.mark.parametrize("inside", ["", "mav0"])
def test_euroc(euroc: Path, room: Room, inside: str) -> None:
    recording = open_recording(euroc / inside)
    assert recording.name == "room_01"
    assert recording.remarks == ()
    check(recording, room)
    sequence = track(euroc / inside).sequence()
    assert sequence.imu is not None
    assert sequence.truth is not None
    true = room.world_T_imu
    np.testing.assert_allclose(sequence.truth.world_T_imu, true, atol=1e-12)


def test_tracks_read_back_as_they_were_written(euroc: Path, tmp_path: Path) -> None:
    found = track(euroc)
    found.write(tmp_path / "tracks.npz")
    sequence, back = found.sequence(), read(tmp_path / "tracks.npz")
    assert_equal_tracks(back, sequence)
    assert back.imu is not None
    assert sequence.imu is not None
    assert back.imu.angular_velocity.tobytes() == sequence.imu.angular_velocity.tobytes()
    track(euroc).write(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "tracks.npz").read_bytes()
    write_npz(sequence, tmp_path / "dense.npz")
    assert_equal_tracks(read(tmp_path / "dense.npz"), back)


def assert_equal_tracks(first: Sequence, second: Sequence) -> None:
    assert first.t.tobytes() == second.t.tobytes()
    for name in ("frame", "landmark", "pixel"):
        assert getattr(first.observations, name).tobytes() == getattr(second.observations, name).tobytes()


def test_truth_that_starts_late(euroc: Path, room: Room) -> None:
    file = euroc / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([lines[0], *lines[3:]]))
    truth = track(euroc).sequence().truth
    assert truth is not None
    assert truth.known.tolist() == [False, False, *[True] * (N - 2)]


def test_tum_vi(euroc: Path, room: Room) -> None:
    """16-bit images, an equidistant chain under dso/, and stamps of the cameras moved by its time shift."""
    for i in (0, 1):
        for file in (euroc / "mav0" / f"cam{i}" / "data").iterdir():
            cv2.imwrite(str(file), cv2.imread(str(file), 0).astype(np.uint16) * 257)
    recording = open_recording(tum_vi(euroc, shift=0.0123))
    assert any("+12.300 ms" in remark for remark in recording.remarks)
    unshifted = recording.t - 0.0123
    assert unshifted[0] == pytest.approx(START_NS / 1e9, abs=1e-6)
    pair = next(recording.pairs())
    assert pair.left is not None
    assert (pair.left == room.image(0)).all()
    assert recording.imu is not None
    assert track(euroc).sequence().truth is not None


def test_images_of_16_bits_that_get_brighter_are_not_clipped(euroc: Path, room: Room) -> None:
    """A first image of 10 bits before images of 14: the 8 bits are the uppermost of the brightest so far."""
    images = sorted((euroc / "mav0" / "cam0" / "data").iterdir())
    for k, file in enumerate(images):
        bits = (10, 14, 12)[k % 3]
        cv2.imwrite(str(file), cv2.imread(str(file), 0).astype(np.uint16) << (bits - 8))
    for k, pair in enumerate(open_recording(euroc).pairs()):
        assert pair.left is not None
        assert (pair.left == room.image(k) >> (2 if k and k % 3 == 2 else 4 if k and k % 3 == 0 else 0)).all()


def test_a_time_shift_is_added_to_the_cameras_stamps(euroc: Path) -> None:
    """Kalibr: t_imu = t_cam + timeshift_cam_imu."""
    before = open_recording(euroc).t
    np.testing.assert_allclose(open_recording(tum_vi(euroc, -0.02)).t, before - 0.02, atol=1e-6)


def test_kitti_odometry_has_no_motion(euroc: Path, tmp_path: Path, room: Room) -> None:
    folder = kitti_odometry(euroc, tmp_path / "06")
    with pytest.raises(InputError, match="images and no motion; add --imu CSV or --velocities"):
        track(folder, motion=True)
    found = track(folder)
    found.write(tmp_path / "06.npz")
    with pytest.raises(InputError, match="tracks and no motion"):
        read(tmp_path / "06.npz")
    velocities = tmp_path / "velocities.csv"
    velocities.write_text("\n".join(f"{k / 20},0.6,0,0,0,0,{0.16 * np.cos(k / 10)}" for k in range(N)))
    with pytest.raises(InputError, match="not known; add --extrinsic"):
        read(tmp_path / "06.npz", velocities=velocities)
    extrinsic = tmp_path / "imu_T_cam.txt"
    extrinsic.write_text(" ".join(map(repr, IMU_T_CAM[:3].ravel().tolist())))
    sequence = read(tmp_path / "06.npz", velocities=velocities, extrinsic=extrinsic)
    options = ImageOptions(velocities=velocities, extrinsic=extrinsic)
    assert sequence.linear_velocity[:, 0].tolist() == [0.6] * N
    direct = track(folder, options, motion=True).sequence()
    np.testing.assert_array_equal(direct.imu_T_cam, sequence.imu_T_cam)
    np.testing.assert_array_equal(direct.linear_velocity, sequence.linear_velocity)


def test_memory_grows_with_the_observations_and_not_with_the_images(euroc: Path, tmp_path: Path) -> None:
    """Peaks of 6 and 36 frames, in bytes: what is between them is at most 150 for each observation."""
    folder = kitti_odometry(euroc, tmp_path / "06")
    images = [sorted((folder / f"image_{i}").iterdir()) for i in (0, 1)]

    def peak() -> tuple[int, int]:
        tracemalloc.start()
        found = track(folder, settings=TrackerSettings(max_features=60))
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most, len(found.observations)

    peak()  # what is imported and set up once
    few = peak()
    for side in images:
        for k in range(N, 6 * N):
            (side[0].parent / f"{k:06d}.png").symlink_to(side[min(k % 10, 10 - k % 10)])
    (folder / "times.txt").write_text("\n".join(str(k / 20) for k in range(6 * N)))
    many = peak()
    assert many[1] > 5 * few[1]
    assert many[0] - few[0] < 150 * (many[1] - few[1])


def test_kitti_raw(recordings: Callable[[str], Path]) -> None:
    """Velocities and poses of one unit agree with each other, and with the cameras."""
    file = "kitti_images/raw_2011_09_26_drive_0002/2011_09_26/calib_cam_to_cam.txt"
    sequence = track(recordings(file).parent).sequence()
    assert any("one unit" in remark or "both from the OXTS unit" in remark for remark in sequence.remarks)
    assert sequence.truth is not None
    steps = np.diff(sequence.truth.world_T_imu[:, :3, 3], axis=0)
    predicted = np.einsum("tij,tj->ti", sequence.truth.world_T_imu[:-1, :3, :3], sequence.linear_velocity[:-1])
    np.testing.assert_allclose(steps, predicted * sequence.dt[:, None], atol=0.015)
    assert abs(sequence.imu_T_cam[0, 3] - 1.08) < 0.02  # the camera is 1.08 m ahead of the unit


@pytest.mark.parametrize("form", ["kalibr", "opencv"])
def test_two_folders(euroc: Path, room: Room, tmp_path: Path, form: str) -> None:
    file = tmp_path / "calibration.yaml"
    if form == "kalibr":
        file.write_text(camchain_yaml())
    else:
        storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
        K = np.array([[CAMERA.fu, 0, CAMERA.cu], [0, CAMERA.fv, CAMERA.cv], [0, 0, 1]])
        T = np.array([[-CAMERA.baseline], [0], [0]])
        for key, value in (("M1", K), ("D1", np.zeros((1, 14))), ("M2", K), ("D2", np.zeros((1, 5)))):
            storage.write(key, value)
        storage.write("R", np.eye(3))
        storage.write("T", T)
        storage.release()
    left, right = (euroc / "mav0" / f"cam{i}" / "data" for i in (0, 1))
    recording = open_recording(left, ImageOptions(right=right, calibration=file))
    assert recording.extrinsic_known == (form == "kalibr")
    assert recording.right is not None
    baseline = np.linalg.inv(recording.left.imu_T_cam) @ recording.right.imu_T_cam
    np.testing.assert_allclose(baseline[:3, 3], [CAMERA.baseline, 0, 0], atol=1e-12)
    assert len(list(recording.pairs())) == N
    for file in (*left.iterdir(), *right.iterdir()):
        file.rename(file.with_name(f"frame_{int(file.stem) - START_NS}.png"))
    with pytest.raises(InputError, match="not stamps; add --times"):
        open_recording(left, ImageOptions(right=right, calibration=tmp_path / "calibration.yaml"))


def test_damaged_and_missing_images_are_counted_and_named(euroc: Path, room: Room) -> None:
    left, right = (sorted((euroc / "mav0" / f"cam{i}" / "data").iterdir()) for i in (0, 1))
    left[1].write_bytes(left[1].read_bytes()[:2000])
    right[3].unlink()
    found = track(euroc)
    remarks = " ".join(found.recording.remarks)
    assert f"1 pair of {N - 1} cannot be read: {left[1]}; left out." in remarks
    assert f"cam1/data.csv: 1 image of {N} not found: skipped." in remarks
    assert "1 image without a partner: skipped (6 on the left, 5 on the right)." in remarks
    kept = [0, 2, 4, 5]
    np.testing.assert_allclose(found.recording.t, np.array(room.stamps)[kept] / 1e9, atol=1e-6)
    truth = found.sequence().truth
    assert truth is not None
    np.testing.assert_allclose(truth.world_T_imu, room.world_T_imu[kept], atol=1e-12)


def test_up_is_that_of_the_first_frame_that_can_be_read(euroc: Path, room: Room) -> None:
    for k, left in enumerate(sorted((euroc / "mav0" / "cam0" / "data").iterdir())[:3]):
        left.write_bytes(b"") if k != 1 else left.unlink()
    up = np.array([0.6, 0.0, 0.8])
    found = track_images(replace(opened_images(euroc, ImageOptions()), up_imu=up), TrackerSettings(), None, None)
    first = int(np.argmin(np.abs(np.array(room.stamps) / 1e9 - found.recording.t[0])))
    assert first == 3
    turn = room.world_T_imu[first, :3, :3].T @ room.world_T_imu[0, :3, :3]
    assert np.linalg.norm(turn @ up - up) > 0.01
    np.testing.assert_allclose(found.sequence().up_imu, turn @ up, atol=1e-3)


@pytest.mark.parametrize(
    ("missing", "sentence"),
    [
        ("cam0", "the folder cam0 is missing"),
        ("cam0/sensor.yaml", r"cam0/sensor.yaml: the file is missing; add it, or Kalibr's camchain.yaml"),
        ("cam1/data", "cam1/data: it cannot be read"),
        ("imu0", r"imu0/data.csv missing: it has images and no motion; add --imu"),
    ],
)
def test_what_is_almost_euroc_is_refused_with_what_is_missing(euroc: Path, missing: str, sentence: str) -> None:
    place = euroc / "mav0" / missing
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    with pytest.raises(InputError, match=sentence):
        track(euroc, motion=True)


@pytest.mark.parametrize("missing", ["image_1", "calib.txt", "times.txt"])
def test_what_is_almost_kitti_is_refused_with_what_is_missing(euroc: Path, tmp_path: Path, missing: str) -> None:
    place = kitti_odometry(euroc, tmp_path / "06") / missing
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    with pytest.raises(InputError, match=f"{missing} is missing"):
        open_recording(tmp_path / "06")


def test_the_color_images_of_kitti_are_refused_with_what_is_missing(euroc: Path, tmp_path: Path) -> None:
    folder = kitti_odometry(euroc, tmp_path / "06")
    for i in (0, 1):
        (folder / f"image_{i}").rename(folder / f"image_{i + 2}")
    with pytest.raises(InputError, match="image_0 is missing; a KITTI odometry folder has"):
        open_recording(folder)


@pytest.mark.parametrize(
    ("missing", "sentence"),
    [
        ("2011_09_26_drive_0002_sync/image_00", r"image_00/data is missing; a KITTI raw drive has image_00"),
        ("2011_09_26_drive_0002_sync/oxts", r"oxts/data missing: it has images and no motion; add --imu"),
        ("calib_imu_to_velo.txt", r"calib_imu_to_velo.txt missing: it has images and no motion; add --imu"),
    ],
)
def test_the_motion_of_a_kitti_drive_is_refused_with_what_is_missing(
    recordings: Callable[[str], Path], tmp_path: Path, missing: str, sentence: str
) -> None:
    day = recordings("kitti_images/raw_2011_09_26_drive_0002/2011_09_26/calib_cam_to_cam.txt").parent
    folder = Path(shutil.copytree(day, tmp_path / day.name))
    shutil.rmtree(folder / missing) if (folder / missing).is_dir() else (folder / missing).unlink()
    with pytest.raises(InputError, match=sentence):
        opened_images(folder, ImageOptions(), motion=True)


@pytest.mark.parametrize(("text", "got"), [("1 2 3", "a line of 3"), ("", "0 lines"), ("1\n2\n", "2 lines")])
def test_an_extrinsic_that_is_none_is_refused(euroc: Path, tmp_path: Path, text: str, got: str) -> None:
    file = tmp_path / "imu_T_cam.txt"
    file.write_text(text)
    with pytest.raises(InputError, match=f"imu_T_cam.txt: expected imu_T_cam in one line of 12 numbers, got {got}"):
        open_recording(euroc, ImageOptions(extrinsic=file))


def test_exchanged_cameras_are_refused(euroc: Path, tmp_path: Path) -> None:
    """The images do, the calibration does not: no point has a positive disparity."""
    cameras = [euroc / "mav0" / f"cam{i}" / "data" for i in (0, 1)]
    for source, target in ((cameras[0], tmp_path / "x"), (cameras[1], cameras[0]), (tmp_path / "x", cameras[1])):
        source.rename(target)
    with pytest.raises(InputError, match="no point is tracked from one pair to the next; check that left and right"):
        track(euroc)


def test_tracks_are_written_as_npz(euroc: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(group, ["track", str(euroc), "--out", str(tmp_path / "tracks.txt")])
    assert isinstance(result.exception, InputError)
    assert "tracks are written as .npz" in str(result.exception)


def test_a_calibration_of_other_images_is_refused(euroc: Path) -> None:
    for i in (0, 1):
        text = sensor_yaml(displaced(i)).replace("[320, 240]", "[640, 480]")
        (euroc / "mav0" / f"cam{i}" / "sensor.yaml").write_text(text)
    with pytest.raises(InputError, match="the image has 320x240 px and the calibration 640x480"):
        track(euroc)


def test_a_folder_beside_a_recording_is_refused_with_its_place(euroc: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no recording in this folder; give .*/room_01$"):
        open_recording(euroc.parent)
    for inside in ("cam0", "cam0/data"):
        with pytest.raises(InputError, match=r"no recording in this folder; give .*/room_01/mav0$"):
            open_recording(euroc / "mav0" / inside)
    archive = tmp_path / "room.zip"
    archive.write_bytes(b"PK\x03\x04" + bytes(30))
    with pytest.raises(InputError, match=r"room.zip: it is packed; unpack it and give its folder"):
        open_recording(archive)


def test_a_table_that_lists_other_images_is_refused_with_both_names(euroc: Path) -> None:
    for file in (euroc / "mav0" / "cam1" / "data").iterdir():
        file.rename(file.with_suffix(".jpg"))
    with pytest.raises(InputError, match=rf"none of its {N} images, such as {START_NS}.png, is in .*{START_NS}.jpg"):
        open_recording(euroc)


@pytest.mark.parametrize("place", ["state_groundtruth_estimate0", "imu0"])
def test_truth_and_samples_are_checked_before_the_images_are_read(
    euroc: Path, place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fgbaseline.data.tracking.sources.image_files.decoded", None)
    file = euroc / "mav0" / place / "data.csv"
    file.write_text(file.read_text().splitlines()[0])
    what = "poses" if place != "imu0" else "samples"
    with pytest.raises(InputError, match=f"^{file}: the file has no {what} in it"):
        track(euroc)
    file.write_text("1,2\n")
    with pytest.raises(InputError, match=f"^{file}: line 1: (expected|it has 2 fields)"):
        track(euroc)


def test_other_folders_are_refused_with_the_forms(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no recording in this folder; expected a EuRoC folder"):
        open_recording(tmp_path)


def test_without_opencv_one_sentence_says_what_to_install(euroc: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    with pytest.raises(InputError, match=r"pip install 'fgbaseline\[images\]'"):
        track(euroc)


def test_track_writes_a_recording(euroc: Path, tmp_path: Path) -> None:
    out = tmp_path / "tracks.npz"
    settings = tmp_path / "tracker.toml"
    settings.write_text("max_features = 50\n")
    arguments = ["track", str(euroc), "--out", str(out), "--settings", str(settings)]
    result = CliRunner().invoke(group, arguments)
    assert result.exit_code == 0, result.output
    assert "frames a track" in result.output
    assert np.bincount(read(out).observations.frame).max() <= 50
    again = CliRunner().invoke(group, arguments)
    assert isinstance(again.exception, InputError)
