"""The stereo front end on rendered images, whose true tracks are known, and on real ones."""

import json
import tempfile
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from fgbaseline.data import Observations, Sequence
from fgbaseline.data.formats.recordings.npz_writer import write_tracks
from fgbaseline.data.observations import IntArray
from fgbaseline.data.tracking import Pictures, StereoTracker, TrackerSettings, Tracks, track
from fgbaseline.data.tracking.rectification import CameraModel, Distortion, rectify
from fgbaseline.data.tracking.sources.image_files import EightBits
from fgbaseline.data.tracking.track_file import TrackFile
from fgbaseline.diagnosis import diagnose, track_statistics
from fgbaseline.geometry import FloatArray, InputError, MeasurementModel, StereoCamera, se3
from fgbaseline.geometry.measurement_model import three_rows
from fgbaseline.geometry.triangulation import triangulate_tracks

from ..builders.rendered import CAMERA, IMU_T_CAM, Room

pytest.importorskip("cv2")
WRONG = 2.0
"""px from its true point: a wrong match"""


@pytest.fixture(scope="module")
def room() -> Room:
    return Room(12)


@pytest.fixture(scope="module")
def images(room: Room) -> list[tuple[FloatArray, FloatArray]]:
    return [(room.image(k), room.image(k, right=True)) for k in range(room.n_frames)]


@pytest.fixture(scope="module")
def tracked(images: list[tuple[FloatArray, FloatArray]]) -> list[tuple[FloatArray, FloatArray]]:
    tracker = StereoTracker(CAMERA)
    return [(found.number, found.pixel) for found in (tracker.step(*pair) for pair in images)]


def test_tracks_keep_their_point(room: Room, tracked: list[tuple[FloatArray, FloatArray]]) -> None:
    """Drift from the point of the first frame below 0.05 px a frame; fewer than 1 % of the observations are wrong."""
    first: dict[int, tuple[int, FloatArray]] = {}
    errors, ages = [], []
    for k, (number, pixel) in enumerate(tracked):
        points, _ = room.points(k, pixel[:, :2])
        for i, name in enumerate(number.tolist()):
            born, point = first.setdefault(name, (k, points[i]))
            errors.append(np.abs(pixel[i] - room.project(k, point[None])[0]).max())
            ages.append(k - born)
    error, age = np.array(errors), np.array(ages)
    assert len(error) > 12 * 150
    assert np.mean(error > WRONG) < 0.01
    right = (age > 3) & (error < WRONG)
    assert right.sum() > 300
    assert np.median(error[right] / age[right]) < 0.05


def test_right_pixels_belong_to_the_left_ones(room: Room, tracked: list[tuple[FloatArray, FloatArray]]) -> None:
    for k, (_, pixel) in enumerate(tracked):
        true = room.project(k, room.points(k, pixel[:, :2])[0])
        off = np.abs(true - pixel).max(axis=1)
        assert np.median(off) < 0.1
        assert np.mean(off > WRONG) < 0.01


def test_tracks_are_deterministic_and_end_for_good(
    images: list[tuple[FloatArray, FloatArray]], tracked: list[tuple[FloatArray, FloatArray]]
) -> None:
    again = StereoTracker(CAMERA)
    for pair, (number, pixel) in zip(images, tracked, strict=True):
        found = again.step(*pair)
        assert found.number.tobytes() == number.tobytes()
        assert found.pixel.tobytes() == pixel.tobytes()
    ended: set[int] = set()
    for (before, _), (now, _) in pairwise(tracked):
        ended |= set(before.tolist()) - set(now.tolist())
        assert not ended & set(now.tolist())


