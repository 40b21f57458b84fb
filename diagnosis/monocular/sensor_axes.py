"""Axes of gyroscope and accelerometer by one camera.

The gyroscope is compared with the rotations that the camera sees. The accelerometer has no counterpart without scale:
its axes are those in which tracks and samples of some seconds have one motion.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS
from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray

from ..conventions.axes import angular_axes
from ..inertial.sensor_axes import MIN_INTERVALS, SensorAxes, in_imu_axes
from ..inertial.units import mean_rates
from ..inertial_initialization.structureless_factors import KeyframeTracks
from ..odometry.stereo_odometry import Odometry
from .initialization_window import FIRST_PIXEL, gyroscope_biases, spread_keyframes, states_at
from .window_tracks import keyframe_tracks, squared_residuals, window_points

SPAN, WINDOWS = 4.0, 4
"""s of a window, and number of those that are spread over the recording"""
WORST = 50.0
"""px, of a window without a solution"""
SMALLEST = 0.3
"""px, below which a misfit says nothing"""
LEAD, FITTING = 2.0, 2.0
"""ratio of misfits by which another convention must lead, and px that it must not exceed"""
MIN_KEYFRAMES = 5


def monocular_axes(sequence: Sequence, seen: Odometry) -> SensorAxes:
    """The conventions of a recording in SI units; as recorded where the camera shows too little."""
    if int(seen.known.sum()) < MIN_INTERVALS:
        return SensorAxes()
    gyroscope = angular_axes(seen.twist(sequence.dt)[:, 3:], mean_rates(sequence), seen.known)
    turned = in_imu_axes(sequence, SensorAxes(gyroscope))
    # a unit has one frame: another one of the accelerometer alone is the exception
    usual = [SensorAxes(accelerometer=gyroscope.name)] if gyroscope.changed else []
    others = [SensorAxes(accelerometer=name, sign=sign) for name in AXIS_CONVENTIONS for sign in (1.0, -1.0)]
    windows = _windows(turned)
    recorded = [_misfit(turned, window) for window in windows]
    informative = [i for i, value in enumerate(recorded) if value > FITTING]
    for candidates in (usual, others):
        found = dict.fromkeys(range(len(candidates)), 0.0)
        for w in informative:
            values = {i: _misfit(in_imu_axes(turned, candidates[i]), windows[w]) for i in found}
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
    """(k-1, 6) of the gyroscope, by the rays"""


def _windows(sequence: Sequence) -> list[_Window]:
    """Windows that are spread over the recording and have tracks in common."""
    assert sequence.imu is not None
    t, imu, found = sequence.t, imu_intervals(sequence.imu, sequence.t), []
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


def _misfit(sequence: Sequence, window: _Window) -> float:
    """Median residual of the tracks along the closed-form motion, px."""
    assert sequence.imu is not None
    imu = imu_intervals(sequence.imu, sequence.t)
    try:
        with np.errstate(all="ignore"):
            pose = states_at(window.biases, sequence, imu, window.frames, window.tracks).pose
            squared = squared_residuals(window.tracks, pose, window_points(window.tracks, pose))
    except (ValueError, np.linalg.LinAlgError):
        return WORST
    median = np.sqrt(np.median(np.where(np.isfinite(squared), squared, np.inf)))
    return float(np.clip(FIRST_PIXEL * median, SMALLEST, WORST))
