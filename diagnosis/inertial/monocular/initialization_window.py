"""States over the first seconds of motion that determine the scale: initial ones, then least squares with the tracks.

From rest they are predicted by the inertial samples; in motion they are those of the closed form.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import InverseDepthPrior
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, strapdown

from ...inertial_initialization.initial_state import NO_POSES, Start
from ...inertial_initialization.least_squares import Solution, solve_least_squares
from ...inertial_initialization.states import RelativePoses, States, motions_between
from ...inertial_initialization.structureless_factors import KeyframeTracks
from ...robust_constants import CHI_SQUARE_MEDIAN
from .closed_form import closed_form
from .gyroscope_bias import epipolar_bias
from .window_tracks import first_inverse_depths, keyframe_tracks, rays_of, squared_residuals, window_points

SPANS = (2.0, 4.0, 8.0, 16.0)
"""s of a window; the first that determines the scale is taken"""
LASTING = 16.0
"""s over which the pixel noise is found"""
KEYFRAMES = 20
DETERMINED = 0.05
"""1-sigma of the scale of a start, as a share of it, at which its window is long enough. One in motion has half of the
window's tracks, and sqrt(2) times its sigma."""
FIRST_PIXEL = 1.0
"""px, noise of a row in the first solution"""
SMALLEST_PIXEL = 0.05
"""px"""
NEAR = 97.5
"""percentile of the inverse depths that are those of the nearest points"""
FITTING = 100.0
"""median squared residual, in sigmas of `FIRST_PIXEL`, of a solution that is none"""


class Rest(NamedTuple):
    """A standing start."""

    frames: IntArray
    """(k,) keyframes in which the body stands"""
    start: Start
    still: RelativePoses
    """relative poses of these keyframes"""


class Window(NamedTuple):
    """Solution of the first seconds of motion: states, scale, pixel noise and depths of the scene."""

    frames: IntArray
    """(k,) keyframes"""
    span: float
    """duration, s"""
    solution: Solution
    pixel: float
    """px, noise of each row"""
    depths: InverseDepthPrior


def moving_window(sequence: Sequence, imu: ImuIntervals, rest: Rest | None = None) -> Window:
    """Shortest window that determines the scale, otherwise that with the smallest scale sigma, beginning after `rest`.

    Raises ValueError with the reason where no window has a solution.
    """
    best: Window | None = None
    reason = "the recording is too short"
    first = 0 if rest is None else int(rest.frames[-1])
    for frames in _windows(sequence, first):
        try:
            window = _solved(sequence, imu, frames, rest)
        except (ValueError, np.linalg.LinAlgError, RuntimeError) as error:
            reason = str(error)
            continue
        if best is None or window.solution.scale_sigma < best.solution.scale_sigma:
            best = window
        if best.solution.scale_sigma <= (DETERMINED if rest is not None else DETERMINED / np.sqrt(2.0)):
            break
    if best is None:
        raise ValueError(reason)
    lasting = _lasting_noise(sequence, imu, first)
    if lasting <= best.pixel:
        return best
    moving = best.frames if rest is None else best.frames[best.frames >= first]
    return _solved(sequence, imu, moving, rest, lasting)


def _lasting_noise(sequence: Sequence, imu: ImuIntervals, first: int) -> float:
    """Noise of a row, px, over `LASTING` s: tracks drift, so that they fit a short window better; 0 if not found."""
    last = int(np.searchsorted(sequence.t, sequence.t[first] + LASTING, side="right")) - 1
    try:
        return _solved(sequence, imu, spread_keyframes(first, last), None).pixel
    except (ValueError, np.linalg.LinAlgError, RuntimeError):
        return 0.0


def spread_keyframes(first: int, last: int) -> IntArray:
    """At most `KEYFRAMES` keyframes of the frames from `first` to `last`, spread evenly."""
    chosen = np.linspace(first, last, min(KEYFRAMES, last - first + 1)).round()
    return np.unique(chosen.astype(np.int64))


def _windows(sequence: Sequence, first: int) -> list[IntArray]:
    """Keyframes of the windows, each longer than the one before."""
    windows: list[IntArray] = []
    for span in SPANS:
        last = int(np.searchsorted(sequence.t, sequence.t[first] + span, side="right")) - 1
        if last - first >= 4 and (not windows or last > windows[-1][-1]):
            windows.append(spread_keyframes(first, last))
    return windows


