"""The real recordings: their counts, and that velocities, extrinsics and truth speak of the same frames."""

import time

import numpy as np
import pytest

from fgbaseline.data import Sequence
from fgbaseline.data.formats import attach_truth, read, write_npz
from fgbaseline.geometry import FloatArray, disparity, se3, so3

KITTI_07 = "ground_truth/kitti_odometry_07.txt"
UTIAS = {  # name: (frames, landmarks, observations, dead reckoning's RMSE in m, not aligned, rounded up)
    "2011_09_26_drive_0001_sync_KLT": (108, 707, 10501, 1.6),
    "2011_09_26_drive_0005_sync_KLT": (154, 911, 13908, 1.9),
    "2011_09_26_drive_0009_sync_KLT": (446, 1461, 26708, 4.3),
    "2011_09_26_drive_0036_sync_KLT": (250, 1183, 17519, 1.2),
    "2011_09_30_drive_0027_sync_KLT": (500, 2811, 44556, 1.4),
    "dataset3": (1900, 20, 9410, 1.3),
}


def dead_reckoning(s: Sequence) -> FloatArray:
    """Equation 9's mean: u_k moves frame k to k+1."""
    u = np.concatenate([s.linear_velocity, s.angular_velocity], axis=1)
    return se3.compose(se3.exp(u[:-1] * s.dt[:, None]))


def aligned_rmse(path: FloatArray, truth: FloatArray) -> float:
    """RMSE (m) of positions (n, 3) after the best rigid motion (Umeyama without scale)."""
    p, q = path - path.mean(axis=0), truth - truth.mean(axis=0)
    U, _, Vt = np.linalg.svd(q.T @ p)
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    return float(np.sqrt(((p @ R.T - q) ** 2).sum(axis=1).mean()))


def test_03(recordings, tmp_path):
    path = recordings("03.npz")
    began = time.process_time()
    s = read(path)
    assert time.process_time() - began < 5.0  # about 0.2 s; of the processor
    assert (s.form, s.name, s.n_frames, s.n_landmarks) == ("course", "03", 1010, 5105)
    assert len(s.observations) == 66353
    d = disparity(s.observations.pixel)
    assert (int((d <= 0).sum()), int((d < 1).sum())) == (621, 1408)
    np.testing.assert_allclose(dead_reckoning(s)[-1, :3, 3], [-927.8, 321.4, 179.2], atol=0.05)
    assert s.truth is None
    write_npz(s, tmp_path / "own.npz")
    back = read(tmp_path / "own.npz")
    assert back.form == "fgbaseline"
    assert back.observations.pixel.tobytes() == s.observations.pixel.tobytes()
    assert back.t.tobytes() == s.t.tobytes()


def test_10_without_features(recordings):
    s = read(recordings("10_imu_only.npz"))
    assert (s.n_frames, s.n_landmarks, len(s.observations)) == (3026, 0, 0)


def test_0027_of_2020_and_its_truth(recordings):
    s = read(recordings("ece276a_2020/0027.npz"), recordings(KITTI_07), "camera")
    assert (s.form, s.n_frames, s.n_landmarks, len(s.observations)) == ("course-2020", 1106, 3950, 75647)
    assert s.truth is not None
    known = s.truth.known
    assert int(known.sum()) == 1101
    assert "5 of 1106 frames have no ground truth" in s.remarks[-1]
    truth = s.truth.world_T_imu[known][:, :3, 3]
    assert np.linalg.norm(np.diff(truth, axis=0), axis=1).sum() == pytest.approx(692, abs=5)
    path = dead_reckoning(s)[known]
    assert aligned_rmse(path[:, :3, 3], truth) == pytest.approx(15.8, abs=0.1)


def test_the_truth_of_0027_is_the_cameras(recordings):
    """Read as the camera's, the true motions are the recorded velocities in the IMU's axes; else they are not."""
    s = read(recordings("ece276a_2020/0027.npz"))
    misfit = {}
    for body in ("camera", "imu"):
        truth = attach_truth(s, recordings(KITTI_07), body).truth
        assert truth is not None
        motion = se3.log(se3.relative(truth.world_T_imu[truth.known])) / s.dt[:1100, None]
        u = np.concatenate([s.linear_velocity, s.angular_velocity], axis=1)[:1100]
        misfit[body] = np.sqrt(((motion - u) ** 2).mean(axis=0))
    assert np.all(misfit["camera"] < [0.7] * 3 + [0.07] * 3)  # the noise that was added: 0.5 m/s, 0.05 rad/s
    assert misfit["imu"][0] > 5.0
    assert misfit["imu"][5] > 0.15


@pytest.mark.parametrize("name", UTIAS)
def test_utias_velocities_follow_the_truth(recordings, name):
    s = read(recordings(f"utias/{name}.mat"))
    frames, landmarks, n, limit = UTIAS[name]
    assert (s.form, s.n_frames, s.n_landmarks, len(s.observations)) == ("utias", frames, landmarks, n)
    assert s.truth is not None
    assert s.truth.known.all()
    truth = s.truth.world_T_imu
    path = dead_reckoning(s)
    assert np.sqrt(((path - truth)[:, :3, 3] ** 2).sum(axis=1).mean()) < limit
    # Step by step: the rotation of the increments is that of the truth, and not its inverse.
    steps, true_steps = se3.relative(path)[:, :3, :3], se3.relative(truth)[:, :3, :3]
    same = so3.rotation_angle(np.swapaxes(true_steps, -1, -2) @ steps).mean()
    inverse = so3.rotation_angle(true_steps @ steps).mean()
    assert same < 0.5 * inverse


def test_the_surveyed_landmarks_of_dataset3_are_where_they_are_seen(recordings):
    """The residuals' variances are those the file gives for its pixels (y_var), so every frame is understood."""
    s = read(recordings("utias/dataset3.mat"))
    assert s.truth is not None
    assert s.truth.landmarks is not None
    o = s.observations
    world_T_cam = s.truth.world_T_imu[o.frame] @ s.imu_T_cam
    points = se3.transform(se3.inverse(world_T_cam), s.truth.landmarks[o.landmark])
    residual = s.camera.project(points) - o.pixel
    np.testing.assert_allclose(residual.var(axis=0), [37.98, 129.84, 41.95, 132.49], rtol=1e-3)
    gaps = np.diff(o.frame[o.by_track()])[np.diff(o.landmark[o.by_track()]) == 0]
    assert (gaps > 1).sum() > 20  # tracks end and return