def test_a_gyroscope_predicts_through_a_fast_turn(room: Room) -> None:
    """A turn of 0.2 rad between two frames: with its prediction most points are found again, without it few."""
    turned = Room(2)
    poses = turned.world_T_imu.copy()
    angle = 0.2
    poses[1, :2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turned.__dict__["world_T_imu"] = poses
    camera = [pose @ IMU_T_CAM for pose in poses]
    rotation = (se3.inverse(camera[1]) @ camera[0])[:3, :3]
    kept = []
    for given in (rotation, None):
        tracker = StereoTracker(CAMERA, TrackerSettings(pyramid_levels=2))
        start = tracker.step(turned.image(0), turned.image(0, right=True))
        end = tracker.step(turned.image(1), turned.image(1, right=True), rotation=given)
        common = np.isin(end.number, start.number)
        true = turned.project(1, turned.points(0, start.pixel[:, :2])[0])
        at = np.searchsorted(start.number, end.number[common])
        kept.append(int((np.abs(end.pixel[common] - true[at]).max(axis=1) < WRONG).sum()))
    assert kept[0] > 2 * kept[1]
    assert kept[0] > 50


@pytest.mark.parametrize(("interval", "levels"), [(0.25, 1), (0.4, 4)])
def test_the_diagnosis_counts_the_wrong_matches(interval: float, levels: int) -> None:
    """With the checks off Lucas-Kanade goes wrong in big steps; with them on, at the same steps, it does not."""
    room = Room(12)
    t = interval * np.arange(room.n_frames)
    room.__dict__["world_T_imu"] = Room.poses_at(t)
    images = [(room.image(k), room.image(k, right=True)) for k in range(room.n_frames)]
    off = TrackerSettings(forward_backward=1e3, row_gate=1e3, reprojection_gate=1e3, pyramid_levels=levels)
    for settings in (off, TrackerSettings()):
        tracker = StereoTracker(CAMERA, settings)
        found = [tracker.step(*pair) for pair in images]
        true = wrong_share(room, found)
        frame = np.repeat(np.arange(room.n_frames), [len(tracks.number) for tracks in found])
        _, landmark = np.unique(np.concatenate([tracks.number for tracks in found]), return_inverse=True)
        observations = Observations.sort(frame, landmark, np.concatenate([tracks.pixel for tracks in found]))
        twist = se3.log(se3.relative(room.world_T_imu)) / interval
        twist = np.vstack([twist, twist[-1:]])
        n_landmarks = int(landmark.max()) + 1
        recording = Sequence("room", t, twist[:, :3], twist[:, 3:], CAMERA, IMU_T_CAM, observations, n_landmarks)
        tracks = track_statistics(diagnose(recording))
        counted = tracks.wrong.sum() / tracks.matches.sum()
        if settings is off:
            assert 0.01 < true < 0.1
            assert 0.5 * true < counted < 2.0 * true
        else:
            assert true < 0.001
            assert counted < 0.001


def wrong_share(room: Room, found: list[Tracks]) -> float:
    """Share of the steps from frame to frame that end more than `WRONG` px from the point they began at."""
    errors = []
    for k, (before, now) in enumerate(pairwise(found)):
        _, i, j = np.intersect1d(before.number, now.number, return_indices=True)
        points, _ = room.points(k, before.pixel[i, :2])
        errors.append(np.abs(now.pixel[j] - room.project(k + 1, points)).max(axis=1))
    return float(np.mean(np.concatenate(errors) > WRONG))


def test_cameras_of_different_exposure_match(room: Room, images: list[tuple[FloatArray, FloatArray]]) -> None:
    """The right image at 60 % of the brightness: nine tenths of the matches of equal exposure are there, and right."""
    left, right = images[0]
    darker = np.rint(0.6 * right).astype(np.uint8)
    equal, found = (StereoTracker(CAMERA).step(left, other) for other in (right, darker))
    assert len(found.number) > 0.9 * len(equal.number) > 100
    true = room.project(0, room.points(0, found.pixel[:, :2])[0])
    assert np.median(np.abs(true - found.pixel).max(axis=1)) < 0.1


def test_tracks_go_on_where_a_lamp_changes_the_scale_of_16_bits(images: list[tuple[FloatArray, FloatArray]]) -> None:
    """The second image has twelve bits in place of ten, and a quarter of the brightness in 8: most tracks go on."""
    kept = []
    for lamp in (0, 4000):
        tracker, convert, found = StereoTracker(CAMERA), (EightBits(), EightBits()), []
        for k, pair in enumerate(images[:2]):
            raw = [image.astype(np.uint16) << 2 for image in pair]
            for image in raw:
                image[:20, :20] = max(lamp * k, 1000)
            left, right = (to(image) for to, image in zip(convert, raw, strict=True))
            assert left is not None
            assert right is not None
            assert (left[30:] == images[k][0][30:] >> (2 if lamp * k else 0)).all()
            found.append(tracker.step(left, right))
        kept.append(int(np.isin(found[1].number, found[0].number).sum()))
    assert kept[1] > 0.9 * kept[0] > 50


def test_pictures_are_thinned_evenly_to_their_size(images: list[tuple[FloatArray, FloatArray]]) -> None:
    t = 0.05 * np.arange(len(images))
    whole = Pictures()
    for k, pair in enumerate(images):
        whole.add(k, float(t[k]), *pair)
    assert list(whole.pairs) == list(range(len(images)))
    most = sum(pair.n_bytes for pair in whole.pairs.values()) // 3
    some = Pictures(most_bytes=most)
    for k, pair in enumerate(images):
        some.add(k, float(t[k]), *pair)
    assert some.step == 4
    assert sum(pair.n_bytes for pair in some.pairs.values()) <= most
    assert {k: pair.images for k, pair in some.by_frame(t[2:]).items()} == {
        k - 2: whole.pairs[k].images for k in (4, 8)
    }


TUM_VI = (
    CameraModel(
        (190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504),
        Distortion.EQUIDISTANT,
        (0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182),
        (512, 512),
        np.eye(4),
    ),
    CameraModel(
        (190.44236969414825, 190.4344384721956, 252.59949716835982, 254.91723064636983),
        Distortion.EQUIDISTANT,
        (0.0034003170790442797, 0.001766278153469831, -0.00266312569781606, 0.0003299517423931039),
        (512, 512),
        se3.exp([0.10106343, 0.00194620, 0.00101536, -0.04691, 0.000677, -0.000809]),
    ),
)
"""the calibration that TUM-VI publishes for its images of 512 x 512 px; poses on the left camera"""


def kannala_brandt(model: CameraModel, points: FloatArray) -> FloatArray:
    """Pixels (n, 2) of points (n, 3) in the camera's frame: r = theta (1 + k1 theta^2 + ... + k4 theta^8)."""
    radius = np.hypot(points[:, 0], points[:, 1])
    theta = np.arctan2(radius, points[:, 2])
    distorted = theta * (1.0 + sum(k * theta ** (2 * i + 2) for i, k in enumerate(model.coefficients)))
    fu, fv, cu, cv = model.intrinsics
    return points[:, :2] / radius[:, None] * distorted[:, None] * [fu, fv] + [cu, cv]


@pytest.mark.parametrize("coefficients", ["published", "zero"])
def test_a_rectified_fisheye_pair_sees_the_same_points_in_one_row(coefficients: str) -> None:
    """At each rectified pixel lies the pixel of the raw image that sees the same point; the middle stays as sharp."""
    left, right = (
        model if coefficients == "published" else replace(model, coefficients=(0.0, 0.0, 0.0, 0.0)) for model in TUM_VI
    )
    rectified = rectify(left, right)
    camera, maps = rectified.camera, rectified.maps
    assert maps is not None
    assert abs(camera.fu - left.intrinsics[0]) < 1.0
    random = np.random.default_rng(0)
    uv, disparity = random.integers(60, 450, (200, 2)), random.integers(1, 40, 200)
    points = camera.triangulate(np.column_stack([uv, uv - np.column_stack([disparity, 0 * disparity])]).astype(float))
    on_imu = se3.transform(rectified.imu_T_cam, points)
    for model, (whole, part), u in ((left, maps[0], uv[:, 0]), (right, maps[1], uv[:, 0] - disparity)):
        raw = kannala_brandt(model, se3.transform(se3.inverse(model.imu_T_cam), on_imu))
        inside = ((raw > 1.0) & (raw < 510.0)).all(axis=1)
        assert inside.mean() > 0.9
        v, u = uv[inside, 1], u[inside]
        mapped = whole[v, u] + np.column_stack(np.divmod(part[v, u], 32)[::-1]) / 32.0  # OpenCV's fixed point
        np.testing.assert_allclose(mapped, raw[inside], atol=0.05)


def kept_tracks(n_frames: int, per_frame: int, seed: int = 0) -> tuple[TrackFile, list[Tracks]]:
    """Tracks of random lengths, a tenth of them of one frame."""
    random, file, frames = np.random.default_rng(seed), TrackFile(), []
    number, following = np.arange(per_frame), per_frame
    for _ in range(n_frames):
        frames.append(Tracks(number, random.uniform(0.0, 700.0, (per_frame, 4)).astype(np.float32).astype(np.float64)))
        file.append(frames[-1])
        ends = random.random(per_frame) < 0.1
        number = np.concatenate([number[~ends], np.arange(following, following + ends.sum())])
        following += int(ends.sum())
    return file, frames


def test_tracks_on_disk_are_those_with_two_or_more_observations_in_order() -> None:
    file, frames = kept_tracks(600, 5)
    number, counts = np.unique(np.concatenate([tracks.number for tracks in frames]), return_counts=True)
    lasting = number[counts > 1]
    assert len(lasting) < len(number)
    whole, pieces = file.observations(), list(file.pieces())
    assert len(pieces) > 1
    assert file.n_landmarks == len(lasting)
    assert len(file) == len(whole) == counts[counts > 1].sum()
    for name in ("frame", "landmark", "pixel"):
        np.testing.assert_array_equal(np.concatenate([getattr(o, name) for o in pieces]), getattr(whole, name))
    expected = [
        (k, int(np.searchsorted(lasting, n)), *pixel)
        for k, tracks in enumerate(frames)
        for n, pixel in zip(tracks.number.tolist(), tracks.pixel.tolist(), strict=True)
        if n in set(lasting.tolist())
    ]
    np.testing.assert_array_equal(np.column_stack([whole.frame, whole.landmark, whole.pixel]), expected)


def test_memory_of_the_tracks_does_not_grow_with_the_observations(tmp_path: Path) -> None:
    peaks = []
    for n_frames in (500, 2000):
        tracemalloc.start()
        file, frames = TrackFile(), kept_tracks(2, 400)[1]
        for _ in range(n_frames // 2):
            for tracks in frames:
                file.append(tracks)
        camera = StereoCamera(450.0, 450.0, 320.0, 240.0, 0.12)
        write_tracks(tmp_path / f"{n_frames}.npz", np.arange(float(n_frames)), camera, file, None)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert len(file) == n_frames * 400
    assert peaks[1] < 1.1 * peaks[0]


def test_a_full_disk_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda: open("/dev/full", "wb"))  # noqa: SIM115, PTH123
    with pytest.raises(InputError, match=r"the tracks cannot be kept there .*No space left.*TMPDIR"):
        kept_tracks(1, 5)


def test_kitti_odometry_06(recordings: Callable[[str], Path]) -> None:
    """150 observations a frame, 7 frames a track, residuals to the true poses below 0.8 px in the median.

    Above 5 px lie 2 %, four fifths of them in frames 0 to 2 and 8, where all tracks disagree with the true poses.
    """
    folder = recordings("kitti_images/odometry_06_first51/calib.txt").parent
    found = track(folder)
    poses = np.array([np.vstack([np.fromstring(line, sep=" ").reshape(3, 4), [0, 0, 0, 1]])
                      for line in (folder / "poses_first51.txt").read_text().splitlines()])  # fmt: skip
    o = found.observations
    keep = o.counts(found.n_landmarks)[o.landmark] >= 3
    _, landmark = np.unique(o.landmark[keep], return_inverse=True)
    frame, pixel, n = o.frame[keep], o.pixel[keep], int(landmark.max()) + 1
    assert len(frame) / 51 >= 150
    assert len(frame) / n >= 7
    error = residual_norms(found.camera, poses, frame, landmark, pixel)
    assert np.median(error) < 0.8
    assert np.mean(error > 5.0) < 0.02
    assert np.mean(error[~np.isin(frame, (0, 1, 2, 8))] > 5.0) < 0.005
    fitted = poses.copy()
    for _ in range(3):
        measurement = MeasurementModel(found.camera, 1.0, None)
        points = triangulate_tracks(measurement, fitted[frame], landmark, pixel, n).position
        for k in (0, 1, 2, 8):
            seen = frame == k
            fitted[k] = nearest_pose(found.camera, fitted[k], points[landmark[seen]], three_rows(pixel[seen]).T)
    assert np.abs(se3.log(se3.relative(np.stack([poses[0], fitted[0]])))).max() > 0.005
    assert np.mean(residual_norms(found.camera, fitted, frame, landmark, pixel) > 5.0) < 0.003


def residual_norms(
    camera: StereoCamera, poses: FloatArray, frame: IntArray, landmark: IntArray, pixel: FloatArray
) -> FloatArray:
    """Norms (n,) of the residuals in uL, uR and v, px, with landmarks fitted to the poses; inf behind the camera."""
    measurement, n = MeasurementModel(camera, 1.0, None), int(landmark.max()) + 1
    points = triangulate_tracks(measurement, poses[frame], landmark, pixel, n).position
    seen = se3.transform(se3.inverse(poses[frame]), points[landmark])
    error = np.linalg.norm(three_rows(pixel).T - camera.rows(seen.T).pixel, axis=0)
    return np.where(np.isfinite(error) & (seen[:, 2] > 0), error, np.inf)


def nearest_pose(camera: StereoCamera, pose: FloatArray, points: FloatArray, rows: FloatArray) -> FloatArray:
    """Pose near `pose` from which the points (n, 3) are seen in the rows (3, n), robustly."""

    def residual(twist: FloatArray) -> FloatArray:
        moved = se3.transform(se3.inverse(pose @ se3.exp(twist[None])[0]), points)
        return np.asarray((rows - camera.rows(moved.T).pixel).ravel())

    twist = least_squares(residual, np.zeros(6), loss="soft_l1").x
    return np.asarray(pose @ se3.exp(twist[None])[0])


def test_euroc_pairs_a_second_apart(recordings: Callable[[str], Path]) -> None:
    """|vL - vR| within 0.5 px in the median, and 100 matches in nine of ten pairs."""
    import cv2

    from fgbaseline.data.tracking.sources.camera_yaml import read_sensor_yaml

    folder = recordings("euroc/V1_01_keyframes/calibration.json").parent
    assert json.loads((folder / "calibration.json").read_text())
    mav = recordings("euroc/V1_01_standing/mav0/cam0/sensor.yaml").parents[1]
    rectified = rectify(*(read_sensor_yaml(mav / name / "sensor.yaml") for name in ("cam0", "cam1")))
    rows, counts = [], []
    for file in sorted((folder / "euroc_V1").glob("*_0.jpg")):
        left, right = (cv2.imread(str(file).replace("_0.jpg", end), 0) for end in ("_0.jpg", "_1.jpg"))
        found = StereoTracker(rectified.camera).step(*rectified(left, right))
        rows.append(np.median(np.abs(found.pixel[:, 1] - found.pixel[:, 3])))
        counts.append(len(found.number))
    assert np.median(rows) < 0.5
    assert np.mean(np.array(counts) >= 100) >= 0.9
