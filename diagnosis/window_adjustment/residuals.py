"""Data of windows, and whitened residuals of pixels and velocities with their Jacobians."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import NoiseSettings
from fgbaseline.geometry import FloatArray, MeasurementModel, se3, so3

N_CALIBRATION = 8
"""Number of calibration parameters, constant within a window: gyroscope bias b (3, rad/s), velocity scale - 1 (s),
misalignment phi (3, rad) and disparity offset d (px). Recorded are the velocities [(1 + s) exp(phi) v, exp(phi) w + b],
in axes rotated by phi against those of imu_T_cam, and uR + d, so that all disparities are too small by d."""
SCALE, MISALIGNMENT, OFFSET = 3, slice(4, 7), 7
"""indices of velocity scale, misalignment and disparity offset among the calibration parameters"""


@dataclass(frozen=True, eq=False, slots=True)
class WindowData:
    """Measurements of a window of W frames with n observations of m landmarks."""

    frame: IntArray
    """(n,) 0..W-1, sorted"""
    landmark: IntArray
    """(n,) 0..m-1; no landmark twice in a frame"""
    pixel: FloatArray
    """(n, 3) uL, uR and (vL + vR) / 2"""
    twist: FloatArray
    """(W-1, 6) recorded [v, w] of each interval, in the axes of imu_T_cam"""
    dt: FloatArray
    """(W-1,) s"""
    deviation: FloatArray
    """(W-1, 6) standard deviation of interpolated velocities, besides the noise; zero for recorded ones"""


Window = tuple[WindowData, FloatArray, FloatArray]
"""data, poses first_T_imu (W, 4, 4) of which the first is fixed, and points (m, 3) in the IMU frame of the first"""


@dataclass(frozen=True, eq=False, slots=True)
class WindowBatch:
    """Batch of windows: their data concatenated, so that terms are computed in one call."""

    frame: IntArray
    """(n,) frame among the F frames of all windows"""
    landmark: IntArray
    """(n,) landmark among those of all windows"""
    pixel: FloatArray
    """(n, 3)"""
    twist: FloatArray
    """(k, 6)"""
    deviation: FloatArray
    """(k, 6)"""
    dt: FloatArray
    """(k,)"""
    interval: IntArray
    """(k,) frame at which each interval begins"""
    observations: tuple[slice, ...]
    """slice of the observations of each window"""
    frames: tuple[slice, ...]
    points: tuple[slice, ...]

    @property
    def n_frames(self) -> int:
        """Number F of frames of all windows."""
        return int(self.frames[-1].stop)

    @property
    def n_points(self) -> int:
        """Number of landmarks of all windows."""
        return int(self.points[-1].stop)

    def intervals(self, window: int) -> slice:
        """Slice of the intervals of one window."""
        return slice(self.frames[window].start - window, self.frames[window].stop - window - 1)


def concatenate_windows(windows: Sequence[Window]) -> WindowBatch:
    """Batch of these windows."""
    data = [window[0] for window in windows]
    observations = _slices([len(d.frame) for d in data])
    frames, points = _slices([len(d.dt) + 1 for d in data]), _slices([len(window[2]) for window in windows])
    return WindowBatch(
        frame=np.concatenate([d.frame + at.start for d, at in zip(data, frames, strict=True)]),
        landmark=np.concatenate([d.landmark + at.start for d, at in zip(data, points, strict=True)]),
        pixel=np.concatenate([d.pixel for d in data]),
        twist=np.concatenate([d.twist for d in data]),
        deviation=np.concatenate([d.deviation for d in data]),
        dt=np.concatenate([d.dt for d in data]),
        interval=np.concatenate([np.arange(at.start, at.stop - 1) for at in frames]),
        observations=observations,
        frames=frames,
        points=points,
    )


def _slices(lengths: list[int]) -> tuple[slice, ...]:
    ends = np.cumsum(lengths).tolist()
    return tuple(slice(end - length, end) for end, length in zip(ends, lengths, strict=True))


class PixelTerms(NamedTuple):
    """Whitened residuals of the three rows of n observations, with their Jacobians.

    Each coordinate is in an array of its own, since stacks of small matrices take far longer.
    """

    residual: FloatArray
    """(3, n)"""
    J_point: FloatArray
    """(3, 3, n) derivatives of the rows w.r.t. the point in the world"""
    arm: FloatArray
    """(3, n) m, from the IMU to the point, in world axes. A translation v and rotation w of the pose, in world axes,
    change the rows like a displacement -v - w x arm of the point."""
    weight: FloatArray
    """(n,) kernel weights; zero where the point is not in front of the camera"""
    rotation: FloatArray
    """(F, 3, 3) rotations of the poses"""


class MotionTerms(NamedTuple):
    """Whitened velocity residuals of k intervals, with their Jacobians."""

    residual: FloatArray
    """(k, 6) recorded velocity minus that of the poses"""
    J_before: FloatArray
    """(k, 6, 6) derivatives of the velocity of the poses w.r.t. the pose before the interval"""
    J_after: FloatArray
    """(k, 6, 6) derivatives w.r.t. the pose after it"""
    J_calibration: FloatArray
    """(k, 6, 8) derivatives w.r.t. the calibration parameters"""


def pixel_terms(
    model: MeasurementModel,
    imu_T_cam: FloatArray,
    data: WindowBatch,
    poses: FloatArray,
    points: FloatArray,
    calibration: FloatArray,
) -> PixelTerms:
    """Pixel terms at poses (F, 4, 4) and points (m, 3), for each window's `calibration` parameters (w, 8)."""
    point = np.take(np.ascontiguousarray(points.T), data.landmark, axis=1)
    world_T_cam = np.ascontiguousarray(np.moveaxis((poses @ imu_T_cam)[:, :3], 0, 2))
    of_frame = np.take(world_T_cam, data.frame, axis=2)
    axes, seen_from = of_frame[:, :3], of_frame[:, 3]
    q = (axes * (point - seen_from)[:, None]).sum(axis=0)
    front = q[2] > model.camera.min_depth
    q[:, ~front] = [[0.0], [0.0], [1.0]]
    seen, white = model.camera.rows(q), model.whitening_scale[:, None]
    J_point = model.camera.row_derivatives(seen, axes.transpose(1, 0, 2)) * white[:, None]
    residual = data.pixel.T - seen.pixel
    residual[1] -= np.repeat(calibration[:, OFFSET], [o.stop - o.start for o in data.observations])
    residual *= white
    weight = np.where(front, model.weight((residual**2).sum(axis=0)), 0.0)
    arm = point - np.take(np.ascontiguousarray(poses[:, :3, 3].T), data.frame, axis=1)
    return PixelTerms(residual, J_point, arm, weight, poses[:, :3, :3])


