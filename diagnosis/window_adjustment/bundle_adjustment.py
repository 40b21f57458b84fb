"""Bundle adjustment of short windows of frames: poses and landmarks from pixels and velocities together.

Dense and exact: landmarks are eliminated by the Schur complement, poses are few. Unlike frame-to-frame odometry it has
residuals with the right number of degrees of freedom, from which noise can be estimated.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fgbaseline.data.parallel import background_map
from fgbaseline.data.problem import NoiseSettings
from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, StereoCamera, se3

from .normal_equations import (
    Landmarks,
    ReducedSystem,
    back_substitute,
    interval_covariances,
    landmark_steps,
    normal_equation_blocks,
    schur_complement,
)
from .residuals import N_CALIBRATION, MotionTerms, Window, WindowBatch, concatenate_windows, motion_terms, pixel_terms

MAX_BATCH_OBSERVATIONS = 8000
"""observations at which a batch of windows is closed: its arrays should fit into a cache"""
CALIBRATION_PRIOR = np.diag(1.0 / np.array([0.1] * 3 + [0.3] + [0.1] * 3 + [1.0]) ** 2)
"""(8, 8) information of the zero-mean prior on the calibration parameters: sigmas 0.1 rad/s, 0.3, 0.1 rad and 1 px. It
regularizes those that a window does not determine (a rotation about the direction of travel)."""


@dataclass(frozen=True, eq=False, slots=True)
class WindowFit:
    """Solution of a window, with residuals and redundancy."""

    poses: FloatArray
    """(W, 4, 4) first_T_imu, in the IMU frame at the first frame of the window"""
    points: FloatArray
    """(m, 3) m, in the same frame"""
    calibration: FloatArray
    """(8,) calibration parameters: see `residuals.N_CALIBRATION`"""
    calibration_information: FloatArray
    """(8, 8) marginal information about `calibration`, poses and landmarks marginalized out, without the prior"""
    motion_residual: FloatArray
    """(W-1, 6) recorded minus fitted velocity, m/s and rad/s; where interpolated, scaled by sigma / hypot(sigma,
    deviation), so that its expected variance is sigma^2"""
    motion_redundancy: FloatArray
    """(W-1, 6) redundancy numbers: share of each residual's variance that the fit did not absorb"""
    pixel_squared: FloatArray
    """(n,) kernel-weighted squared residual of three whitened rows"""
    degrees_of_freedom: float
    """degrees of freedom of the pixel residuals"""
    last_covariance: FloatArray
    """(6, 6) covariance of the right perturbation of the last pose"""


def fit_each_window(
    camera: StereoCamera,
    imu_T_cam: FloatArray,
    windows: Sequence[Window],
    sigmas: NoiseSettings,
    calibration: Sequence[FloatArray],
    iterations: int,
    processes: int = 1,
) -> list[WindowFit]:
    """Fits each window separately by `iterations` Gauss-Newton steps.

    Each has calibration parameters of its own under the prior CALIBRATION_PRIOR, which start at `calibration` (8,).
    """
    groups: list[list[int]] = [[]]
    for i in range(len(windows)):
        if sum(len(windows[j][0].frame) for j in groups[-1]) >= MAX_BATCH_OBSERVATIONS:
            groups.append([])
        groups[-1].append(i)

    def fitted(group: list[int]) -> list[WindowFit]:
        chosen = [windows[i] for i in group]
        return _fitted(camera, imu_T_cam, chosen, sigmas, np.array([calibration[i] for i in group]), iterations)

    with background_map(lambda number: fitted(groups[number]), len(groups) if windows else 0, processes) as gathered:
        return [fit for fits in gathered() for fit in fits]