def _solved(sequence: Sequence, imu: ImuIntervals, window: IntArray, rest: Rest | None, least: float = 0.0) -> Window:
    """The solution with the noise that fits it, at least `least` px. Raises ValueError where there is no solution."""
    frames = window if rest is None else np.union1d(rest.frames, window)
    tracks = keyframe_tracks(sequence, frames, FIRST_PIXEL)
    if tracks.n_points == 0:
        raise ValueError("no track is in three keyframes")
    still = NO_POSES if rest is None else rest.still
    with np.errstate(all="ignore"):
        states = states_in_motion(sequence, imu, frames, tracks) if rest is None else _from_rest(imu, frames, rest)
        first = solve_least_squares(states, imu, frames, still, tracks)
        pixel = max(_pixel_noise(tracks, first), least)
        tracks = keyframe_tracks(sequence, frames, pixel)
        solution = solve_least_squares(first.states, imu, frames, still, tracks)
    pose = solution.states.pose
    if not (np.isfinite(pose).all() and np.isfinite(solution.scale_sigma)):
        raise ValueError("its least squares does not converge")
    span = float(sequence.t[window[-1]] - sequence.t[window[0]])
    return Window(frames, span, solution, pixel, _depths(tracks, pose))


def states_in_motion(sequence: Sequence, imu: ImuIntervals, frames: IntArray, tracks: KeyframeTracks) -> States:
    """States by the closed form. Raises ValueError without parallax or common tracks."""
    return states_at(gyroscope_biases(imu, frames, tracks), sequence, imu, frames, tracks)


def gyroscope_biases(imu: ImuIntervals, frames: IntArray, tracks: KeyframeTracks) -> FloatArray:
    """Biases (k-1, 6) of the intervals between keyframes, those of the accelerometer zero."""
    biases = np.zeros((len(frames) - 1, 6))
    biases[:, :3] = epipolar_bias(rays_of(tracks), motions_between(imu, frames, biases))
    return biases


def states_at(
    biases: FloatArray, sequence: Sequence, imu: ImuIntervals, frames: IntArray, tracks: KeyframeTracks
) -> States:
    """States by the closed form at known biases (k-1, 6) of the gyroscope."""
    motions = motions_between(imu, frames, biases)
    return closed_form(imu, rays_of(tracks), motions, sequence.imu_T_cam[:3, 3], FIRST_PIXEL / sequence.camera.fu)


def _from_rest(imu: ImuIntervals, frames: IntArray, rest: Rest) -> States:
    """States predicted from the one at rest."""
    pose, velocity, bias = [rest.start.pose], [rest.start.state.velocity], rest.start.state.bias
    motions = motions_between(imu, frames, np.tile(bias, (len(frames) - 1, 1)))
    for i in range(len(frames) - 1):
        after = strapdown.predict(pose[-1], velocity[-1], motions.between(i), imu.gravity_vector)
        pose.append(after[0])
        velocity.append(after[1])
    n = len(frames)
    return States(np.array(pose), np.array(velocity), np.tile(bias[:3], (n, 1)), np.tile(bias[3:], (n, 1)))


def _pixel_noise(tracks: KeyframeTracks, solution: Solution) -> float:
    """Noise of a row, px, by the median of the squared residuals; points take three degrees of freedom each.

    Raises ValueError where they fit no solution.
    """
    pose = solution.states.pose
    points = window_points(tracks, pose) if np.isfinite(pose).all() else np.full((tracks.n_points, 3), np.nan)
    squared = squared_residuals(tracks, pose, points)
    known = np.isfinite(squared)
    if known.sum() < 0.5 * len(squared) or np.median(squared[known]) > FITTING:
        raise ValueError("its least squares does not converge")
    freedom = 1.0 - 3.0 * len(np.unique(tracks.point[known])) / (2.0 * known.sum())
    found = np.sqrt(np.median(squared[known]) / CHI_SQUARE_MEDIAN[2] / max(freedom, 0.1))
    return max(SMALLEST_PIXEL, FIRST_PIXEL * float(found))


def _depths(tracks: KeyframeTracks, pose: FloatArray) -> InverseDepthPrior:
    """Median inverse depth; the nearest points are within two sigma, and infinity within one.

    Raises ValueError where no track has a point.
    """
    inverse = first_inverse_depths(tracks, pose, window_points(tracks, pose))
    known = inverse[np.isfinite(inverse)]
    if len(known) == 0:
        raise ValueError("no track has a point along its trajectory")
    median, near = np.percentile(np.maximum(known, 0.0), [50.0, NEAR])
    return InverseDepthPrior(float(median), float(max(median, 0.5 * (near - median))))
