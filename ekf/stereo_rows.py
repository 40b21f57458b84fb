"""What the joint filter measures: the three rows (uL, uR, v) of a stereo observation, v = (vL + vR) / 2.

With variances (V, V, V/2) they have the likelihood of the report's four rows of variance V, up to a constant: the
rectified camera predicts vL = vR, so that their difference tells nothing of the state. Four rows become three before
any matrix is formed, and a frame then never has more rows than the state has numbers.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, StereoCamera, se3, so3

ROW_VARIANCE = np.array([1.0, 1.0, 0.5])
"""of (uL, uR, v), as a share of the variance V of one of the four rows"""


def measured_rows(pixel: FloatArray) -> FloatArray:
    """(n, 3) uL, uR, (vL + vR) / 2 of pixels (n, 4)."""
    return np.stack([pixel[:, 0], pixel[:, 2], 0.5 * (pixel[:, 1] + pixel[:, 3])], axis=1)


def back_projected(camera: StereoCamera, rows: FloatArray) -> FloatArray:
    """Homogeneous points (n, 4) in the left camera's frame, [x/z, y/z, 1, 1/z], of rows (n, 3): exact at infinity."""
    points = np.ones((len(rows), 4))
    points[:, 0] = (rows[:, 0] - camera.cu) / camera.fu
    points[:, 1] = (rows[:, 2] - camera.cv) / camera.fv
    points[:, 3] = (rows[:, 0] - rows[:, 1]) / (camera.fu * camera.baseline)
    return points


class Sight(NamedTuple):
    """n homogeneous world points as one camera sees them."""

    predicted: FloatArray
    """(n, 3) uL, uR, v in px"""
    by_pose: FloatArray
    """(n, 3, 6) derivative by the right perturbation [v, w] of world_T_imu"""
    by_point: FloatArray
    """(n, 3, 4) derivative by the homogeneous world point"""
    cosine: FloatArray
    """(n,) of the angle between the optical axis and the ray to the point; not positive behind the camera"""


def sight(camera: StereoCamera, cam_T_imu: FloatArray, world_T_imu: FloatArray, points: FloatArray) -> Sight:
    """How homogeneous world points (n, 4) are seen from a pose (4, 4), and the derivatives of that.

    With s = T^-1 X and q = cam_T_imu s: uL = fu q1/q3 + cu, uR = uL - fu b q4/q3, v = fv q2/q3 + cv, and a
    perturbation T exp(delta) moves q by -cam_T_imu hat(delta) s = cam_T_imu [-s4 I, hat(s)] delta (equation 13, where
    s4 is 1).
    """
    imu_T_world = se3.inverse(world_T_imu)
    s = points @ imu_T_world.T
    q = s @ cam_T_imu.T
    fu, fv, b = camera.fu, camera.fv, camera.baseline
    inverse = 1.0 / q[:, 2]
    x, y, r = q[:, 0] * inverse, q[:, 1] * inverse, q[:, 3] * inverse
    left, right, down = fu * x, fu * (x - b * r), fv * y
    n = len(q)
    predicted = np.empty((n, 3))
    predicted[:, 0], predicted[:, 1], predicted[:, 2] = left + camera.cu, right + camera.cu, down + camera.cv
    by_q = np.zeros((n, 3, 4))
    by_q[:, 0, 0] = by_q[:, 1, 0] = fu * inverse
    by_q[:, 2, 1] = fv * inverse
    by_q[:, 0, 2] = -left * inverse
    by_q[:, 1, 2] = -right * inverse
    by_q[:, 2, 2] = -down * inverse
    by_q[:, 1, 3] = -fu * b * inverse
    stacked = by_q.reshape(3 * n, 4)  # one product of matrices is faster than n small ones
    by_s = (stacked @ cam_T_imu[:, :3]).reshape(n, 3, 3)
    by_pose = np.empty((n, 3, 6))
    by_pose[:, :, :3] = -s[:, 3, None, None] * by_s
    np.matmul(by_s, so3.hat3(s[:, :3]), out=by_pose[:, :, 3:])
    cosine = np.copysign(1.0 / np.sqrt(x * x + y * y + 1.0), q[:, 2])
    return Sight(predicted, by_pose, (stacked @ (cam_T_imu @ imu_T_world)).reshape(n, 3, 4), cosine)
