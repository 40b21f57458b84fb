"""Landmarks whose depth one camera does not know yet: linearized at the depth they show, and tied to an anchor.

A landmark begins with an inverse depth rho that is known to a factor of two or three. After the camera has moved by t,
rho t is observed: to an error ds of the scale belongs an error -rho ds of rho. The scale is hardly observable over a
few frames, and a filter gains false information about it where rho changes between two linearizations. Therefore:

- The first updates have their Jacobians at the depth that the observation shows, not at that of the scene. It is found
  by each landmark's own iterated update, with the uncertainty of the pose. ln rho is Gaussian before it: the deviation
  of rho is in proportion to rho, so that the prior prefers no scale.
- Until then the position of the camera that saw the landmark first, its *anchor*, is in the state. The coordinates of
  a landmark have the error nu(rho) g, where g is the rigid motion by which that camera is in error, and a change of rho
  takes nu(rho-) to nu(rho+). B of `unobservable_directions` takes g from the current pose, whose error differs from the
  anchor's by that of t. With it alone, the Jacobian by t would stay at rho-.

Then rho changes by its noise, and B without the anchor keeps the Jacobian by t at the depth that was found: to follow
rho would relate its changes to the noise that causes them. A change that all have in common is one of the scale. The
errors of all inverse depths are scaled by it (`inverse_depth_prior.common_change`).
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import Camera, FloatArray, so3
from fgbaseline.geometry.linearization import predict

from ..motion_model import POSE, BodyState
from .landmark_representation import homogeneous
from .state import ABSENT, JointState

FOUND = 0.3
"""share of its first sigma below which the sigma of an inverse depth is due to observations"""
ITERATIONS = 3
LARGEST_STEP = 2.0
"""largest change of ln rho in an iteration"""
MIN_COSINE = 0.05
"""Smallest cosine between optical axis and ray (87 degrees): below it a landmark counts as behind the camera. At the
camera plane the Jacobian is unbounded."""


class Anchored(NamedTuple):
    """n landmarks with an anchor in the state."""

    slot: IntArray
    """(n,)"""
    anchor: IntArray
    """(n,) slots of their anchors"""
    position: FloatArray
    """(n, 3) m, those of the anchors in the world"""


class UnknownDepths:
    """The landmarks in the state whose depth is not found yet, with their anchors: points in the world, never observed.

    The anchor of frame k is point k of the `JointState`.
    """

    def __init__(self, n_features: int) -> None:
        self.anchor: IntArray = np.full(n_features, ABSENT, dtype=np.int64)
        """(m,) row of each feature's anchor; ABSENT where it has none"""
        self._first_sigma = np.zeros(n_features)
        """(m,) 1/m"""

    def begin(self, k: int, state: JointState, row: IntArray, imu_p_cam: FloatArray) -> None:
        """Anchor the features `row` (n,), initialized in frame k, at its camera, (3,) m in the IMU."""
        anchor = state.n_features + k
        R, lever = state.pose[:3, :3], np.asarray(imu_p_cam, dtype=np.float64)
        position = state.pose[:3, 3] + R @ lever
        by_pose = np.concatenate([R, -R @ so3.hat3(lever)], axis=1)
        state.initialize(np.array([anchor]), np.eye(4), position[None], by_pose[None], np.zeros((1, 3, 3)))
        self.anchor[row] = anchor
        self._first_sigma[row] = state.inverse_depth_sigma(row)

    def release(self, state: JointState) -> None:
        """Let go of the landmarks whose depth is found, and marginalize the anchors that no landmark has any more."""
        row = state.landmarks
        row = row[self.anchor[row] != ABSENT]
        found = state.inverse_depth_sigma(row) < FOUND * self._first_sigma[row]
        self.anchor[row[found]] = ABSENT
        anchors = state.feature[state.feature >= state.n_features]
        state.marginalize(np.setdiff1d(anchors, self.anchor[row[~found]]))

    def anchored(self, state: JointState) -> Anchored:
        """The landmarks of the state that have an anchor."""
        row = state.landmarks
        row = row[self.anchor[row] != ABSENT]
        anchor = state.slot_of[self.anchor[row]]
        return Anchored(state.slot_of[row], anchor, state.xi[anchor])


class ObservedDepths(NamedTuple):
    """n landmarks at the coordinates that their prior and one observation each show."""

    xi: FloatArray
    """(n, 3)"""
    mean: FloatArray
    """(n, 3) mean of the prior's error about these coordinates"""
    scale: FloatArray
    """(n,) inverse depth over that before, by which the prior's deviation of it is multiplied"""
    covariance: FloatArray
    """(n, 9, 9) of the errors of pose and landmark, with the observation"""
    found: BoolArray
    """(n,) whether the iteration stayed in front of the camera; the others are as before"""


def observed_depths(
    camera: Camera,
    cam_T_imu: FloatArray,
    body: BodyState,
    charts: FloatArray,
    xi: FloatArray,
    covariance: FloatArray,
    measured: FloatArray,
    variance: FloatArray,
) -> ObservedDepths:
    """Each landmark's own iterated Kalman update, Gaussian in ln rho: landmarks xi (n, 3) in front of their anchors.

    `covariance` (n, 9, 9) is that of the errors of pose and landmark, `measured` (n, r) are the rows, px, `variance`
    (n, r) px^2 that of their noise.
    """
    at, found = xi, np.ones(len(xi), dtype=np.bool_)
    noise = variance[:, None, :] * np.eye(variance.shape[1])

    def update() -> tuple[FloatArray, FloatArray, FloatArray]:
        """Error (n, 9) after the update, its covariance, and the mean of the prior's error, all about `at`."""
        scale = at[:, 2] / xi[:, 2]
        mean = np.zeros((len(xi), POSE + 3))
        mean[:, POSE:] = np.column_stack([xi[:, :2] - at[:, :2], -at[:, 2] * np.log(scale)])
        factor = np.ones_like(mean)
        factor[:, -1] = scale
        prior = covariance * factor[:, :, None] * factor[:, None, :]
        seen = predict(camera, cam_T_imu, body.pose, homogeneous(charts, at))
        np.logical_and(found, seen.cosine > MIN_COSINE, out=found)
        H = np.concatenate([seen.pose_jacobian(), seen.point_jacobian() @ charts[:, :, :3]], axis=2)
        PHt = prior @ np.swapaxes(H, 1, 2)
        gain = PHt @ np.linalg.inv(H @ PHt + noise)
        residual = measured - seen.pixel - np.einsum("nra,na->nr", H, mean)
        return mean + np.einsum("nar,nr->na", gain, residual), prior - gain @ np.swapaxes(PHt, 1, 2), mean

    for _ in range(ITERATIONS):
        error = np.where(found[:, None], update()[0], 0.0)
        step = np.clip(error[:, -1] / at[:, 2], -LARGEST_STEP, LARGEST_STEP)
        at = np.column_stack([at[:, :2] + error[:, POSE:-1], at[:, 2] * np.exp(step)])
        at = np.where(found[:, None], at, xi)
    _, posterior, _ = update()
    at = np.where(found[:, None], at, xi)
    mean = update()[2]
    return ObservedDepths(at, mean[:, POSE:], at[:, 2] / xi[:, 2], posterior, found)
