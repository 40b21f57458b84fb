"""States of the frames in a smoother: poses, and with raw inertial data velocities and biases."""

from dataclasses import dataclass, fields, replace

import gtsam
import numpy as np

from fgbaseline.data.estimators.estimate import Estimate, Landmarks
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, strapdown

from .gtsam_conversions import bias_from_gtsam, bias_to_gtsam, rigid_poses, state_covariances, values_from_state
from .keys import state_keys
from .marginal_covariances import marginal_covariances

POSE = slice(0, 6)


@dataclass(eq=False, slots=True)
class FrameStates:
    """States of T frames, to be filled; NaN where they are not known. n is 15 with raw inertial data, 6 without."""

    world_T_imu: FloatArray
    """(T, 4, 4)"""
    covariance: FloatArray
    """(T, n, n) of [translation, rotation], then [velocity, gyroscope bias, accelerometer bias]"""
    velocity: FloatArray
    """(T, 3) m/s in world axes; (0, 3) without raw inertial data"""
    bias: FloatArray
    """(T, 6) rad/s and m/s^2, gyroscope first; (0, 6) without raw inertial data"""

    @property
    def inertial(self) -> bool:
        """Whether the states have velocities and biases."""
        return bool(self.covariance.shape[1] == strapdown.STATE)

    @classmethod
    def unknown(cls, problem: Problem) -> "FrameStates":
        """States of the frames of a problem, all unknown."""
        T, inertial = problem.n_frames, problem.imu is not None
        n, m = (strapdown.STATE, T) if inertial else (6, 0)
        return cls(*(np.full(shape, np.nan) for shape in ((T, 4, 4), (T, n, n), (m, 3), (m, 6))))

    @classmethod
    def of_estimate(cls, estimate: Estimate) -> "FrameStates":
        """States of an estimate, without covariances."""
        T, velocity, inertial = len(estimate.world_T_imu), estimate.velocity, estimate.velocity is not None
        bias = [estimate.gyroscope_bias, estimate.accelerometer_bias] if inertial else [np.empty((0, 3))] * 2
        n = strapdown.STATE if inertial else 6
        return cls(
            estimate.world_T_imu,
            np.full((T, n, n), np.nan),
            np.empty((0, 3)) if velocity is None else velocity,
            np.concatenate([b for b in bias if b is not None], axis=1),
        )

    def given_pose(self, k: int) -> FloatArray:
        """Covariance (9, 9) of velocity and biases of frame k, conditioned on its pose."""
        P = self.covariance[k]
        explained = P[6:, POSE] @ np.linalg.pinv(P[POSE, POSE], rcond=1e-12, hermitian=True) @ P[POSE, 6:]
        return np.asarray(P[6:, 6:] - explained, dtype=np.float64)

    def copy(self) -> "FrameStates":
        """Independent copy."""
        return FrameStates(*(getattr(self, field.name).copy() for field in fields(self)))

    def start(self, problem: Problem) -> None:
        """Set the state of frame 0 to the problem's start."""
        self.world_T_imu[0] = problem.initial_pose
        if problem.start is None:
            self.covariance[0] = problem.initial_covariance
            return
        self.covariance[0], self.velocity[0] = problem.start.covariance, problem.start.velocity
        self.bias[0] = problem.start.bias

    def take(self, k: int, values: gtsam.Values) -> None:
        """Set the state of frame k from GTSAM's values, the covariance aside."""
        pose, *others = state_keys(k, self.inertial)
        self.world_T_imu[k] = values.atPose3(pose).matrix()
        if others:
            self.velocity[k] = values.atPoint3(others[0])
            self.bias[k] = bias_from_gtsam(values.atConstantBias(others[1]))

    def take_all(self, values: gtsam.Values, first: int = 0, last: int | None = None) -> None:
        """Set the states of the frames `first` to `last` from GTSAM's values, with rotations renormalized."""
        frames = range(first, len(self.world_T_imu) if last is None else last + 1)
        for k in frames:
            self.take(k, values)
        self.world_T_imu[frames.start : frames.stop] = rigid_poses(self.world_T_imu[frames.start : frames.stop])

    def insert(self, values: gtsam.Values, k: int) -> None:
        """Insert the variables of frame k into GTSAM's values."""
        pose, *others = state_keys(k, self.inertial)
        values.insert(pose, gtsam.Pose3(self.world_T_imu[k]))
        if others:
            values.insert(others[0], self.velocity[k])
            values.insert(others[1], bias_to_gtsam(self.bias[k]))

    def values(self, landmarks: Landmarks) -> gtsam.Values:
        """GTSAM's values of all frames and of landmarks."""
        values = values_from_state(np.empty((0, 4, 4)), landmarks)
        for k in range(len(self.world_T_imu)):
            self.insert(values, k)
        return values

    def take_covariances(self, problem: Problem, first: int, matrices: list[FloatArray]) -> None:
        """Set the covariances of the frames from `first` on from GTSAM's joint ones (n, n) of their variables."""
        self.covariance[first : first + len(matrices)] = state_covariances(problem, matrices, first)

    def take_marginals(
        self, problem: Problem, graph: gtsam.NonlinearFactorGraph, values: gtsam.Values
    ) -> dict[int, FloatArray]:
        """Set all covariances to those of a graph at a solution; those of its other variables by key, in GTSAM's order.

        Raises RuntimeError where the system is indeterminate.
        """
        states = [state_keys(k, self.inertial) for k in range(problem.n_frames)]
        covariance = marginal_covariances(graph, values, states)
        self.take_covariances(problem, 0, [covariance[state[0]] for state in states])
        return covariance

    def replace_before(self, first: int, other: "FrameStates") -> None:
        """Replace the states of the frames before `first` by those of `other`."""
        for field in fields(self):
            getattr(self, field.name)[:first] = getattr(other, field.name)[:first]

    def added_to(self, estimate: Estimate) -> Estimate:
        """Estimate with these states and their covariances."""
        states = replace(estimate, world_T_imu=self.world_T_imu, covariance=self.covariance[:, POSE, POSE])
        if not self.inertial:
            return states
        return replace(
            states,
            velocity=self.velocity,
            gyroscope_bias=self.bias[:, :3],
            accelerometer_bias=self.bias[:, 3:],
            state_covariance=self.covariance,
        )
