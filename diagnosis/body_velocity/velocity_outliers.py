"""Outliers among the recorded velocities: single samples that contradict the cameras and their neighbors.

A bit error or a missing sample written as zero is no noise: least squares would turn the extrinsic by it. Neither
evidence suffices alone: a real jerk contradicts the neighbors, and wrong odometry contradicts the velocities. The delay
is not known yet, so that the cameras count at all shifts of up to `MAX_SHIFT` intervals.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fgbaseline.data.observations import BoolArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.velocity_increments import held_samples
from fgbaseline.geometry import FloatArray

from ..conventions.neighbor_deviation import FAR_BLIND, among_neighbors, far
from ..odometry.stereo_odometry import Odometry

MAX_SHIFT = 3
"""intervals"""
FAR = 20.0
"""median differences; recordings whose velocities are sound stay below 17"""


@dataclass(frozen=True, eq=False, slots=True)
class VelocityOutliers:
    """Outliers of a recording, and the velocities in their place: interpolated between the samples around them."""

    linear: BoolArray
    """(T,)"""
    angular: BoolArray
    """(T,)"""
    interpolated: FloatArray
    """(T, 6) m/s and rad/s in recorded axes, the recorded velocities where no sample is an outlier"""
    deviation: FloatArray
    """(T, 6) its standard deviation, zero where no sample is an outlier"""
    size: tuple[float, float]
    """m/s and rad/s, the largest difference of an outlier from the velocity in its place"""

    def replaced(self, sequence: Sequence) -> Sequence:
        """The recording with the interpolated velocities."""
        linear, angular = self.interpolated[:, :3].copy(), self.interpolated[:, 3:].copy()
        return replace(sequence, linear_velocity=linear, angular_velocity=angular)

    def of_intervals(self, shift: float, linear: FloatArray, angular: FloatArray) -> FloatArray:
        """Standard deviations (T-1, 6) of the intervals, rotated by `linear` and `angular` (3, 3)."""
        parts = np.hsplit(self.deviation, 2)
        turned = [part @ np.abs(matrix.T) for part, matrix in zip(parts, (linear, angular), strict=True)]
        return held_samples(np.hstack(turned), shift)


def velocity_outliers(
    sequence: Sequence, seen_by_cameras: Odometry, linear: FloatArray, angular: FloatArray
) -> VelocityOutliers | None:
    """The outliers of a recording in SI units, None without any; `linear` and `angular` (3, 3) turn its axes."""
    seen = seen_by_cameras.twist(sequence.dt)
    groups = ((sequence.linear_velocity, linear, slice(3)), (sequence.angular_velocity, angular, slice(3, 6)))
    masks = [_outliers(recorded @ axes.T, seen[:, part]) for recorded, axes, part in groups]
    if not any(mask.any() for mask in masks):
        return None
    values, deviations, sizes = [], [], []
    for (recorded, _, _), mask in zip(groups, masks, strict=True):
        value = recorded.copy()
        for axis in range(3):
            value[mask, axis] = np.interp(sequence.t[mask], sequence.t[~mask], recorded[~mask, axis])
        values.append(value)
        deviations.append(_deviation(recorded, mask))
        sizes.append(float(np.linalg.norm(value - recorded, axis=1).max()))
    return VelocityOutliers(
        linear=masks[0],
        angular=masks[1],
        interpolated=np.hstack(values),
        deviation=np.hstack(deviations),
        size=(sizes[0], sizes[1]),
    )


def _outliers(recorded: FloatArray, seen: FloatArray) -> BoolArray:
    """Mask (T,) of the samples (T, 3) that are far from their neighbors and from all that is `seen` (T-1, 3) nearby."""
    _, among = among_neighbors(recorded)
    constant = np.nanmedian(recorded[:-1] - seen, axis=0)  # as a bias
    padded = np.pad(seen + constant, ((MAX_SHIFT, MAX_SHIFT + 1), (0, 0)), constant_values=np.nan)
    nearby = sliding_window_view(padded, 2 * MAX_SHIFT + 1, axis=0)
    difference = np.linalg.norm(nearby - recorded[:, :, None], axis=1)
    blind = np.isnan(difference).all(axis=1)
    nearest = np.nanmin(np.where(blind[:, None], 0.0, difference), axis=1)
    against = far(np.where(blind, np.nan, nearest), recorded)
    return np.asarray((among > FAR) & np.where(blind, among > FAR_BLIND, against > FAR), dtype=np.bool_)


def _deviation(recorded: FloatArray, outlier: BoolArray) -> FloatArray:
    """Standard deviations (T, 3) of interpolated velocities; zero for the others.

    It is the RMS error of the same interpolation over samples (T, 3) that are no outliers. A run of outliers shares
    its error, which is divided among them.
    """
    deviation = np.zeros(recorded.shape)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], outlier, [False]]).astype(np.int8)))
    for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if start == 0 or end == len(recorded):  # held
            reach = end - start
            sound = ~(outlier[reach:] | outlier[:-reach])
            error = (recorded[reach:] - recorded[:-reach])[sound]
        else:
            reach = (end - start + 2) // 2
            middle = slice(reach, len(recorded) - reach)
            sound = ~(outlier[: -2 * reach] | outlier[middle] | outlier[2 * reach :])
            error = (recorded[middle] - 0.5 * (recorded[: -2 * reach] + recorded[2 * reach :]))[sound]
        spread = np.sqrt(np.mean(error**2, axis=0)) if sound.any() else np.abs(recorded[~outlier]).max(axis=0)
        deviation[start:end] = spread * np.sqrt(end - start)
    return deviation
