"""The start of a problem with one camera: attitude, velocity, biases and scale, with their covariance.

A standing start is known without scale: the body neither moves nor turns while the image stands. A start in motion is
solved over a window that is long enough for the scale. Its tracks count once: every second one finds the start, the
others are for the estimators.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem import InverseDepthPrior, NoiseSettings
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, se3

from ...inertial_initialization.initial_state import NO_POSES, Start, standing_states, start_of
from ...inertial_initialization.least_squares import solve_least_squares
from ...inertial_initialization.states import RelativePoses
from ...inertial_initialization.stationary import keyframes_of, standing_frames, stands
from .initialization_window import Rest, Window, moving_window
from .window_tracks import every_second_track

LONGEST_STAND = 10.0
"""s that are used of a standing start: without points nothing else holds the path"""
STANDING_POSITION, STANDING_ROTATION = 5e-3, 4e-3
"""m and rad, by which a standing body moves and turns"""
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
    used: BoolArray
    """(n,) mask of the observations that a start in motion was found with; estimators do not use them again"""

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
    none = np.zeros(len(sequence.observations), dtype=np.bool_)
    try:
        window = moving_window(sequence, imu, rest)
    except ValueError as error:
        if rest is None:
            raise ValueError(f"the start of one camera is not found: {error}") from error
        text = f"nothing after the standing start determines the scale: {error}"
        return MonocularStart(rest.start, NoiseSettings().pixel, UNKNOWN_DEPTHS, None, text, none)
    start, used = _moving_start(sequence, imu, window) if rest is None else (rest.start, none)
    return MonocularStart(start, window.pixel, window.depths, window, _scale_remark(window), used)


def _scale_remark(window: Window) -> str:
    sigma = 100.0 * window.solution.scale_sigma
    if window.solution.scale_sigma <= EXCITED:
        return f"the motion of {window.span:.1f} s determines the scale to {sigma:.2g} % (1-sigma)"
    return (
        f"the motion does not excite the accelerometer: {window.span:.1f} s determine the scale to {sigma:.2g} % "
        f"(1-sigma), more than {100.0 * EXCITED:g} %, and velocities and gravity no better"
    )


def _moving_start(sequence: Sequence, imu: ImuIntervals, window: Window) -> tuple[Start, BoolArray]:
    """The start by every second track of the window, and the mask (n,) of their observations in its keyframes.

    A start by all of them would have errors that are those of the observations themselves: estimators that use these
    again find the two in agreement, and believe both.
    """
    o = sequence.observations
    tracks, used = every_second_track(sequence, window.frames, window.pixel)
    with np.errstate(all="ignore"):
        solution = solve_least_squares(window.solution.states, imu, window.frames, NO_POSES, tracks)
    if not (np.isfinite(solution.covariance).all() and np.isfinite(solution.states.pose).all()):
        raise ValueError("half of the tracks determine no start")
    source = (
        f"closed form and least squares over every second track and the inertial samples of the first "
        f"{window.span:.2f} s; estimators do not use these {int(used.sum())} of {len(o)} observations again"
    )
    return start_of(solution, source, 0.0), used


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
