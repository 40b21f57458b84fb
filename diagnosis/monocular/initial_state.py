"""The start of a problem with one camera: attitude, velocity, biases and scale, with their covariance.

A standing start is known without scale: the body neither moves nor turns while the image stands. A start in motion is
solved over a window that is long enough for the scale. Estimators use the frames of that window again; so that they do
not count twice, its deviations are multiplied by `LOOSENED`.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import InverseDepthPrior, NoiseSettings
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, se3

from ..inertial_initialization.initial_state import Start, standing_states, start_of
from ..inertial_initialization.least_squares import solve_least_squares
from ..inertial_initialization.states import RelativePoses
from ..inertial_initialization.stationary import keyframes_of, standing_frames, stands
from .initialization_window import Rest, Window, moving_window

LONGEST_STAND = 10.0
"""s that are used of a standing start: without points nothing else holds the path"""
STANDING_POSITION, STANDING_ROTATION = 5e-3, 4e-3
"""m and rad, by which a standing body moves and turns"""
LOOSENED = 2.0
"""factor of the deviations of a start in motion: what it says then counts a quarter. Larger factors make filters less
consistent: what is linear within the errors is not within what is claimed"""
EXCITED = 0.1
"""relative 1-sigma of the scale above which the motion does not excite the scale"""
UNKNOWN_DEPTHS = InverseDepthPrior(0.25, 0.25)
"""1/m, where no depth is found"""


class MonocularStart(NamedTuple):
    """Start, and what the first seconds of motion say of the scene."""

    start: Start
    pixel: float
    """px, noise of each row; assumed where no window has a solution"""
    depths: InverseDepthPrior
    window: Window | None
    """None where no window has a solution"""
    remark: str
    """sentence on the accuracy of the scale, without its full stop"""

    def path(self, n_frames: int) -> FloatArray:
        """Poses (T, 4, 4) of the window and of frame 0, NaN elsewhere."""
        poses = np.full((n_frames, 4, 4), np.nan)
        if self.window is not None:
            poses[self.window.frames] = self.window.solution.states.pose
        if self.window is None or self.window.frames[0] > 0:
            poses[0] = self.start.pose
        return poses

    @property
    def excited(self) -> bool:
        """Whether the motion determines the scale."""
        return self.window is not None and self.window.solution.scale_sigma <= EXCITED


def monocular_start(sequence: Sequence, imu: ImuIntervals) -> MonocularStart:
    """The start of a recording with one camera. Raises ValueError with the reason where there is none."""
    frames = standing_frames(sequence, LONGEST_STAND)
    rest = _rest(sequence, imu, frames) if stands(sequence, frames) else None
    try:
        window = moving_window(sequence, imu, rest)
    except ValueError as error:
        if rest is None:
            raise ValueError(f"the start of one camera is not found: {error}") from error
        text = f"nothing after the standing start determines the scale: {error}"
        return MonocularStart(rest.start, NoiseSettings().pixel, UNKNOWN_DEPTHS, None, text)
    start = _moving_start(window) if rest is None else rest.start
    return MonocularStart(start, window.pixel, window.depths, window, _scale_remark(window))


def _scale_remark(window: Window) -> str:
    sigma = 100.0 * window.solution.scale_sigma
    if window.solution.scale_sigma <= EXCITED:
        return f"the motion of {window.span:.1f} s determines the scale to {sigma:.2g} % (1-sigma)"
    return (
        f"the motion does not excite the accelerometer: {window.span:.1f} s determine the scale to {sigma:.2g} % "
        f"(1-sigma), more than {100.0 * EXCITED:g} %, and velocities and gravity no better"
    )


def _moving_start(window: Window) -> Start:
    source = f"closed form and least squares over tracks and inertial samples of the first {window.span:.2f} s"
    start = start_of(window.solution, source, 0.0)
    return start._replace(state=replace(start.state, covariance=start.state.covariance * LOOSENED**2))


def _rest(sequence: Sequence, imu: ImuIntervals, frames: IntArray) -> Rest:
    keyframes = keyframes_of(frames)
    still = _still(len(keyframes))
    seconds = float(sequence.t[frames[-1]] - sequence.t[0])
    source = f"standing start of {seconds:.2f} s, in which the camera sees no motion"
    start = start_of(solve_least_squares(standing_states(imu, keyframes), imu, keyframes, still), source, seconds)
    return Rest(keyframes, start, still)


def _still(n: int) -> RelativePoses:
    """Poses of n keyframes relative to the first: none of them moves."""
    covariance: FloatArray = np.diag(np.repeat([STANDING_POSITION, STANDING_ROTATION], 3) ** 2)
    later = np.arange(1, n)
    poses = se3.exp(np.zeros((n - 1, 6)))
    return RelativePoses(np.zeros(n - 1, np.int64), later, poses, np.tile(covariance, (n - 1, 1, 1)))
