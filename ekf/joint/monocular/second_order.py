"""Second-order terms of the observations of one camera: their mean square is noise of the innovation.

A prediction h(x) is expanded to h + H e + e^T C e / 2. For a Gaussian error e with the covariance P the last term has
the mean tr(C P) / 2 and the variance tr(C P C P) / 2 (Bar-Shalom, Li and Kirubarajan 2001, section 10.3.2). The mean
is not subtracted, since inverse depths are less Gaussian than that: its square is added to the variance. A stereo
pair measures inverse depth, so that these are small. With one camera a landmark starts with an inverse depth known to
a factor of two, and its product with the motion is quadratic: without these terms the filter is overconfident in
the first seconds.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import Camera, FloatArray, se3

from ...motion_model import POSE
from ..state import JointState

_HATS = se3.hat(np.eye(POSE))
_PAIRS = 0.5 * (_HATS[:, None] @ _HATS[None] + _HATS[None] @ _HATS[:, None])


class SecondOrder(NamedTuple):
    """Moments of the second-order terms of n observations in two rows."""

    mean: FloatArray
    """(n, 2) px"""
    variance: FloatArray
    """(n, 2) px^2"""


def second_order_of(camera: Camera, cam_T_imu: FloatArray, state: JointState, slot: IntArray) -> SecondOrder:
    """Moments for the landmarks of a joint state in the slots (n,)."""
    covariance = state.pose_and_landmark(slot)
    return second_order(camera, cam_T_imu, state.pose, state.charts[slot], state.xi[slot], covariance)


def second_order(
    camera: Camera,
    cam_T_imu: FloatArray,
    pose: FloatArray,
    charts: FloatArray,
    xi: FloatArray,
    covariance: FloatArray,
) -> SecondOrder:
    """Moments for landmarks xi (n, 3) in charts (n, 4, 4) from a pose (4, 4).

    `covariance` (n, 9, 9) is that of the errors of pose and landmark.
    """
    imu_T_world = se3.inverse(pose)
    axes = imu_T_world @ charts  # derivative of the point in the IMU by [xi; 1]
    s = (axes[:, :, :3] @ xi[:, :, None])[:, :, 0] + axes[:, :, 3]
    n = len(xi)
    q = s @ cam_T_imu.T
    first = np.empty((n, 3, POSE + 3))
    first[:, :, :POSE] = -np.einsum("ab,ibc,nc->nai", cam_T_imu[:3], _HATS, s)
    first[:, :, POSE:] = cam_T_imu[:3] @ axes[:, :, :3]
    second = np.zeros((n, 3, POSE + 3, POSE + 3))
    second[:, :, :POSE, :POSE] = np.einsum("ab,ijbc,nc->naij", cam_T_imu[:3], _PAIRS, s)
    mixed = -np.einsum("ab,ibc,ncj->naij", cam_T_imu[:3], _HATS, axes[:, :, :3])
    second[:, :, :POSE, POSE:], second[:, :, POSE:, :POSE] = mixed, np.swapaxes(mixed, 2, 3)
    z = q[:, 2, None, None]
    dz, ddz = first[:, 2], second[:, 2]
    mean, variance = np.empty((n, 2)), np.empty((n, 2))
    for row, focal in enumerate((camera.fu, camera.fv)):
        d, slope = first[:, row], q[:, row, None, None] / z
        cross = d[:, :, None] * dz[:, None, :]
        own = 2.0 * slope * dz[:, :, None] * dz[:, None, :]
        C = focal / z * (second[:, row] - slope * ddz - (cross + np.swapaxes(cross, 1, 2) - own) / z)
        CP = C @ covariance
        mean[:, row] = 0.5 * np.trace(CP, axis1=1, axis2=2)
        variance[:, row] = 0.5 * np.einsum("nij,nji->n", CP, CP)
    return SecondOrder(mean, variance)
