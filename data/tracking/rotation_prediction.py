"""Rotation of the left camera from frame to frame, by gyroscope or angular velocities: where points are searched."""

import numpy as np

from fgbaseline.geometry import FloatArray, so3

from .sources import ImageRecording


def rotation_between(recording: ImageRecording, imu_R_cam: FloatArray, before: int, now: int) -> FloatArray | None:
    """Rotation (3, 3) new_R_previous of the rectified left camera; None without motion or extrinsic.

    `imu_R_cam` (3, 3) is that of the rectified left camera.
    """
    if not recording.extrinsic_known:
        return None
    first, last = recording.t[before], recording.t[now]
    if recording.velocities is not None:
        steps = recording.velocities[1][before:now] * np.diff(recording.t[before : now + 1])[:, None]
    elif recording.imu is not None:
        samples = recording.imu.samples
        a, b = np.searchsorted(samples.t, [first, last])
        ends = np.concatenate([[first], samples.t[a:b], [last]])
        middle = 0.5 * (ends[1:] + ends[:-1])
        near = slice(max(a - 1, 0), b + 1)
        rates = samples.angular_velocity[near].T
        rate = np.stack([np.interp(middle, samples.t[near], axis) for axis in rates], axis=1)
        steps = rate * np.diff(ends)[:, None]
    else:
        return None
    turned = np.eye(3)
    for step in so3.exp_so3(steps):
        turned = turned @ step
    return np.asarray(imu_R_cam.T @ turned.T @ imu_R_cam)