def _fitted(
    camera: StereoCamera,
    imu_T_cam: FloatArray,
    windows: list[Window],
    sigmas: NoiseSettings,
    calibration: FloatArray,
    iterations: int,
) -> list[WindowFit]:
    data, numbers = concatenate_windows(windows), range(len(windows))
    model = MeasurementModel(camera, sigmas.pixel**2, HuberKernel())
    poses, points = (np.concatenate(parts) for parts in list(zip(*windows, strict=True))[1:])
    for step in range(iterations + 1):
        pixels = pixel_terms(model, imu_T_cam, data, poses, points, calibration)
        motions = motion_terms(data, poses, sigmas, calibration)
        landmarks, frames = normal_equation_blocks(data, pixels, motions, model)
        systems = [schur_complement(data, i, landmarks, frames, pixels.rotation) for i in numbers]
        for system, common in zip(systems, calibration, strict=True):
            system.H[-N_CALIBRATION:, -N_CALIBRATION:] += CALIBRATION_PRIOR
            system.g[-N_CALIBRATION:] -= CALIBRATION_PRIOR @ common
        if step == iterations:
            break
        poses, points, calibration = _stepped(data, systems, landmarks, poses, points, calibration)
    covariances = [np.asarray(np.linalg.inv(system.H), dtype=np.float64) for system in systems]
    redundancy = _redundancy(data, motions, np.concatenate([interval_covariances(C) for C in covariances]))
    residual = motions.residual * np.repeat([sigmas.linear_velocity, sigmas.angular_velocity], 3)
    squared = pixels.weight * (pixels.residual**2).sum(axis=0)
    return [
        _fit(data, i, covariances[i], poses, points, calibration[i], residual, redundancy, squared) for i in numbers
    ]


def _stepped(
    data: WindowBatch,
    systems: list[ReducedSystem],
    landmarks: Landmarks,
    poses: FloatArray,
    points: FloatArray,
    calibration: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Poses, points and calibration parameters after one step of each window."""
    deltas = [np.asarray(np.linalg.solve(system.H, system.g), dtype=np.float64) for system in systems]
    dx, gradient = np.zeros((len(poses), 6)), landmarks.gradient.copy()
    for system, delta, f, p in zip(systems, deltas, data.frames, data.points, strict=True):
        dx[f.start + 1 : f.stop] = delta[:-N_CALIBRATION].reshape(-1, 6)
        gradient[:, p] -= back_substitute(system, poses[f.start + 1 : f.stop, :3, :3], delta)
    points = points + landmark_steps(landmarks.factor, gradient)
    return poses @ se3.exp(dx), points, calibration + np.array([delta[-N_CALIBRATION:] for delta in deltas])


def _redundancy(data: WindowBatch, motions: MotionTerms, covariance: FloatArray) -> FloatArray:
    """Redundancy numbers (k, 6), 1 - diag(J Sigma J^T), of whitened motion residuals; `covariance` (k, 20, 20)."""
    J = np.concatenate([motions.J_before, motions.J_after, motions.J_calibration], axis=2)
    J[[data.intervals(i).start for i in range(len(data.frames))], :, :6] = 0.0  # the first pose is fixed
    return np.asarray(1.0 - ((J @ covariance) * J).sum(axis=2), dtype=np.float64)


def _fit(
    data: WindowBatch,
    window: int,
    covariance: FloatArray,
    poses: FloatArray,
    points: FloatArray,
    calibration: FloatArray,
    residual: FloatArray,
    redundancy: FloatArray,
    squared: FloatArray,
) -> WindowFit:
    """Solution of one window, from the arrays of a batch of windows."""
    f, o, p, k = data.frames[window], data.observations[window], data.points[window], data.intervals(window)
    motion_redundancy = float(redundancy[k].sum())
    return WindowFit(
        poses=poses[f],
        points=points[p],
        calibration=calibration,
        calibration_information=np.linalg.inv(covariance[-N_CALIBRATION:, -N_CALIBRATION:]) - CALIBRATION_PRIOR,
        motion_residual=residual[k],
        motion_redundancy=redundancy[k],
        pixel_squared=squared[o],
        # total redundancy 3 n + 6 K - (6 K + 3 m + 8), less that of the velocity residuals
        degrees_of_freedom=3.0 * (o.stop - o.start) - 3.0 * (p.stop - p.start) - N_CALIBRATION - motion_redundancy,
        last_covariance=covariance[-N_CALIBRATION - 6 : -N_CALIBRATION, -N_CALIBRATION - 6 : -N_CALIBRATION],
    )
