"""Bundle adjustment of a short window of frames: poses and landmarks from pixels and velocities together.

Dense and exact: landmarks are eliminated by the Schur complement, poses are few. Unlike frame-to-frame odometry it has
residuals with the right number of degrees of freedom, from which noise can be estimated.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fgbaseline.data.parallel import background_map
from fgbaseline.data.problem import NoiseSettings
from fgbaseline.geometry import FloatArray, HuberKernel, StereoCamera, StereoMeasurement, se3

from .normal_equations import (
    Landmarks,
    Reduced,
    around_intervals,
    back_substitute,
    landmark_steps,
    schur_complement,
    terms_of,
)
from .residuals import N_CALIBRATION, Joined, MotionTerms, Window, concatenate_windows, motion_terms, pixel_terms

TOGETHER = 8000
"""observations, up to which windows are computed together: their arrays should fit into a cache"""
SHARED_PRIOR = np.diag(1.0 / np.array([0.1] * 3 + [0.3] + [0.1] * 3 + [1.0]) ** 2)
"""regularizes parameters that a window does not determine (a rotation about the direction of travel)"""


@dataclass(frozen=True, eq=False, slots=True)
class WindowFit:
    """The solution of a window, with residuals and redundancy."""

    poses: FloatArray
    """(W, 4, 4) of the IMU, the first being the identity"""
    points: FloatArray
    """(m, 3) m"""
    shared: FloatArray
    """(8,) calibration parameters: see `residuals.N_CALIBRATION`"""
    shared_information: FloatArray
    """(8, 8) information about `shared`, marginal over poses and landmarks, without the prior"""
    motion_residual: FloatArray
    """(W-1, 6) velocity residuals, m/s and rad/s; those of interpolated velocities are scaled down to the noise"""
    motion_redundancy: FloatArray
    """(W-1, 6) share of each residual's variance that the fit did not absorb"""
    pixel_squared: FloatArray
    """(n,) kernel-weighted squared residual of three whitened rows"""
    degrees_of_freedom: float
    """degrees of freedom of the pixel residuals"""
    last_covariance: FloatArray
    """(6, 6) of the right perturbation of the last pose"""


def fit_each_window(
    camera: StereoCamera,
    imu_T_cam: FloatArray,
    windows: Sequence[Window],
    sigmas: NoiseSettings,
    shared: Sequence[FloatArray],
    iterations: int,
    processes: int = 1,
) -> list[WindowFit]:
    """Gauss-Newton on each window by itself, with its own `shared` (8,) under a wide prior."""
    groups: list[list[int]] = [[]]
    for i in range(len(windows)):
        if sum(len(windows[j][0].frame) for j in groups[-1]) >= TOGETHER:
            groups.append([])
        groups[-1].append(i)

    def fitted(group: list[int]) -> list[WindowFit]:
        chosen = [windows[i] for i in group]
        return _fitted(camera, imu_T_cam, chosen, sigmas, np.array([shared[i] for i in group]), iterations)

    with background_map(lambda number: fitted(groups[number]), len(groups) if windows else 0, processes) as gathered:
        return [fit for fits in gathered() for fit in fits]


def _fitted(
    camera: StereoCamera,
    imu_T_cam: FloatArray,
    windows: list[Window],
    sigmas: NoiseSettings,
    shared: FloatArray,
    iterations: int,
) -> list[WindowFit]:
    data, numbers = concatenate_windows(windows), range(len(windows))
    model = StereoMeasurement(camera, sigmas.pixel**2, HuberKernel())
    poses, points = (np.concatenate(parts) for parts in list(zip(*windows, strict=True))[1:])
    for step in range(iterations + 1):
        pixels = pixel_terms(model, imu_T_cam, data, poses, points, shared)
        motions = motion_terms(data, poses, sigmas, shared)
        landmarks, frames = terms_of(data, pixels, motions, model)
        systems = [schur_complement(data, i, landmarks, frames, pixels.turn) for i in numbers]
        for system, common in zip(systems, shared, strict=True):
            system.H[-N_CALIBRATION:, -N_CALIBRATION:] += SHARED_PRIOR
            system.g[-N_CALIBRATION:] -= SHARED_PRIOR @ common
        if step == iterations:
            break
        poses, points, shared = _stepped(data, systems, landmarks, poses, points, shared)
    covariances = [np.asarray(np.linalg.inv(system.H), dtype=np.float64) for system in systems]
    redundancy = _redundancy(data, motions, np.concatenate([around_intervals(C) for C in covariances]))
    residual = motions.residual * np.repeat([sigmas.linear_velocity, sigmas.angular_velocity], 3)
    squared = pixels.weight * (pixels.residual**2).sum(axis=0)
    return [_fit(data, i, covariances[i], poses, points, shared[i], residual, redundancy, squared) for i in numbers]


def _stepped(
    data: Joined,
    systems: list[Reduced],
    landmarks: Landmarks,
    poses: FloatArray,
    points: FloatArray,
    shared: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Poses, points and shared parameters after a step of each window."""
    deltas = [np.asarray(np.linalg.solve(system.H, system.g), dtype=np.float64) for system in systems]
    dx, pull = np.zeros((len(poses), 6)), landmarks.pull.copy()
    for system, delta, f, p in zip(systems, deltas, data.frames, data.points, strict=True):
        dx[f.start + 1 : f.stop] = delta[:-N_CALIBRATION].reshape(-1, 6)
        pull[:, p] -= back_substitute(system, poses[f.start + 1 : f.stop, :3, :3], delta)
    points = points + landmark_steps(landmarks.factor, pull)
    return poses @ se3.exp(dx), points, shared + np.array([delta[-N_CALIBRATION:] for delta in deltas])


def _redundancy(data: Joined, motions: MotionTerms, covariance: FloatArray) -> FloatArray:
    """(k, 6) 1 - diag(J Sigma J^T) of each whitened motion residual, Sigma (k, 20, 20)."""
    J = np.concatenate([motions.by_before, motions.by_after, motions.by_shared], axis=2)
    J[[data.intervals(i).start for i in range(len(data.frames))], :, :6] = 0.0  # the first pose is held
    return np.asarray(1.0 - ((J @ covariance) * J).sum(axis=2), dtype=np.float64)


def _fit(
    data: Joined,
    window: int,
    covariance: FloatArray,
    poses: FloatArray,
    points: FloatArray,
    shared: FloatArray,
    residual: FloatArray,
    redundancy: FloatArray,
    squared: FloatArray,
) -> WindowFit:
    """Solution of one of the windows, out of the arrays of all."""
    f, o, p, k = data.frames[window], data.observations[window], data.points[window], data.intervals(window)
    left = float(redundancy[k].sum())
    return WindowFit(
        poses=poses[f],
        points=points[p],
        shared=shared,
        shared_information=np.linalg.inv(covariance[-N_CALIBRATION:, -N_CALIBRATION:]) - SHARED_PRIOR,
        motion_residual=residual[k],
        motion_redundancy=redundancy[k],
        pixel_squared=squared[o],
        # 6 rows of each interval stand against the 6 unknowns of a pose
        degrees_of_freedom=3.0 * (o.stop - o.start) - 3.0 * (p.stop - p.start) - N_CALIBRATION - left,
        last_covariance=covariance[-N_CALIBRATION - 6 : -N_CALIBRATION, -N_CALIBRATION - 6 : -N_CALIBRATION],
    )
