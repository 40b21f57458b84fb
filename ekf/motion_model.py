"""Motion models of the filters: body velocities (equation 9), or raw inertial samples by the strapdown equations.

Both predict a body state: the pose, with the right perturbation [v, w], and further components with additive errors.
Body velocities have no further ones. Inertial samples have velocity in world axes, gyroscope bias and accelerometer
bias, in the order of `Estimate.state_covariance`.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.data.problem.inertial import ImuIntervals, InertialStart
from fgbaseline.geometry import FloatArray, se3, strapdown

POSE = 6
"""degrees of freedom of the pose: right perturbation [v, w]"""


class BodyState(NamedTuple):
    """Pose and further components of the body, with an error state of n components."""

    pose: FloatArray
    """(4, 4) world_T_imu"""
    additive: FloatArray
    """(n - 6,) components after the pose, with additive errors"""

    def corrected(self, delta: FloatArray) -> "BodyState":
        """State with the correction `delta` (n,): pose exp(delta[:6]), additive + delta[6:]."""
        return BodyState(self.pose @ se3.exp_one(delta[:POSE]), self.additive + delta[POSE:])


class PredictedState(NamedTuple):
    """Predicted state with the transition and the noise of its error."""

    body: BodyState
    transition: FloatArray
    """(n, n) F"""
    noise: FloatArray
    """(n, n) Q"""

    def covariance(self, before: FloatArray) -> FloatArray:
        """Predicted covariance F Sigma F^T + Q (n, n) of the covariance (n, n) before."""
        predicted: FloatArray = self.transition @ before @ self.transition.T + self.noise
        return 0.5 * (predicted + predicted.T)


class MotionModel(Protocol):
    """Start and prediction of the body state."""

    start: BodyState
    covariance: FloatArray
    """(n, n) covariance of the error of `start`"""

    def predict(self, k: int, body: BodyState) -> PredictedState:
        """Predicts the state of frame k + 1 from that of frame k, with transition and noise."""
        ...


class VelocityMotion:
    """Motion by the problem's increments (equation 9): F = Ad(exp(-increment)), Q = `increment_covariance`."""

    def __init__(self, problem: Problem) -> None:
        self.start = BodyState(problem.initial_pose, np.empty(0))
        self.covariance = problem.initial_covariance
        self.step = se3.exp(problem.increment)
        self.transition = se3.adjoint(se3.inverse(self.step))
        self.noise = problem.increment_covariance

    def predict(self, k: int, body: BodyState) -> PredictedState:
        """Predicts the state of frame k + 1 from that of frame k, with transition and noise."""
        return PredictedState(BodyState(body.pose @ self.step[k], body.additive), self.transition[k], self.noise[k])


class InertialMotion:
    """Motion by raw inertial samples, from which the estimated biases are subtracted."""

    def __init__(self, pose: FloatArray, start: InertialStart, imu: ImuIntervals) -> None:
        self.imu = imu
        self.start = BodyState(pose, np.concatenate([start.velocity, start.bias]))
        self.covariance = start.covariance

    def predict(self, k: int, body: BodyState) -> PredictedState:
        """Predicts the state of frame k + 1 from that of frame k, with transition and noise."""
        velocity, biases = body.additive[:3], body.additive[3:]
        motion = self.imu.motion(k, biases[:3], biases[3:])
        pose, velocity = strapdown.predict(body.pose, velocity, motion, self.imu.gravity_vector)
        F, Q = strapdown.world_axes(motion, body.pose[:3, :3], pose[:3, :3])
        return PredictedState(BodyState(pose, np.concatenate([velocity, biases])), F, Q)


def motion_model(problem: Problem) -> MotionModel:
    """Motion model of the problem's recording."""
    if problem.imu is None:
        return VelocityMotion(problem)
    assert problem.start is not None
    return InertialMotion(problem.initial_pose, problem.start, problem.imu)


class BodyHistory:
    """Body states of T frames with their covariances; NaN where a frame has none."""

    def __init__(self, n_frames: int, start: BodyState) -> None:
        n = POSE + len(start.additive)
        self.pose = np.full((n_frames, 4, 4), np.nan)
        self.additive = np.full((n_frames, n - POSE), np.nan)
        self.covariance = np.full((n_frames, n, n), np.nan)

    def record(self, k: int, body: BodyState, covariance: FloatArray) -> None:
        """Store the state of frame k with its covariance (n, n)."""
        self.pose[k], self.additive[k], self.covariance[k] = body.pose, body.additive, covariance

    def fields(self) -> dict[str, Any]:
        """Keywords of `Estimate`: poses and their covariances (T, 6, 6).

        With inertial samples also velocity, biases, and the covariance (T, 15, 15) of the whole body state.
        """
        fields: dict[str, Any] = {
            "world_T_imu": self.pose,
            "covariance": np.ascontiguousarray(self.covariance[:, :POSE, :POSE]),
        }
        if self.covariance.shape[1] == strapdown.STATE:
            names = ("velocity", "gyroscope_bias", "accelerometer_bias")
            fields |= dict(zip(names, np.ascontiguousarray(np.split(self.additive, 3, axis=1)), strict=True))
            fields["state_covariance"] = self.covariance
        return fields


def predicted_history(problem: Problem) -> BodyHistory:
    """Dead reckoning: states and covariances of all frames by prediction alone."""
    model = motion_model(problem)
    history = BodyHistory(problem.n_frames, model.start)
    body, covariance = model.start, model.covariance
    history.record(0, body, covariance)
    for k in range(problem.n_frames - 1):
        prediction = model.predict(k, body)
        body, covariance = prediction.body, prediction.covariance(covariance)
        history.record(k + 1, body, covariance)
    return history
