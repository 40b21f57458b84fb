"""From real images with raw inertial samples to the reference: a KITTI drive, and a EuRoC vehicle that stands."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, smoother
from fgbaseline.compare.residuals.cost import cost
from fgbaseline.data import Status, read
from fgbaseline.data.tracking import ImageOptions, track
from fgbaseline.diagnosis import calibrated

pytest.importorskip("cv2")
Recordings = Callable[[str], Path]
DRIVE = "kitti_images/odometry_06_first51/calib.txt"


@pytest.mark.slow
def test_isam2_on_kitti_06_is_at_the_minimum_and_near_the_truth(recordings: Recordings, tmp_path: Path) -> None:
    """ATE after SE(3) alignment at most 0.5 % of the 60 m."""
    extrinsic = tmp_path / "imu_T_cam.txt"
    imu_T_cam = read(recordings("utias/2011_09_30_drive_0027_sync_KLT.mat")).imu_T_cam
    extrinsic.write_text(" ".join(map(repr, imu_T_cam[:3].ravel().tolist())))
    options = ImageOptions(imu=recordings("imu/odometry_06_first51_imu0.csv"), extrinsic=extrinsic)
    problem = calibrated(track(recordings(DRIVE).parent, options).sequence())
    truth = problem.sequence.truth
    assert truth is not None
    answer = smoother.isam2(problem)
    assert answer.status is Status.OK
    assert compare.summarized(compare.truth_errors(answer, truth, aligned=True)["position"])["rmse"] < 0.005 * 60.0
    batch = smoother.batch(problem, given={"isam2": answer})
    assert cost(problem, answer, batch.used) < (1.0 + 1e-5) * cost(problem, batch, batch.used)


@pytest.mark.slow
def test_isam2_stands_where_the_vehicle_does(recordings: Recordings) -> None:
    """Within 1 cm and 0.3 degrees of the first pose over 40 pairs; the truth moves by 2 mm and 0.2 degrees."""
    folder = recordings("euroc/V1_01_standing/mav0/cam0/sensor.yaml").parents[2]
    poses = smoother.isam2(calibrated(track(folder).sequence())).world_T_imu
    assert np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1).max() < 0.01
    turn = np.einsum("ji,tjk->tik", poses[0, :3, :3], poses[:, :3, :3])
    assert np.rad2deg(np.arccos(np.clip((np.trace(turn, axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0))).max() < 0.3
