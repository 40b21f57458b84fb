"""EKF-SLAM frame by frame: prediction, joint update of pose and landmarks, initialization and marginalization."""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.estimate import Event, EventKind, Innovations
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.measurement import back_projected, measured_rows, predict

from ..motion_model import POSE, MotionModel, motion_model
from .feature_selection import select_features
from .gating import gate_observations
from .gyro_bias import BiasedVelocityMotion
from .landmark_map import LandmarkMap
from .landmark_representation import LandmarkRepresentation, chart, coordinates_of, homogeneous
from .settings import JointSettings, Linearization
from .state import ABSENT, JointState
from .unobservable_directions import first_estimate_transition, transform_columns
from .update import CholeskyFactor, Innovation, NotPositiveDefiniteError, StackedJacobian, kalman_update

MIN_COSINE = 0.05
"""Smallest cosine between optical axis and ray (87 degrees): below it a landmark counts as behind the camera. At the
camera plane the Jacobian is unbounded."""


class _LinearizedObservations(NamedTuple):
    """Linearized observations of n active landmarks."""

    observed: IntArray
    """(n,) indices into the problem's observations"""
    H: StackedJacobian
    residual: FloatArray
    """(n, 3) innovations in uL, uR, v, px"""
    cosine: FloatArray
    """(n,) cosines of the angle between optical axis and ray"""


