"""Joint state of EKF-SLAM: body state and active landmarks, with their full covariance.

The error state is [delta (6), d (n - 6), xi_0 (3), xi_1 (3), ...]: the right perturbation [v, w] of world_T_imu, the
errors of the body's further components (`motion_model`, `gyro_bias`), then the coordinates of each active landmark in
its chart. The covariance lives in one square array that grows by doubling. A marginalized landmark is overwritten by
the last one, so the active part is always the upper left square.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray

from ..motion_model import POSE, BodyState, PredictedState
from .landmark_representation import WorldPoints, generators, motion_jacobian, world_points
from .update import subtract_symmetric

ABSENT = -1
"""slot of a landmark that is not in the state"""


class CommonError(NamedTuple):
    """Error c that n new landmarks have in common."""

    jacobian: FloatArray
    """(n, 3) Jacobian of their coordinates w.r.t. c"""
    covariance: FloatArray
    """(size,) covariance of c with the error state"""
    variance: float
    """variance of c"""


class JointState:
    """Body and active landmarks, with one joint covariance."""

    def __init__(
        self, body: BodyState, covariance: FloatArray, n_features: int, n_points: int = 0, capacity: int = 64
    ) -> None:
        self.n_features = n_features
        self.body = self.predicted = body
        """`predicted` is the body state before the update of the current frame"""
        self.n_body = len(covariance)
        """dimension of the body's error: offset of the landmarks in the error state"""
        self.count = 0
        self.slot_of = np.full(n_features + n_points, ABSENT, dtype=np.int64)
        """(m + p,) slot of each of the problem's features, then of p points in the world that are no landmarks; ABSENT
        where it is not active"""
        self._P = np.zeros((self.n_body + 3 * capacity, self.n_body + 3 * capacity))
        self._P[: self.n_body, : self.n_body] = covariance
        self._feature = np.zeros(capacity, dtype=np.int64)
        self._xi, self._first_estimate = np.zeros((capacity, 3)), np.zeros((capacity, 3))
        self._charts = np.zeros((capacity, 4, 4))
        self._slot_generators = np.zeros((capacity, POSE, 4, 4))
        self._motion_jacobian = np.zeros((capacity, 3, POSE))

    def _grow(self) -> None:
        P = np.zeros((2 * len(self._P), 2 * len(self._P)))
        P[: self.size, : self.size] = self.P
        self._P = P
        self._feature, self._xi, self._first_estimate, self._charts, self._slot_generators, self._motion_jacobian = (
            np.concatenate([array, np.zeros_like(array)]) for array in self._slot_arrays()
        )

    def _slot_arrays(self) -> tuple[NDArray[Any], ...]:
        """Arrays with one entry per landmark slot."""
        return self._feature, self._xi, self._first_estimate, self._charts, self._slot_generators, self._motion_jacobian

    @property
    def pose(self) -> FloatArray:
        """Pose (4, 4) world_T_imu."""
        return self.body.pose

    @property
    def size(self) -> int:
        """Dimension of the error state."""
        return self.n_body + 3 * self.count

    @property
    def P(self) -> FloatArray:  # noqa: N802
        """Covariance (size, size), a view."""
        return self._P[: self.size, : self.size]

    @property
    def feature(self) -> IntArray:
        """Feature (count,) of each slot, a view."""
        return self._feature[: self.count]

    @property
    def landmarks(self) -> IntArray:
        """Features (l,) of the active landmarks."""
        return self.feature[self.feature < self.n_features]

    @property
    def xi(self) -> FloatArray:
        """Landmark coordinates (count, 3) in their charts, a view."""
        return self._xi[: self.count]

    @property
    def first_estimate(self) -> FloatArray:
        """Landmark coordinates (count, 3) at initialization, a view."""
        return self._first_estimate[: self.count]

    @property
    def charts(self) -> FloatArray:
        """Landmark charts (count, 4, 4), a view."""
        return self._charts[: self.count]

    def correct_landmarks(self, steps: FloatArray) -> FloatArray:
        """Add `steps` (count, 3) to the landmark coordinates; return the change (count, 3, 6) of `motion_jacobian`."""
        self.xi[:] += steps
        before = self._motion_jacobian[: self.count]
        now = motion_jacobian(self._slot_generators[: self.count], self.xi)
        change = now - before
        before[:] = now
        return change

    def predict(self, prediction: PredictedState) -> None:
        """Predict the body (equation 9), with Sigma <- F Sigma F^T + W."""
        transition, P, body = prediction.transition, self.P, self.n_body
        moved = transition @ P[:body]
        P[:body, body:] = moved[:, body:]
        P[body:, :body] = moved[:, body:].T
        own = moved[:, :body] @ transition.T + prediction.noise
        P[:body, :body] = 0.5 * (own + own.T)
        self.body = self.predicted = prediction.body

    def transform_covariance(self, columns: FloatArray) -> None:
        """P <- B P B^T with an identity B but for the pose's columns (size, 6)."""
        P, pose_block, G = self.P, columns[:POSE], columns[POSE:]
        own, cross = P[:POSE, :POSE].copy(), P[:POSE, POSE:].copy()
        half = -(cross + 0.5 * own @ G.T)
        subtract_symmetric(P[POSE:, POSE:], lambda rows, of: G[rows] @ half[:, of] + half[:, rows].T @ G[of].T)
        P[:POSE, POSE:] = pose_block @ (cross + own @ G.T)
        P[POSE:, :POSE] = P[:POSE, POSE:].T
        turned = pose_block @ own @ pose_block.T
        P[:POSE, :POSE] = 0.5 * (turned + turned.T)

    def transform_by_points(self, slot: IntArray, point: IntArray, by: FloatArray) -> None:
        """P <- B P B^T, where B adds `by` (n, 3, 3) times the errors in slots `point` (n,) to those in `slot` (n,)."""
        P, to, of = self.P, self._indices(slot), self._indices(point).reshape(-1, 3)
        P[to] += (by @ P[of]).reshape(-1, self.size)
        P[:, to] += np.einsum("snb,nab->sna", P[:, of], by).reshape(self.size, -1)

    def scale_inverse_depths(self, slot: IntArray, by: FloatArray | float) -> None:
        """Multiply the error of the inverse depths in slots (n,) `by` (n,) or one factor."""
        at, factor = self.n_body + 3 * slot + 2, np.broadcast_to(by, len(slot))
        self.P[at] *= factor[:, None]
        self.P[:, at] *= factor

    def inverse_depth_sigma(self, row: IntArray) -> FloatArray:
        """Sigma (n,) of the third coordinate of active landmarks `row` (n,)."""
        return np.asarray(np.sqrt(np.diagonal(self.P)[self.n_body + 3 * self.slot_of[row] + 2]))

    def pose_and_landmark(self, slot: IntArray) -> FloatArray:
        """Covariances (n, 9, 9) of the errors of the pose and of each landmark in slots (n,)."""
        own = self.n_body + 3 * slot[:, None] + np.arange(3)
        at = np.concatenate([np.broadcast_to(np.arange(POSE), (len(slot), POSE)), own], axis=1)
        return np.asarray(self.P[at[:, :, None], at[:, None, :]])

    def initialize(
        self,
        row: IntArray,
        chart: FloatArray,
        xi: FloatArray,
        pose_jacobian: FloatArray,
        covariance: FloatArray,
        common: CommonError | None = None,
    ) -> None:
        """Initialize n landmarks `row` (n,) at coordinates xi (n, 3) in one chart (4, 4).

        The error of a landmark is G delta + e, and with `common` G delta + e + B c: delta is the error of the pose,
        G = `pose_jacobian` (n, 3, 6), e has `covariance` (n, 3, 3), B and c are those of `CommonError`.
        """
        n, old, new = len(row), self.size, self.size + 3 * len(row)
        while self.count + n > len(self._feature):
            self._grow()
        slots = slice(self.count, self.count + n)
        Z = np.broadcast_to(generators(chart), (n, POSE, 4, 4))
        for array, value in zip(self._slot_arrays(), (row, xi, xi, chart, Z, motion_jacobian(Z, xi)), strict=True):
            array[slots] = value
        self.slot_of[row] = np.arange(self.count, self.count + n)
        P, G = self._P, pose_jacobian.reshape(3 * n, POSE)
        cross = G @ P[:POSE, :old]
        own = cross[:, :POSE] @ G.T
        if common is not None:
            B = common.jacobian.reshape(3 * n)
            by_pose = G @ common.covariance[:POSE]
            own += np.outer(B, by_pose) + np.outer(by_pose + B * common.variance, B)
            cross += np.outer(B, common.covariance)
        P[old:new, :old] = cross
        P[:old, old:new] = cross.T
        each = np.arange(n)
        own.reshape(n, 3, n, 3)[each, :, each, :] += covariance
        P[old:new, old:new] = 0.5 * (own + own.T)
        self.count += n

    def marginalize(self, row: IntArray) -> None:
        """Marginalize active landmarks `row` (n,): drop their rows and columns of P."""
        leaving = self.slot_of[row]
        left = self.count - len(leaving)
        goes: BoolArray = np.zeros(self.count, dtype=np.bool_)
        goes[leaving] = True
        # The last landmarks move into the free slots, so that the others need not.
        holes = np.flatnonzero(goes[:left])
        movers = left + np.flatnonzero(~goes[left:])
        for array in self._slot_arrays():
            array[holes] = array[movers]
        to, source = self._indices(holes), self._indices(movers)
        P = self.P
        P[to, :] = P[source, :]
        P[:, to] = P[:, source]
        self.slot_of[row] = ABSENT
        self.slot_of[self._feature[holes]] = holes
        self.count = left

    def world_points(self, row: IntArray) -> WorldPoints:
        """World positions (m) of active landmarks, with covariances (m^2)."""
        slot = self.slot_of[row]
        index = self._indices(slot).reshape(-1, 3)
        return world_points(self._charts[slot], self._xi[slot], self._P[index[:, :, None], index[:, None, :]])

    def _indices(self, slot: IntArray) -> IntArray:
        """Rows (3n,) of P of the landmarks in slots (n,)."""
        return (self.n_body + 3 * slot[:, None] + np.arange(3)).reshape(-1)
