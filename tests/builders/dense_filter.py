"""The report's filter once more, printed equation by equation: what the fast forms of `ekf/` are held against.

Nothing is rewritten here. The landmarks' covariance is one 3M x 3M matrix, the innovation covariance one
4n x 4n matrix that is inverted, the Kalman gain is formed, pi and its derivative act on homogeneous 4-vectors,
and matrix exponentials are scipy's. It is slow, and it loses what the printed equations lose.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from fgbaseline.data.problem import LandmarkMode, Problem
from fgbaseline.geometry import FloatArray, StereoCamera

P = np.hstack([np.eye(3), np.zeros((3, 1))])
"""the projection of equation 11 from homogeneous to plain coordinates"""


def hat3(w: FloatArray) -> FloatArray:
    """The skew-symmetric matrix of equation 9."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def u_hat(u: FloatArray) -> FloatArray:
    """Equation 9: the 4x4 matrix of u = [v, w]."""
    return np.block([[hat3(u[3:]), u[:3, None]], [np.zeros((1, 4))]])


def u_curly_hat(u: FloatArray) -> FloatArray:
    """Equation 9: the 6x6 matrix of u = [v, w]."""
    return np.block([[hat3(u[3:]), hat3(u[:3])], [np.zeros((3, 3)), hat3(u[3:])]])


def homogeneous(point: FloatArray) -> FloatArray:
    """The underlined vectors of the report."""
    return np.append(point, 1.0)


def pi(q: FloatArray) -> FloatArray:
    """Equation 12."""
    return q / q[2]


def dpi_dq(q: FloatArray) -> FloatArray:
    """Equation 12."""
    q1, q2, q3, q4 = q
    return np.array([[1, 0, -q1 / q3, 0], [0, 1, -q2 / q3, 0], [0, 0, 0, 0], [0, 0, -q4 / q3, 1]]) / q3


def K_s(camera: StereoCamera) -> FloatArray:  # noqa: N802
    """Equation 10: the 4x4 matrix called M there, K_s in equation 11."""
    fu, fv, cu, cv, b = camera.fu, camera.fv, camera.cu, camera.cv, camera.baseline
    return np.array([[fu, 0, cu, 0], [0, fv, cv, 0], [fu, 0, cu, -fu * b], [0, fv, cv, 0]])


def odot(homogeneous_point: FloatArray) -> FloatArray:
    """Equation 13: [s; 1] to [[I, -hat(s)], [0, 0]]."""
    return np.block([[np.eye(3), -hat3(homogeneous_point[:3])], [np.zeros((1, 6))]])


@dataclass
class Answer:
    """Poses (T, 4, 4), their covariances (T, 6, 6), landmarks (M, 3), their joint covariance (3M, 3M)."""

    mu: FloatArray
    sigma: FloatArray
    m: FloatArray
    sigma_m: FloatArray


