"""Gyroscope bias in the joint state: a random walk subtracted from the angular velocities.

The motion over dt from a frame to the next is exp(xi), xi = increment - dt [0; b]. With an error d of the bias it is
exp(xi) exp(-dt J_r(xi) [0; d]) to first order, J_r being the right Jacobian of SE(3).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FgbaselineError, FloatArray, se3

from ..motion_model import POSE, BodyState, PredictedState

BIAS = 3


@dataclass(frozen=True, slots=True)
class GyroBiasPrior:
    """Prior and random walk of the bias. Raises FgbaselineError, naming setting and value, for an invalid one."""

    deviation: float = 0.02
    """rad/s, standard deviation of each component about zero at frame 0"""
    walk: float = 1e-4
    """rad/s/sqrt(s), random walk of each component"""

    def __post_init__(self) -> None:
        if not 0.0 < self.deviation < np.inf:
            raise FgbaselineError(f"gyro_bias.deviation: expected a number above 0, got {self.deviation!r}")
        if not 0.0 <= self.walk < np.inf:
            raise FgbaselineError(f"gyro_bias.walk: expected a number from 0 on, got {self.walk!r}")

    def covariance(self) -> FloatArray:
        """Covariance (3, 3) at frame 0, (rad/s)^2."""
        return self.deviation**2 * np.eye(BIAS)

    def augment(
        self, twist: FloatArray, dt: float, transition: FloatArray, noise: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Transition F (9, 9) and noise Q (9, 9) of the errors [delta, d] over a motion exp(twist) of dt seconds.

        `transition` (6, 6) and `noise` (6, 6) are those of the pose alone.
        """
        F, Q = np.eye(POSE + BIAS), np.zeros((POSE + BIAS, POSE + BIAS))
        F[:POSE, :POSE] = transition
        F[:POSE, POSE:] = -dt * se3.right_jacobian(twist)[:, 3:]
        Q[:POSE, :POSE] = noise
        Q[POSE:, POSE:] = self.walk**2 * dt * np.eye(BIAS)
        return F, Q


class BiasedVelocityMotion:
    """Motion by the problem's increments, less the estimated gyroscope bias: the body state's additive component."""

    def __init__(self, problem: Problem, prior: GyroBiasPrior) -> None:
        self.problem, self.prior, self.dt = problem, prior, problem.sequence.dt
        self.start = BodyState(problem.initial_pose, np.zeros(BIAS))
        self.covariance = block_diag(problem.initial_covariance, prior.covariance())

    def predict(self, k: int, body: BodyState) -> PredictedState:
        """PredictedState of frame k + 1 from the state of frame k."""
        dt, twist = float(self.dt[k]), self.problem.increment[k].copy()
        twist[3:] -= dt * body.additive
        step = se3.exp_one(twist)
        F = se3.adjoint(se3.inverse(step))
        F, Q = self.prior.augment(twist, dt, F, self.problem.increment_covariance[k])
        return PredictedState(BodyState(body.pose @ step, body.additive), F, Q)
