"""EKF-SLAM as textbooks print it (Thrun, Burgard and Fox, 2005, chapter 10): what the joint filter is held against.

Everything is in one state and nothing ever leaves it. Four rows per observation, H (4n x size) with all its zeros,
K = P H^T (H P H^T + R)^-1 with an explicit inverse, (I - K H) P as printed; derivatives are taken landmark by landmark.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from fgbaseline.data.problem import Problem
from fgbaseline.ekf import GyroBiasPrior, LandmarkRepresentation, Linearization
from fgbaseline.geometry import FloatArray, HuberKernel, StereoCamera

from .dense_filter import hat3, odot, u_curly_hat, u_hat


def pixels(camera: StereoCamera, q: FloatArray) -> FloatArray:
    """Equation 10 for a homogeneous point q (4,) in the camera's frame."""
    x, y, z, w = q
    uL, v = camera.fu * x / z + camera.cu, camera.fv * y / z + camera.cv
    return np.array([uL, v, uL - camera.fu * camera.baseline * w / z, v])


def pixels_by_point(camera: StereoCamera, q: FloatArray) -> FloatArray:
    """(4, 4) derivative of `pixels` by q."""
    x, y, z, w = q
    fu, fv, b = camera.fu, camera.fv, camera.baseline
    uL = np.array([fu / z, 0, -fu * x / z**2, 0])
    v = np.array([0, fv / z, -fv * y / z**2, 0])
    return np.array([uL, v, uL + np.array([0, 0, fu * b * w / z**2, -fu * b / z]), v])


def adjoint(T: FloatArray) -> FloatArray:
    """T exp(u_hat(x)) T^-1 = exp(u_hat(adjoint(T) x))."""
    R, p = T[:3, :3], T[:3, 3]
    return np.block([[R, hat3(p) @ R], [np.zeros((3, 3)), R]])


def right_jacobian(u: FloatArray) -> FloatArray:
    """(6, 6) the integral of exp(-s u_curly_hat(u)) over s from 0 to 1: a corner of an exponential (Van Loan, 1978)."""
    return expm(np.block([[-u_curly_hat(u), np.eye(6)], [np.zeros((6, 12))]]))[:6, 6:]


@dataclass
class Landmark:
    """A landmark's coordinates and what they mean."""

    start: int
    """its first column in the state"""
    xi: FloatArray
    """(3,)"""
    first: FloatArray
    """(3,) as they were at first"""
    world_T_first_camera: FloatArray | None
    """None where xi is the point in the world; else xi = (x/z, y/z, 1/z) in this camera"""

    def homogeneous(self, xi: FloatArray) -> FloatArray:
        if self.world_T_first_camera is None:
            return np.append(xi, 1.0)
        return self.world_T_first_camera @ np.array([xi[0], xi[1], 1.0, xi[2]])

    def by_xi(self) -> FloatArray:
        """(4, 3)"""
        if self.world_T_first_camera is None:
            return np.eye(4)[:, :3]
        return self.world_T_first_camera[:, [0, 1, 3]]


@dataclass
class Moment:
    """What is known after a frame."""

    pose: FloatArray
    covariance: FloatArray
    """(6, 6)"""
    landmarks: dict[int, tuple[FloatArray, FloatArray]]
    """by the sequence's index: point (3,) m and covariance (3, 3) m^2"""
    joint: FloatArray
    """the whole P"""
    bias: FloatArray
    """(3,) rad/s of the gyroscope; zero where it is not in the state, else at 6 to 9 of it"""