class DenseFilter:
    """The report's filter on a `documented` problem."""

    def __init__(self, problem: Problem) -> None:
        assert problem.landmark_prior is not None
        assert problem.mapping_pixel_variance is not None
        self.problem = problem
        self.M = len(problem.features)
        self.prior_mean = problem.landmark_prior.mean
        self.prior_variance = problem.landmark_prior.covariance
        self.V_mapping: FloatArray = problem.mapping_pixel_variance * np.eye(4)
        self.V_slam: FloatArray = problem.pixel_variance * np.eye(4)
        self.K = K_s(problem.sequence.camera)
        self.o_T_I = np.linalg.inv(problem.sequence.imu_T_cam)
        """the report's optical frame from the IMU's"""
        self.start = problem.initial_covariance
        self.additive = np.zeros(0)
        """the state after the pose, where there is more"""

    def seen(self, k: int) -> tuple[NDArray[np.int64], FloatArray]:
        """The rows j of the landmarks seen at frame k, and z (n, 4)."""
        o = self.problem.observations()
        at = o.frame == k
        rows = [int(np.flatnonzero(self.problem.features == landmark)[0]) for landmark in o.landmark[at]]
        return np.array(rows, dtype=np.int64), o.pixel[at]

    def predict(self, k: int, mu: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Equation 9, from frame k to k + 1."""
        tau_u = self.problem.increment[k]
        F = expm(-u_curly_hat(tau_u))
        return mu @ expm(u_hat(tau_u)), F @ sigma @ F.T + self.problem.increment_covariance[k]

    def update_landmarks(
        self, k: int, T: FloatArray, m: FloatArray, sigma_m: FloatArray, V: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Equations 11 and 12 at frame k, seen from the pose T."""
        rows, z = self.seen(k)
        if len(rows) == 0:
            return m, sigma_m
        T_inv = np.linalg.inv(T)
        z_tilde = np.zeros((len(rows), 4))
        H = np.zeros((4 * len(rows), 3 * self.M))
        for i, j in enumerate(rows):
            q = self.o_T_I @ T_inv @ homogeneous(m[j])
            z_tilde[i] = self.K @ pi(q)
            H[4 * i : 4 * i + 4, 3 * j : 3 * j + 3] = self.K @ dpi_dq(q) @ self.o_T_I @ T_inv @ P.T
        I_V = block_diag(*[V] * len(rows))
        gain = sigma_m @ H.T @ np.linalg.inv(H @ sigma_m @ H.T + I_V)
        new_m = m.reshape(-1) + gain @ (z - z_tilde).reshape(-1)
        return new_m.reshape(-1, 3), (np.eye(3 * self.M) - gain @ H) @ sigma_m

    def update_pose(self, k: int, mu: FloatArray, sigma: FloatArray, m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Equation 13 at frame k."""
        rows, z = self.seen(k)
        if len(rows) == 0:
            return mu, sigma
        mu_inv = np.linalg.inv(mu)
        z_tilde = np.zeros((len(rows), 4))
        H = np.zeros((4 * len(rows), len(sigma)))
        for i, j in enumerate(rows):
            s = mu_inv @ homogeneous(m[j])
            z_tilde[i] = self.K @ pi(self.o_T_I @ s)
            H[4 * i : 4 * i + 4, :6] = -self.K @ dpi_dq(self.o_T_I @ s) @ self.o_T_I @ odot(s)
        I_V = block_diag(*[self.V_slam] * len(rows))
        gain = sigma @ H.T @ np.linalg.inv(H @ sigma @ H.T + I_V)
        correction = gain @ (z - z_tilde).reshape(-1)
        self.additive = self.additive + correction[6:]
        return mu @ expm(u_hat(correction[:6])), (np.eye(len(sigma)) - gain @ H) @ sigma

    def dead_reckoning(self) -> tuple[FloatArray, FloatArray]:
        """Part a: means (T, 4, 4) and covariances (T, 6, 6)."""
        mu, sigma = [self.problem.initial_pose], [self.start]
        for k in range(self.problem.n_frames - 1):
            predicted, covariance = self.predict(k, mu[-1], sigma[-1])
            mu.append(predicted)
            sigma.append(covariance)
        return np.array(mu), np.array(sigma)

    def mapping(self) -> Answer:
        """Part b, along the dead-reckoned path."""
        mu, sigma = self.dead_reckoning()
        m, sigma_m = self._landmark_prior()
        for k in range(self.problem.n_frames):
            m, sigma_m = self.update_landmarks(k, mu[k], m, sigma_m, self.V_mapping)
        return Answer(mu, sigma, m, sigma_m)

    def slam(self) -> Answer:
        """Part c, in the problem's reading."""
        in_turn = self.problem.landmark_mode is LandmarkMode.UPDATED
        if in_turn:
            m, sigma_m = self._landmark_prior()
        else:
            mapped = self.mapping()
            m, sigma_m = mapped.m, mapped.sigma_m
        mu, sigma = self.problem.initial_pose, self.start
        path, covariances = [], []
        for k in range(self.problem.n_frames):
            if k > 0:
                mu, sigma = self.predict(k - 1, mu, sigma)
                mu, sigma = self.update_pose(k, mu, sigma, m)
            if in_turn:
                m, sigma_m = self.update_landmarks(k, mu, m, sigma_m, self.V_slam)
            path.append(mu)
            covariances.append(sigma)
        return Answer(np.array(path), np.array(covariances), m, sigma_m)

    def _landmark_prior(self) -> tuple[FloatArray, FloatArray]:
        return self.prior_mean.copy(), np.kron(np.eye(self.M), self.prior_variance)
