"""EKF-SLAM frame by frame: prediction, joint update of pose and landmarks, initialization and marginalization."""

from functools import partial

import numpy as np

from fgbaseline.data.estimators.estimate import Event, EventKind, Innovations
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3

from ..motion_model import POSE, MotionModel, motion_model
from .feature_selection import select_features
from .gating import GatedObservations, gate_observations
from .gyro_bias import BiasedVelocityMotion
from .landmark_initialization import new_landmarks
from .landmark_map import LandmarkMap
from .landmark_representation import LandmarkRepresentation
from .linearized_observations import LinearizedObservations, linearize
from .monocular.inverse_depth_prior import common_change
from .monocular.second_order import second_order, second_order_of
from .monocular.unknown_depths import MIN_COSINE, UnknownDepths, observed_depths
from .process_noise import MAX_REJECTED, ProcessNoise
from .settings import JointSettings, Linearization
from .state import ABSENT, JointState
from .state_correction import correct
from .unobservable_directions import first_estimate_transition
from .update import CholeskyFactor, Innovation, NotPositiveDefiniteError, kalman_update


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
        """(n,) index into `problem.features` of each observation"""
        self.measured = self.measurement.rows_of(o.pixel)
        """(n, r) measured rows, px"""
        self.motion: MotionModel = motion_model(problem)
        if settings.gyro_bias is not None:
            self.motion = BiasedVelocityMotion(problem, settings.gyro_bias)
        self.state = JointState(self.motion.start, self.motion.covariance, m, problem.n_frames)
        self.depths: UnknownDepths | None = None
        """with one camera and `Linearization.INVARIANT`, the landmarks of unknown depth"""
        if self.measurement.monocular and settings.linearization is Linearization.INVARIANT:
            self.depths = UnknownDepths(m)
        self.used: BoolArray = np.zeros(len(o), dtype=np.bool_)
        self.map = LandmarkMap(m)
        self.n_deferred = 0
        """number of observations not used because the state was full"""
        self.process_noise = ProcessNoise(len(self.motion.covariance))
        self.gate = partial(gate_observations, measurement=self.measurement, settings=settings)
        self.events: list[Event] = []
        self.innovations = Innovations.none(problem.n_frames)

    def process_frame(self, k: int, observed: slice) -> None:
        """Process frame k, whose observations are the slice `observed` of `problem.observations()`."""
        index = np.arange(observed.start, observed.stop)
        row = self.feature[index]
        self.map.last_seen[row] = k
        self._marginalize_unseen(k - self.settings.unseen_frames)
        if self.process_noise.n_rejected >= MAX_REJECTED:
            self._marginalize(self.state.landmarks)
            self.process_noise.reset()
        if k > 0:
            self._predict(k)
        absent = self.state.slot_of[row] == ABSENT
        at_prior = absent & ~self.map.initialized[row] & (self.problem.landmark_prior is not None)
        if at_prior.any():
            self._initialize_from_prior(row[self._select(k, index, at_prior)])
        new = absent & ~at_prior
        wanted = new & self._update(k, index[self.state.slot_of[row] != ABSENT])
        if self.settings.coordinates is LandmarkRepresentation.WORLD:
            # A world point is at a finite distance, so its disparity is positive.
            wanted &= self.measured[index, 0] > self.measured[index, 1]
        if (wanted != new).any():
            self._record_rejection(k, EventKind.INITIALIZATION_DEFERRED, ~wanted[new])
        selected = self._select(k, index, wanted)
        if selected.any():
            self._initialize_from_observation(index[selected])
            if self.depths is not None:
                self.depths.begin(k, self.state, row[selected], self.imu_T_cam[:3, 3])
        if self.depths is not None:
            self.depths.release(self.state)

    def finish(self) -> None:
        """Marginalize all remaining landmarks into the map after the last frame."""
        self._marginalize(self.state.landmarks)
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
        self._record_rejection(k, EventKind.STATE_FULL, deferred)
        return selected

    def _predict(self, k: int) -> None:
        state = self.state
        prediction = self.motion.predict(k - 1, state.body)
        if self.settings.linearization is Linearization.FIRST_ESTIMATE:
            F = first_estimate_transition(prediction.transition, state.predicted, state.body, prediction.body)
            prediction = prediction._replace(transition=F)
        state.predict(prediction)
        self.process_noise.propagate(prediction)

    def _update(self, k: int, index: IntArray) -> bool:
        """Update with observations `index` (n,) of active landmarks; return whether the pose may initialize new ones.

        False if the frame is rejected as a whole or S is not positive definite: the state is then only predicted. True
        otherwise, also where the gate rejects every single observation.
        """
        if len(index) == 0:
            return True
        linearized = self._reject_behind_camera(k, self._linearize(index))
        if len(linearized.observed) == 0:
            return True
        state = self.state
        variance = self._variance(linearized)
        innovation = Innovation.of(linearized.H, linearized.residual, state.P)
        gated = self.gate(innovation.nis_per_observation(variance))
        mean, prior = np.zeros(state.size), state.xi.copy()
        if self.depths is not None and (moved := self._at_observed_depths(self.depths, linearized, variance, gated)):
            linearized, variance, mean = moved
            innovation = Innovation.of(linearized.H, linearized.residual, state.P)
        order = gated.order
        unordered, innovation = innovation, innovation.in_order(order)
        factor = self._record_nis(k, innovation, variance[order])
        if gated.rejection is not EventKind.FRAME_DISAGREES:
            self.process_noise.reset()
        # Only after a second frame in succession: a single one more often has wrong matches than unmodeled motion.
        elif self.process_noise.n_rejected > 0 and (retried := self._inflate_process_noise(k, unordered, variance)):
            innovation, gated = retried
            order, factor = gated.order, None
            innovation = innovation.in_order(order)
            self.process_noise.reset()
        else:
            self.process_noise.n_rejected += 1
        variance = variance[order]
        if gated.rejection is not None:
            self._record_rejection(k, gated.rejection, ~gated.accepted)
            if not gated.accepted.any():  # and no landmark has been moved
                return gated.rejection is not EventKind.FRAME_DISAGREES
        try:
            weight = gated.weight[order][: np.count_nonzero(gated.accepted), None]
            innovation, variance = innovation.first(len(weight)), variance[: len(weight)]
            if factor is None:
                factor = innovation.factorize(variance / weight)
            else:
                lower = weight[:, 0] != 1.0
                added = variance[lower] / weight[lower] - variance[lower]
                factor = factor.reweighted(innovation.residual, added)
            correction = mean + kalman_update(innovation, factor, state.P)
        except NotPositiveDefiniteError:
            self._record_rejection(k, EventKind.COVARIANCE_LOST, gated.accepted)
            self._restore_landmarks(prior)
            return False
        before = state.xi[:, 2].copy()
        self._apply_correction(correction)
        if self.depths is not None:
            # What known inverse depths change by together is a change of scale, and multiplies the errors of all.
            state.scale_inverse_depths(state.slot_of[state.landmarks], common_change(before, state))
        self.used[linearized.observed[gated.accepted]] = True
        if not state.P.diagonal().min() >= 0.0:
            negative = "P - W^T W has a negative variance after the update"
            self.events.append(Event(k, EventKind.COVARIANCE_LOST, negative))
        return True

    def _restore_landmarks(self, xi: FloatArray) -> None:
        """Undo `_at_observed_depths`: landmarks get their coordinates xi (count, 3) back, and P its prior value."""
        state = self.state
        slot = np.flatnonzero((state.xi != xi).any(axis=1))
        state.scale_inverse_depths(slot, xi[slot, 2] / state.xi[slot, 2])
        move = np.zeros(state.size)
        move[state.n_body :] = (xi - state.xi).ravel()
        self._apply_correction(move)

    def _variance(self, linearized: LinearizedObservations) -> FloatArray:
        """Variances (n, r), px^2, of the noise of innovations.

        For one camera those of the neglected second-order terms are added, and the square of their mean, which the
        innovation is not corrected for.
        """
        if not self.measurement.monocular:
            return np.broadcast_to(self.row_variance, linearized.residual.shape)
        terms = second_order_of(self.camera, self.cam_T_imu, self.state, linearized.H.slot)
        return self.row_variance + terms.variance + terms.mean**2

    def _at_observed_depths(
        self,
        depths: UnknownDepths,
        linearized: LinearizedObservations,
        variance: FloatArray,
        gated: GatedObservations,
    ) -> tuple[LinearizedObservations, FloatArray, FloatArray] | None:
        """Move accepted landmarks of unknown depth to what the frame shows (`observed_depths`), and linearize there.

        None if there are none. Returns the observations in the order given, their variances (n, r), px^2, and the mean
        (size,) of the prior's error about the moved estimate. Residuals are measured - predicted - H mean. Moved
        landmarks have the second-order terms of their covariance after the observation.
        """
        state, slot = self.state, linearized.H.slot
        unknown = gated.accepted & (depths.anchor[self.feature[linearized.observed]] != ABSENT)
        at = np.flatnonzero(unknown & (state.xi[slot, 2] > 0.0))
        if len(at) == 0:
            return None
        own = slot[at]
        charts, before, covariance = state.charts[own], state.xi[own], state.pose_and_landmark(own)
        measured, noise = self.measured[linearized.observed[at]], self.row_variance / gated.weight[at, None]
        shown = observed_depths(self.camera, self.cam_T_imu, state.body, charts, before, covariance, measured, noise)
        move, mean = np.zeros((2, state.size))
        move[state.n_body :].reshape(-1, 3)[own] = shown.xi - before
        self._apply_correction(move)
        state.scale_inverse_depths(own, shown.scale)
        mean[state.n_body :].reshape(-1, 3)[own] = shown.mean
        moved = self._linearize(linearized.observed)
        by_mean = moved.H.multiply(mean[:, None]).reshape(moved.residual.shape)
        terms = second_order(self.camera, self.cam_T_imu, state.pose, charts, state.xi[own], shown.covariance)
        variance = variance.copy()
        after = self.row_variance + terms.variance + terms.mean**2
        variance[at] = np.where(shown.in_front[:, None], after, variance[at])
        return moved._replace(residual=moved.residual - by_mean), variance, mean

    def _inflate_process_noise(
        self, k: int, innovation: Innovation, variance: FloatArray
    ) -> tuple[Innovation, GatedObservations] | None:
        """Retry a rejected frame with inflated process noise in P; None, with P unchanged, if it is still rejected.

        Two successive frames disagree with the prediction: where this frame's observations agree with each other, the
        motion between the frames is less certain than modeled.
        """
        found = self.process_noise.inflate(innovation, self.state.P, variance, self.gate)
        if found is None:
            return None
        text = f"the motion since the last accepted frame has {found.factor:.0f} times its modeled covariance added"
        self.events.append(Event(k, EventKind.PROCESS_NOISE_INFLATED, text))
        return found.innovation, found.gated

    def _record_nis(self, k: int, innovation: Innovation, variance: FloatArray) -> CholeskyFactor | None:
        """Record the NIS of the frame, before kernel and gate; return the factor of S, or None if S has none."""
        self.innovations.degrees[k] = innovation.residual.size
        try:
            factor = innovation.factorize(variance)
        except NotPositiveDefiniteError:
            return None
        self.innovations.nis[k] = factor.nis
        return factor

    def _linearize(self, index: IntArray) -> LinearizedObservations:
        slot, how = self.state.slot_of[self.feature[index]], self.settings.linearization
        return linearize(self.state, self.camera, self.cam_T_imu, how, slot, index, self.measured[index])

    def _reject_behind_camera(self, k: int, linearized: LinearizedObservations) -> LinearizedObservations:
        front = linearized.cosine > MIN_COSINE
        if front.all():
            return linearized
        self._record_rejection(k, EventKind.BEHIND_CAMERA, ~front)
        return linearized.select(front)

    def _apply_correction(self, delta: FloatArray) -> None:
        correct(self.state, delta, self.settings.linearization, self.depths)

    def _initialize_from_prior(self, row: IntArray) -> None:
        prior, n = self.problem.landmark_prior, len(row)
        assert prior is not None
        covariance = np.broadcast_to(prior.covariance, (n, 3, 3))
        self.state.initialize(row, np.eye(4), prior.mean[row], np.zeros((n, 3, POSE)), covariance)
        self.map.initialized[row] = True

    def _initialize_from_observation(self, index: IntArray) -> None:
        """Initialize landmarks from one observation each; see `new_landmarks`."""
        row = self.feature[index]
        new = new_landmarks(self.problem, self.settings, self.state, self.cam_T_imu, self.measured[index])
        self.state.initialize(row, *new)
        self.map.initialized[row] = True
        self.used[index] = True

    def _marginalize_unseen(self, since: int) -> None:
        """Marginalize the landmarks without an observation from frame `since` on."""
        active = self.state.landmarks
        self._marginalize(active[self.map.last_seen[active] < since])

    def _marginalize(self, row: IntArray) -> None:
        if len(row) > 0:
            self.map.store(row, self.state.world_points(row))
            self.state.marginalize(row)

    def _record_rejection(self, k: int, why: EventKind, rejected: BoolArray) -> None:
        n = int(np.count_nonzero(rejected))
        self.events.append(Event(k, why, f"{n} of {len(rejected)} observations rejected"))
