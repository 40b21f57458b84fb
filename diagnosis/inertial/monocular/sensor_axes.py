"""Axes of gyroscope and accelerometer, of a recording with one camera.

The gyroscope is compared with the rotations of visual odometry. The accelerometer has no such counterpart, as scale is
unknown: its axes are those in which one motion in closed form fits the tracks and samples of a few seconds.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS
from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem.inertial import ImuIntervals, imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray

from ...conventions.axes import angular_axes
from ...inertial_initialization.structureless_factors import KeyframeTracks
from ...odometry.stereo_odometry import Odometry
from ..sensor_axes import MIN_INTERVALS, SensorAxes, in_imu_axes
from ..units import mean_rates
from .initialization_window import FIRST_PIXEL, gyroscope_biases, spread_keyframes, states_at
from .window_tracks import keyframe_tracks, squared_residuals, window_points

SPAN, WINDOWS = 4.0, 4
"""length of a window, s, and number of windows, spread over the recording"""
WORST = 50.0
"""px, misfit of a window without a solution"""
SMALLEST = 0.3
"""px, misfit below which windows are equally good"""
LEAD, FITTING = 2.0, 2.0
"""ratio by which the misfit of another convention must be smaller, and px that it must not exceed"""
MIN_KEYFRAMES = 5
"""smallest number of keyframes of a window"""


def monocular_axes(sequence: Sequence, seen: Odometry) -> SensorAxes:
    """Conventions of both sensors of a recording in SI units; as recorded where the camera does not determine them."""
    if int(seen.known.sum()) < MIN_INTERVALS:
        return SensorAxes()
    gyroscope = angular_axes(seen.twist(sequence.dt)[:, 3:], mean_rates(sequence), seen.known)
    turned = in_imu_axes(sequence, SensorAxes(gyroscope))
    # Both sensors of an IMU usually have the same axes, so those of the gyroscope are tried first.
    usual = [SensorAxes(accelerometer=gyroscope.name)] if gyroscope.changed else []
    others = [SensorAxes(accelerometer=name, sign=sign) for name in AXIS_CONVENTIONS for sign in (1.0, -1.0)]
    assert turned.imu is not None
    imu = imu_intervals(turned.imu, turned.t)
    windows = _windows(turned, imu)
    recorded = [_misfit(turned, imu, window) for window in windows]
    informative = [i for i, value in enumerate(recorded) if value > FITTING]
    for candidates in (usual, others):
        found = dict.fromkeys(range(len(candidates)), 0.0)
        for w in informative:
            values = {i: _misfit(turned, _rotated(imu, candidates[i]), windows[w]) for i in found}
            found = {
                i: found[i] + np.log(value) for i, value in values.items() if value < min(FITTING, recorded[w] / LEAD)
            }
        if found and informative:
            best = min(found, key=lambda i: found[i])
            misfits = (
                float(np.exp(np.mean(np.log([recorded[w] for w in informative])))),
                float(np.exp(found[best] / len(informative))),
            )
            return replace(candidates[best], gyroscope=gyroscope, misfit=misfits)
    return SensorAxes(gyroscope)


class _Window(NamedTuple):
    frames: IntArray
    tracks: KeyframeTracks
    biases: FloatArray
    """(k-1, 6) biases of both sensors between keyframes, of which rays determine the gyroscope's"""


def _rotated(imu: ImuIntervals, axes: SensorAxes) -> ImuIntervals:
    """Intervals with the specific force in other axes; a signed permutation leaves their noise as it is."""
    return replace(imu, specific_force=imu.specific_force @ axes.accelerometer_matrix.T)


def _windows(sequence: Sequence, imu: ImuIntervals) -> list[_Window]:
    """Windows spread over the recording, those with common tracks."""
    t, found = sequence.t, []
    for start in np.linspace(t[0], max(float(t[-1]) - SPAN, float(t[0])), WINDOWS):
        first, last = np.searchsorted(t, [start, start + SPAN])
        frames = spread_keyframes(int(first), min(int(last), len(t) - 1))
        tracks = keyframe_tracks(sequence, frames, FIRST_PIXEL)
        try:
            if len(frames) >= MIN_KEYFRAMES and tracks.n_points:
                found.append(_Window(frames, tracks, gyroscope_biases(imu, frames, tracks)))
        except (ValueError, np.linalg.LinAlgError):
            continue
    return found


def _misfit(sequence: Sequence, imu: ImuIntervals, window: _Window) -> float:
    """Median residual, px, of a window's tracks along its motion in closed form."""
    try:
        with np.errstate(all="ignore"):
            pose = states_at(window.biases, sequence, imu, window.frames, window.tracks).pose
            squared = squared_residuals(window.tracks, pose, window_points(window.tracks, pose))
    except (ValueError, np.linalg.LinAlgError):
        return WORST
    median = np.sqrt(np.median(np.where(np.isfinite(squared), squared, np.inf)))
    return float(np.clip(FIRST_PIXEL * median, SMALLEST, WORST))