def motion_terms(data: WindowBatch, poses: FloatArray, sigmas: NoiseSettings, calibration: FloatArray) -> MotionTerms:
    """Velocity terms at poses (F, 4, 4) and each window's `calibration` parameters (w, 8)."""
    whiten = 1.0 / np.hypot(np.repeat([sigmas.linear_velocity, sigmas.angular_velocity], 3), data.deviation)
    calibration = np.repeat(calibration, [f.stop - f.start - 1 for f in data.frames], axis=0)
    back = se3.inverse(poses[data.interval])
    relative = back @ poses[data.interval + 1]
    twist = se3.log(relative)
    recorded_M_twist = np.zeros((len(twist), 6, 6))
    recorded_M_twist[:, 3:, 3:] = so3.exp_so3(calibration[:, MISALIGNMENT])
    recorded_M_twist[:, :3, :3] = recorded_M_twist[:, 3:, 3:] * (1.0 + calibration[:, SCALE, None, None])
    predicted = (recorded_M_twist @ (twist / data.dt[:, None])[:, :, None])[:, :, 0]
    hat_v, hat_w = so3.hat3(predicted[:, :3]), so3.hat3(predicted[:, 3:])
    predicted[:, 3:] += calibration[:, :3]
    # log(exp(xi) exp(d)) = xi + J_r^-1(xi) d, to second order in the small rotation of one interval
    curly = se3.curly_hat(twist)
    J_after = recorded_M_twist @ (np.eye(6) + 0.5 * curly + curly @ curly / 12.0) / data.dt[:, None, None]
    J_before = -J_after @ se3.adjoint(se3.inverse(relative))
    J_calibration = np.zeros((len(twist), 6, N_CALIBRATION))
    J_calibration[:, 3:, :3] = np.eye(3)
    J_calibration[:, :3, SCALE] = predicted[:, :3] / (1.0 + calibration[:, SCALE, None])
    J_calibration[:, :3, MISALIGNMENT] = -hat_v
    J_calibration[:, 3:, MISALIGNMENT] = -hat_w
    residual = (data.twist - predicted) * whiten
    return MotionTerms(residual, *(J * whiten[:, :, None] for J in (J_before, J_after, J_calibration)))
