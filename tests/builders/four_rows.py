"""The cost of a problem as its docstring defines it: four rows an observation, numpy only, no GTSAM."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Problem
from fgbaseline.geometry import FloatArray, se3

HELD = 1e-6
"""m and rad: the standard deviation that stands for zero"""


@dataclass
class State:
    """Poses (T, 4, 4) and landmarks (N, 3), by their indices in the sequence."""

    world_T_imu: FloatArray
    landmarks: FloatArray

    @property
    def size(self) -> int:
        """How many numbers a perturbation has: [v, w] of every pose, then every landmark."""
        return 6 * len(self.world_T_imu) + 3 * len(self.landmarks)

    def moved(self, delta: FloatArray) -> "State":
        """Perturbed on the right, by (size,)."""
        n = 6 * len(self.world_T_imu)
        poses = self.world_T_imu @ se3.exp(delta[:n].reshape(-1, 6))
        return State(poses, self.landmarks + delta[n:].reshape(-1, 3))


def whitened_residuals(problem: Problem, state: State) -> FloatArray:
    """Every residual over its standard deviation, in one vector; its cost is half the sum of squares (no kernel)."""
    o, s = problem.observations(), problem.sequence
    cam_T_world = se3.inverse(state.world_T_imu @ s.imu_T_cam)
    seen = s.camera.project(se3.transform(cam_T_world[o.frame], state.landmarks[o.landmark]))
    pixels = (o.pixel - seen) / np.sqrt(problem.pixel_variance)
    steps = se3.log(se3.inverse(se3.exp(problem.increment)) @ se3.relative(state.world_T_imu))
    first = se3.log(se3.inverse(problem.initial_pose) @ state.world_T_imu[0])
    parts = [pixels.reshape(-1), whitened(first[None], (problem.initial_covariance + HELD**2 * np.eye(6))[None])]
    parts.append(whitened(steps, problem.increment_covariance))
    if problem.landmark_prior is not None:
        apart = state.landmarks[problem.features] - problem.landmark_prior.mean
        parts.append(whitened(apart, np.broadcast_to(problem.landmark_prior.covariance, (len(apart), 3, 3))))
    return np.concatenate(parts)


def whitened(residual: FloatArray, covariance: FloatArray) -> FloatArray:
    """(n k,) of residuals (n, k) with covariances (n, k, k)."""
    return np.linalg.solve(np.linalg.cholesky(covariance), residual[:, :, None]).reshape(-1)


def cost(problem: Problem, state: State) -> float:
    """Half the sum of squared whitened residuals."""
    r = whitened_residuals(problem, state)
    return 0.5 * float(r @ r)


def information(problem: Problem, state: State) -> FloatArray:
    """(size, size) Gauss-Newton's J^T J, J from central differences of the residuals."""
    h = 1e-6
    columns = []
    for i in range(state.size):
        delta = np.zeros(state.size)
        delta[i] = h
        up, down = (whitened_residuals(problem, state.moved(sign * delta)) for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * h))
    J = np.stack(columns, axis=1)
    return J.T @ J


def assert_no_small_step_lowers_the_cost(problem: Problem, state: State) -> None:
    """The state is a minimum: steps are shares of the standard deviations, in the valley and not up its walls."""
    lowest, random = cost(problem, state), np.random.default_rng(2)
    L_inverse = np.linalg.inv(np.linalg.cholesky(information(problem, state)))
    for size in (1e-1, 1e-2, 1e-3):
        for _ in range(20):
            step = L_inverse.T @ random.standard_normal(state.size)
            assert cost(problem, state.moved(size * step)) > lowest
