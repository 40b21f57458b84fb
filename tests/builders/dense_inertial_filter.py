"""The dense filters on raw inertial samples: velocity and biases in the state.

They share nothing with `geometry.strapdown`. Over a piece of constant angular velocity w and specific force a, mean and
errors are linear differential equations with constant coefficients, and both are solved by matrix exponentials.
"""

import numpy as np
from scipy.linalg import expm

from fgbaseline.data.problem import Problem
from fgbaseline.ekf import Linearization
from fgbaseline.geometry import FloatArray

from .dense_filter import DenseFilter, hat3
from .dense_joint_filter import DenseJointFilter, adjoint

BODY = 15


class DenseInertialFilter(DenseJointFilter):
    """Textbook EKF-SLAM with inertial samples; `bias` is (9,): velocity, gyroscope bias, accelerometer bias."""

    def __post_init__(self) -> None:
        super().__post_init__()
        start = self.problem.start
        assert start is not None
        self.P = start.covariance.copy()
        self.bias = np.concatenate([start.velocity, start.bias])
        self.of_bias = slice(6, BODY)
        self.N_predicted = self.unobservable()

    def predict(self, k: int) -> None:
        """Strapdown integration, piece by piece."""
        imu = self.problem.imu
        assert imu is not None
        N, T_before = self.unobservable()[:BODY], self.as_predicted
        densities = np.repeat(imu.noise.densities.reshape(2, 2).T, 3, axis=1)
        F, Q = np.eye(BODY), np.zeros((BODY, BODY))
        F[6:9, 6:9] = self.pose[:3, :3].T
        for i in range(int(imu.starts[k]), int(imu.starts[k + 1])):
            dt = imu.dt[i]
            w, a = imu.angular_velocity[i] - self.bias[3:6], imu.specific_force[i] - self.bias[6:]
            X = np.column_stack([self.pose[:3, :3], self.bias[:3], self.pose[:3, 3]])  # X' = X M and gravity
            M = np.zeros((5, 5))
            M[:3, :3], M[:3, 3], M[3, 4] = hat3(w), a, 1.0
            X = X @ expm(M * dt) + np.outer(imu.gravity_vector, [0.0, 0.0, 0.0, dt, 0.5 * dt**2])
            self.pose = np.vstack([np.column_stack([X[:, :3], X[:, 4]]), [0.0, 0.0, 0.0, 1.0]])
            self.bias = np.concatenate([X[:, 3], self.bias[3:]])
            A = np.zeros((BODY, BODY))  # errors, that of the velocity in the axes of the body
            A[:3, :3] = A[3:6, 3:6] = A[6:9, 6:9] = -hat3(w)
            A[:3, 6:9], A[6:9, 3:6] = np.eye(3), -hat3(a)
            A[3:6, 9:12] = A[6:9, 12:] = -np.eye(3)
            piece = expm(A * dt)
            held = piece[:, 9:].copy()  # white noise is a bias of this piece
            held[9:] = 0.0
            F, Q = piece @ F, piece @ Q @ piece.T + held @ np.diag(densities[0] ** 2 / dt) @ held.T
            Q[9:, 9:] += np.diag(densities[1] ** 2 * dt)
        to_world = np.eye(BODY)
        to_world[6:9, 6:9] = self.pose[:3, :3]
        F, Q = to_world @ F, to_world @ Q @ to_world.T
        if self.linearization is Linearization.FIRST_ESTIMATE:
            B = np.eye(BODY)
            B[:, :6] += (N - self.N_predicted[:BODY]) @ adjoint(T_before)
            F = F @ B
        whole, noise = np.eye(len(self.P)), np.zeros_like(self.P)
        whole[:BODY, :BODY], noise[:BODY, :BODY] = F, Q
        self.P = whole @ self.P @ whole.T + noise
        self.N_predicted = self.unobservable()

    def unobservable(self) -> FloatArray:
        """(size, 6): what a small motion of the whole world does to the state; biases stay."""
        N = super().unobservable()
        N[6:9] = np.column_stack([np.zeros((3, 3)), -hat3(self.bias[:3])])
        return N


class DenseInertialDecoupledFilter(DenseFilter):
    """The report's filter with the prediction of `DenseInertialFilter`."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self.motion = DenseInertialFilter(problem)
        self.start, self.additive = self.motion.P, self.motion.bias

    def predict(self, k: int, mu: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Strapdown integration in place of equation 9, from frame k to k + 1."""
        self.motion.pose, self.motion.P, self.motion.bias = mu, sigma, self.additive
        self.motion.predict(k)
        self.additive = self.motion.bias
        return self.motion.pose, self.motion.P

    def dead_reckoning(self) -> tuple[FloatArray, FloatArray]:
        """Part a, after which the filter is at its start again."""
        start = self.additive
        answer = super().dead_reckoning()
        self.additive = start
        return answer
