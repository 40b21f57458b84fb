"""Landmarks whose depth one camera does not know yet: linearized at the depth they show, and tied to an anchor.

A landmark begins with an inverse depth rho that is known to a factor of two or three. After the camera has moved by t,
rho t is observed: to a relative error ds of the scale belongs an error -rho ds of rho. The scale is hardly observable
over a few frames, and a filter gains false information about it where rho changes between two linearizations.

Therefore, until the depth is found (`FOUND`):

- An update has its Jacobians at the depth that its own observation shows, not at the depth before. An iterated update
  of each landmark by itself, with the uncertainty of the pose, gives this depth (`observed_depths`). Its prior is
  Gaussian in ln rho, so that the sigma of rho is in proportion to rho: one that is Gaussian in rho would prefer the
  scale at which inverse depths differ little.
- The position of the camera that saw the landmark first, its *anchor*, is in the state. The coordinates of a landmark
  have the error nu(rho) g, where nu is their `motion_jacobian` and g the rigid motion by which that camera is in error.
  A change of rho takes nu(rho-) to nu(rho+), with the translation of g from the anchor. B of `unobservable_directions`
  has it from the current pose, whose error differs from the anchor's by that of t: the Jacobian by t would stay at
  rho-.

Once the depth is found, the Jacobian by t is to stay, and B without an anchor keeps it: rho then changes by the noise
of each update, and a Jacobian that follows is correlated with that noise, which biases the scale. Only a change that
all inverse depths have in common is one of the scale. It multiplies the errors of all inverse depths
(`inverse_depth_prior.common_change`).
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import Camera, FloatArray, so3
from fgbaseline.geometry.linearization import predict

from ...motion_model import POSE, BodyState
from ..landmark_representation import homogeneous
from ..state import ABSENT, JointState

FOUND = 0.3
"""A depth is found once the sigma of its inverse is below this share of the sigma at the start."""
ITERATIONS = 3
LARGEST_STEP = 2.0
"""largest change of ln rho in an iteration"""
MIN_COSINE = 0.05
"""Smallest cosine between optical axis and ray (87 degrees): below it a landmark counts as behind the camera. At the
camera plane the Jacobian is unbounded."""


class Anchored(NamedTuple):
    """n landmarks with an anchor in the state."""

    slot: IntArray
    """(n,) slots of the landmarks"""
    anchor: IntArray
    """(n,) slots of their anchors"""
    position: FloatArray
    """(n, 3) m, positions of the anchors in the world"""


class UnknownDepths:
    """The landmarks in the state whose depth is not found yet, with their anchors.

    An anchor is a point in the world that is never observed: the camera of frame k is point k of the `JointState`.
    """

    def __init__(self, n_features: int) -> None:
        self.anchor: IntArray = np.full(n_features, ABSENT, dtype=np.int64)
        """(m,) index of each feature's anchor in `JointState.slot_of`; ABSENT where it has none"""
        self._first_sigma = np.zeros(n_features)
        """(m,) sigma of the inverse depth at the start, 1/m"""

    def begin(self, k: int, state: JointState, row: IntArray, imu_p_cam: FloatArray) -> None:
        """Anchor the features `row` (n,), initialized in frame k, at the camera of that frame.

        `imu_p_cam` (3,), m, is its position in the IMU frame.
        """
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
    """n landmarks, each at the coordinates that its prior and one observation show."""

    xi: FloatArray
    """(n, 3) in their charts"""
    mean: FloatArray
    """(n, 3) mean of the prior's error about `xi`"""
    scale: FloatArray
    """(n,) inverse depth in `xi` over that of the prior: factor on its sigma in the prior"""
    covariance: FloatArray
    """(n, 9, 9) of the errors of pose and landmark after the observation"""
    in_front: BoolArray
    """(n,) whether the iteration stayed in front of the camera; the others keep their prior, and have no covariance"""


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
    """Each landmark's own iterated Kalman update, Gaussian in ln rho; the pose is not iterated.

    Landmarks xi (n, 3) in charts (n, 4, 4) are in front of their anchors: rho > 0. `covariance` (n, 9, 9) is that of
    the errors of pose and landmark, `measured` (n, r) are the rows, px, `variance` (n, r) px^2 that of their noise.
    """
    at, in_front = xi, np.ones(len(xi), dtype=np.bool_)
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
        np.logical_and(in_front, seen.cosine > MIN_COSINE, out=in_front)
        H = np.concatenate([seen.pose_jacobian(), seen.point_jacobian() @ charts[:, :, :3]], axis=2)
        PHt = prior @ np.swapaxes(H, 1, 2)
        gain = PHt @ np.linalg.inv(H @ PHt + noise)
        residual = measured - seen.pixel - np.einsum("nra,na->nr", H, mean)
        return mean + np.einsum("nar,nr->na", gain, residual), prior - gain @ np.swapaxes(PHt, 1, 2), mean

    for _ in range(ITERATIONS):
        error = np.where(in_front[:, None], update()[0], 0.0)
        step = np.clip(error[:, -1] / at[:, 2], -LARGEST_STEP, LARGEST_STEP)
        at = np.column_stack([at[:, :2] + error[:, POSE:-1], at[:, 2] * np.exp(step)])
        at = np.where(in_front[:, None], at, xi)
    _, posterior, mean = update()
    at, mean = np.where(in_front[:, None], at, xi), np.where(in_front[:, None], mean, 0.0)
    return ObservedDepths(at, mean[:, POSE:], at[:, 2] / xi[:, 2], posterior, in_front)