class JointFilter:
    """One run of EKF-SLAM over a problem: joint state, map of marginalized landmarks, NIS and events."""

    def __init__(self, problem: Problem, settings: JointSettings) -> None:
        m, o = len(problem.features), problem.observations()
        self.problem = problem
        self.settings = settings
        self.camera = problem.sequence.camera
        self.imu_T_cam = problem.sequence.imu_T_cam
        self.cam_T_imu = se3.affine_inverse(problem.sequence.imu_T_cam)
        self.measurement = problem.measurement
        self.row_variance = self.measurement.row_variance
        self.feature = problem.feature_row(o.landmark)
        self.measured = measured_rows(o.pixel)
        self.motion: MotionModel = motion_model(problem)
        if settings.gyro_bias is not None:
            self.motion = BiasedVelocityMotion(problem, settings.gyro_bias)
        self.state = JointState(self.motion.start, self.motion.covariance, m)
        self.used: BoolArray = np.zeros(len(o), dtype=np.bool_)
        self.map = LandmarkMap(m)
        self.n_deferred = 0
        """number of observations not used because the state was full"""
        self.events: list[Event] = []
        self.innovations = Innovations.none(problem.n_frames)

    def process_frame(self, k: int, seen: slice) -> None:
        """Process frame k with the observations `seen`, a slice of the problem's."""
        index = np.arange(seen.start, seen.stop)
        row = self.feature[index]
        self.map.last_seen[row] = k
        self._marginalize_unseen(k - self.settings.unseen_frames)
        if k > 0:
            self._predict(k)
        absent = self.state.slot_of[row] == ABSENT
        at_prior = absent & ~self.map.initialized[row] & (self.problem.landmark_prior is not None)
        if at_prior.any():
            self._initialize_from_prior(row[self._select(k, index, at_prior)])
        new = absent & ~at_prior
        wanted = new & self._update(k, index[self.state.slot_of[row] != ABSENT])
        if self.settings.coordinates is LandmarkRepresentation.WORLD:  # where nothing is at infinity
            wanted &= self.measured[index, 0] > self.measured[index, 1]
        if (wanted != new).any():
            self._reject(k, EventKind.INITIALIZATION_DEFERRED, ~wanted[new])
        selected = self._select(k, index, wanted)
        if selected.any():
            self._initialize_from_observation(index[selected])

    def finish(self) -> None:
        """Marginalize all remaining landmarks into the map after the last frame."""
        self._marginalize(self.state.feature.copy())
        self.events += self.map.undetermined_events(self.problem.features)

    def _select(self, k: int, index: IntArray, wanted: BoolArray) -> BoolArray:
        """Mask (n,) of the `wanted` observations `index` (n,) whose landmarks fit into the state."""
        if np.count_nonzero(wanted) > self.settings.max_landmarks - self.state.count:
            self._marginalize_unseen(k)
        places = self.settings.max_landmarks - self.state.count
        if np.count_nonzero(wanted) <= places:
            return wanted
        active = self.state.slot_of[self.feature[index]] != ABSENT
        selected = wanted.copy()
        selected[wanted] = select_features(self.measured[index[wanted]], self.measured[index[active]], places)
        deferred = wanted & ~selected
        self.n_deferred += int(np.count_nonzero(deferred))
        self.map.deferred[self.feature[index[deferred]]] = True
        self._reject(k, EventKind.STATE_FULL, deferred)
        return selected

    def _predict(self, k: int) -> None:
        state = self.state
        prediction = self.motion.predict(k - 1, state.body)
        if self.settings.linearization is Linearization.FIRST_ESTIMATE:
            F = first_estimate_transition(prediction.transition, state.predicted, state.body, prediction.body)
            prediction = prediction._replace(transition=F)
        state.predict(prediction)

    def _update(self, k: int, index: IntArray) -> bool:
        """Update with observations `index` (n,) of active landmarks.

        False if the whole frame disagrees or S is not positive definite: then nothing was updated. True otherwise, also
        where every observation was rejected by itself.
        """
        if len(index) == 0:
            return True
        seen = self._reject_behind_camera(k, self._linearize(index))
        if len(seen.observed) == 0:
            return True
        state = self.state
        innovation = Innovation.of(seen.H, seen.residual, state.P)
        verdict = gate_observations(innovation.nis_per_observation(self.row_variance), self.measurement, self.settings)
        order = verdict.order
        innovation = innovation.in_order(order)
        factor = self._record_nis(k, innovation)
        if verdict.rejection is not None:
            self._reject(k, verdict.rejection, ~verdict.accepted)
            if not verdict.accepted.any():
                return verdict.rejection is not EventKind.FRAME_DISAGREES
        try:
            weight = verdict.weight[order][: np.count_nonzero(verdict.accepted), None]
            innovation = innovation.first(len(weight))
            if factor is None:
                factor = innovation.factorize(self.row_variance / weight)
            else:
                lower = weight[weight[:, 0] != 1.0]
                factor = factor.reweighted(innovation.residual, self.row_variance / lower - self.row_variance)
            self._apply_correction(kalman_update(innovation, factor, state.P))
        except NotPositiveDefiniteError:
            self._reject(k, EventKind.COVARIANCE_LOST, verdict.accepted)
            return False
        self.used[seen.observed[verdict.accepted]] = True
        if not state.P.diagonal().min() >= 0.0:
            negative = "P - W^T W has a negative variance after the update"
            self.events.append(Event(k, EventKind.COVARIANCE_LOST, negative))
        return True

    def _record_nis(self, k: int, innovation: Innovation) -> CholeskyFactor | None:
        """Record the NIS of the frame, before kernel and gate, and return the factor of S."""
        self.innovations.degrees[k] = innovation.residual.size
        try:
            factor = innovation.factorize(self.row_variance)
        except NotPositiveDefiniteError:
            return None
        self.innovations.nis[k] = factor.nis
        return factor

    def _linearize(self, index: IntArray) -> _LinearizedObservations:
        state, slot = self.state, self.state.slot_of[self.feature[index]]
        charts = state.charts[slot]
        seen = now = predict(self.camera, self.cam_T_imu, state.pose, homogeneous(charts, state.xi[slot]))
        if self.settings.linearization is Linearization.FIRST_ESTIMATE:
            seen = predict(
                self.camera, self.cam_T_imu, state.predicted.pose, homogeneous(charts, state.first_estimate[slot])
            )
        H = StackedJacobian(slot, seen.pose_jacobian(), seen.point_jacobian() @ charts[:, :, :3], state.n_body)
        return _LinearizedObservations(index, H, self.measured[index] - now.pixel, np.minimum(now.cosine, seen.cosine))

    def _reject_behind_camera(self, k: int, seen: _LinearizedObservations) -> _LinearizedObservations:
        front = seen.cosine > MIN_COSINE
        if front.all():
            return seen
        self._reject(k, EventKind.BEHIND_CAMERA, ~front)
        return _LinearizedObservations(
            seen.observed[front], seen.H.select(front), seen.residual[front], seen.cosine[front]
        )

    def _apply_correction(self, delta: FloatArray) -> None:
        """Apply the correction delta (size,) to the state, and transform P where the linearization is invariant.

        Landmarks have the rows nu of N, their `motion_jacobian`, and (nu+ - nu-) A of B: `unobservable_directions`.
        """
        state, n = self.state, self.state.n_body
        before = state.body
        state.body = before.corrected(delta[:n])
        by = delta[n:].reshape(-1, 3)
        if self.settings.linearization is not Linearization.INVARIANT:
            state.xi[:] += by
        else:
            landmarks = state.correct_landmarks(by).reshape(-1, POSE) @ se3.adjoint(before.pose)
            state.transform_covariance(np.concatenate([transform_columns(before, state.body, delta[:n]), landmarks]))

    def _initialize_from_prior(self, row: IntArray) -> None:
        prior, n = self.problem.landmark_prior, len(row)
        assert prior is not None
        covariance = np.broadcast_to(prior.covariance, (n, 3, 3))
        self.state.initialize(row, np.eye(4), prior.mean[row], np.zeros((n, 3, POSE)), covariance)
        self.map.initialized[row] = True

    def _initialize_from_observation(self, index: IntArray) -> None:
        """Initialize landmarks from one observation each, back-projected from the current pose estimate.

        This is the limit of a prior without information: from 0 = H_pose delta + H_xi e + n, with n the error of the
        pixels, the error of the coordinates is e = -H_xi^-1 H_pose delta - H_xi^-1 n.
        """
        n, state = len(index), self.state
        first_estimate = self.settings.linearization is Linearization.FIRST_ESTIMATE
        world_T_cam = state.pose @ self.imu_T_cam
        points = back_projected(self.camera, self.measured[index]) @ world_T_cam.T
        shared = chart(self.settings.coordinates, world_T_cam)
        xi = coordinates_of(shared, points)
        at = state.predicted.pose if first_estimate else state.pose
        seen = predict(self.camera, self.cam_T_imu, at, xi @ shared[:, :3].T + shared[:, 3])
        inverse = np.linalg.inv((seen.point_jacobian().reshape(3 * n, 4) @ shared[:, :3]).reshape(n, 3, 3))
        covariance = (inverse * self.row_variance) @ np.swapaxes(inverse, 1, 2)
        state.initialize(self.feature[index], shared, xi, -inverse @ seen.pose_jacobian(), covariance)
        self.map.initialized[self.feature[index]] = True
        self.used[index] = True

    def _marginalize_unseen(self, since: int) -> None:
        """Marginalize the landmarks without an observation from frame `since` on."""
        active = self.state.feature
        self._marginalize(active[self.map.last_seen[active] < since])

    def _marginalize(self, row: IntArray) -> None:
        if len(row) > 0:
            self.map.store(row, self.state.world_points(row))
            self.state.marginalize(row)

    def _reject(self, k: int, why: EventKind, rejected: BoolArray) -> None:
        n = int(np.count_nonzero(rejected))
        self.events.append(Event(k, why, f"{n} of {len(rejected)} observations take no part"))