@dataclass
class DenseJointFilter:
    """The filter on a problem."""

    problem: Problem
    coordinates: LandmarkRepresentation = LandmarkRepresentation.INVERSE_DEPTH
    linearization: Linearization = Linearization.TEXTBOOK
    gyro_bias: GyroBiasPrior | None = None
    pose: FloatArray = field(init=False)
    P: FloatArray = field(init=False)
    landmarks: dict[int, Landmark] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.pose = self.problem.initial_pose
        self.P = self.problem.initial_covariance.copy()
        self.bias = np.zeros(3)
        if self.gyro_bias is not None:
            self.P = block_diag(self.P, self.gyro_bias.deviation**2 * np.eye(3))
        self.of_bias = slice(6, len(self.P))
        self.as_predicted = self.pose
        self.o_T_I = np.linalg.inv(self.problem.sequence.imu_T_cam)

    def run(self) -> list[Moment]:
        """One moment per frame."""
        o = self.problem.observations()
        moments = []
        for k in range(self.problem.n_frames):
            if k > 0:
                self.predict(k - 1)
            self.as_predicted = self.pose
            at = o.frame == k
            self.update(o.landmark[at], o.pixel[at])
            seen = {j: self.world_point(landmark) for j, landmark in self.landmarks.items()}
            moments.append(Moment(self.pose, self.P[:6, :6].copy(), seen, self.P.copy(), self.bias))
        return moments

    def predict(self, k: int) -> None:
        """Equation 9, for the pose's block of an otherwise constant state; a bias wanders."""
        dt = self.problem.sequence.t[k + 1] - self.problem.sequence.t[k]
        u = self.problem.increment[k] - dt * np.append(np.zeros(3), self.bias)
        F = np.eye(len(self.P))
        F[:6, :6] = expm(-u_curly_hat(u))
        Q = np.zeros_like(self.P)
        Q[:6, :6] = self.problem.increment_covariance[k]
        if self.gyro_bias is not None:
            F[:6, 6:9] = -dt * right_jacobian(u)[:, 3:]
            Q[6:9, 6:9] = self.gyro_bias.walk**2 * dt * np.eye(3)
        predicted = self.pose @ expm(u_hat(u))
        if self.linearization is Linearization.FIRST_ESTIMATE:
            F[:6, :6] = adjoint(np.linalg.inv(predicted) @ self.as_predicted)
        self.pose = predicted
        self.P = F @ self.P @ F.T + Q

    def linearized(
        self, landmark: Landmark, pose: FloatArray, xi: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Predicted pixels (4,), their derivatives by the pose (4, 6) and by xi (4, 3)."""
        camera = self.problem.sequence.camera
        X = landmark.homogeneous(xi)
        s = np.linalg.inv(pose) @ X
        q = self.o_T_I @ s
        J = pixels_by_point(camera, q) @ self.o_T_I
        by_s = odot(s)
        by_s[:3, :3] *= s[3]
        return pixels(camera, q), -J @ by_s, J @ np.linalg.inv(pose) @ landmark.by_xi()

    def update(self, seen: NDArray[np.int64], z: FloatArray) -> None:
        problem = self.problem
        V = problem.pixel_variance
        if problem.landmark_prior is not None:
            for j in seen:
                if int(j) not in self.landmarks:
                    mean = problem.landmark_prior.mean[int(np.flatnonzero(problem.features == j)[0])]
                    self.insert(int(j), mean, None, np.zeros((3, len(self.P))), problem.landmark_prior.covariance)
        known = [i for i, j in enumerate(seen) if int(j) in self.landmarks]
        if known:
            variance = np.full(4 * len(known), V)
            residual, H = self.stacked([int(seen[i]) for i in known], z[known])
            if problem.kernel is not None:
                variance *= np.repeat(self.kernel_factor(residual, H, problem.kernel), 4)
            K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + np.diag(variance))
            self.P = (np.eye(len(self.P)) - K @ H) @ self.P
            self.move(K @ residual)
        for j, pixel in zip(seen, z, strict=True):
            if int(j) not in self.landmarks:
                self.insert_seen(int(j), pixel)

    def kernel_factor(self, residual: FloatArray, H: FloatArray, kernel: HuberKernel) -> FloatArray:
        """(n,) by how much each observation's variance grows: its three rows beyond the threshold."""
        A = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, 0.5, 0, 0.5]])
        factor = np.ones(len(residual) // 4)
        for n in range(len(factor)):
            H_n, r_n = A @ H[4 * n : 4 * n + 4], A @ residual[4 * n : 4 * n + 4]
            S_n = H_n @ self.P @ H_n.T + self.problem.pixel_variance * A @ A.T
            factor[n] = max(1.0, np.sqrt(r_n @ np.linalg.inv(S_n) @ r_n) / kernel.threshold)
        return factor

    def stacked(self, seen: list[int], z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residual (4n,) and H (4n, size) of the known landmarks `seen`."""
        residual, H = np.zeros(4 * len(seen)), np.zeros((4 * len(seen), len(self.P)))
        for i, j in enumerate(seen):
            landmark = self.landmarks[j]
            predicted, H_pose, H_xi = self.linearized(landmark, self.pose, landmark.xi)
            if self.linearization is Linearization.FIRST_ESTIMATE:
                _, H_pose, H_xi = self.linearized(landmark, self.as_predicted, landmark.first)
            rows = slice(4 * i, 4 * i + 4)
            residual[rows] = z[i] - predicted
            H[rows, :6] = H_pose
            H[rows, landmark.start : landmark.start + 3] = H_xi
        return residual, H

    def move(self, delta: FloatArray) -> None:
        """The state by delta; with it P, where the filter is invariant."""
        before = self.unobservable()
        pose = self.pose
        self.pose = pose @ expm(u_hat(delta[:6]))
        if len(step := delta[self.of_bias]):
            self.bias = self.bias + step
        for landmark in self.landmarks.values():
            landmark.xi = landmark.xi + delta[landmark.start : landmark.start + 3]
        if self.linearization is Linearization.INVARIANT:
            # B N- = N+, where N- [Ad(T-), 0] projects onto N- along the landmarks.
            B = np.eye(len(self.P))
            B[:, :6] += (self.unobservable() - before) @ adjoint(pose)
            self.P = B @ self.P @ B.T

    def unobservable(self) -> FloatArray:
        """(size, 6): what a small motion of the whole world does to the state."""
        N = np.zeros((len(self.P), 6))
        N[:6] = np.linalg.inv(adjoint(self.pose))
        for landmark in self.landmarks.values():
            X = landmark.homogeneous(landmark.xi)
            M = np.column_stack([landmark.by_xi(), landmark.homogeneous(np.zeros(3))])
            for i in range(6):
                Y = np.linalg.inv(M) @ u_hat(np.eye(6)[i]) @ X
                # xi = Y_123 / Y_4 where Y_4 is 1
                N[landmark.start : landmark.start + 3, i] = Y[:3] - landmark.xi * Y[3]
        return N

    def insert_seen(self, j: int, pixel: FloatArray) -> None:
        """A landmark at the least-squares point of its four rows, e = -A H_pose delta + A n, A = (H^T H)^-1 H^T."""
        camera = self.problem.sequence.camera
        uL, vL, uR, vR = pixel
        z = camera.fu * camera.baseline / (uL - uR)
        x, y = (uL - camera.cu) / camera.fu, (0.5 * (vL + vR) - camera.cv) / camera.fv
        world_T_cam = self.pose @ self.problem.sequence.imu_T_cam
        if self.coordinates is LandmarkRepresentation.WORLD:
            chart, xi = None, (world_T_cam @ np.array([x * z, y * z, z, 1.0]))[:3]
        else:
            chart, xi = world_T_cam, np.array([x, y, 1.0 / z])
        landmark = Landmark(0, xi, xi, chart)
        _, H_pose, H_xi = self.linearized(
            landmark, self.as_predicted if self.linearization is Linearization.FIRST_ESTIMATE else self.pose, xi
        )
        A = np.linalg.inv(H_xi.T @ H_xi) @ H_xi.T
        G = np.zeros((3, len(self.P)))
        G[:, :6] = -A @ H_pose
        self.insert(j, xi, chart, G, A @ (self.problem.pixel_variance * np.eye(4)) @ A.T)

    def insert(self, j: int, xi: FloatArray, chart: FloatArray | None, G: FloatArray, own: FloatArray) -> None:
        """A landmark with the error G e_state + e, e of covariance `own`."""
        self.landmarks[j] = Landmark(len(self.P), xi, xi, chart)
        self.P = np.block([[self.P, self.P @ G.T], [G @ self.P, G @ self.P @ G.T + own]])

    def world_point(self, landmark: Landmark) -> tuple[FloatArray, FloatArray]:
        X = landmark.homogeneous(landmark.xi)
        point = X[:3] / X[3]
        by_X = np.hstack([np.eye(3), -point[:, None]]) / X[3]
        J = by_X @ landmark.by_xi()
        block = slice(landmark.start, landmark.start + 3)
        return point, J @ self.P[block, block] @ J.T
