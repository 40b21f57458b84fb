"""Noise, bias and calibration errors from bundle adjustments of many short windows."""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.geometry import FloatArray, HuberKernel, StereoMeasurement, se3
from fgbaseline.geometry.measurement import measured_rows
from fgbaseline.geometry.triangulation import triangulate_tracks

from ..observations import IntArray
from ..sequence import Sequence
from .inflation import Inflation, inflation_of
from .odometry import Odometry
from .window import SHARED_PRIOR, WindowFit, fit_windows_alike
from .window_terms import SHARED, Sigmas, Window, WindowData

FRAMES = 25
"""of a window: longer than most tracks"""
MAX_WINDOWS = 48
MAX_UNBROKEN = 24
"""windows without gaps, the longest ones"""
MIN_TRACK = 3
MIN_OBSERVATIONS = 60
ROUNDS = 6
START = Sigmas(pixel=1.0, linear=0.4, angular=0.02)
"""px, baselines/s and rad/s"""
FLOOR = Sigmas(pixel=0.02, linear=2e-4, angular=1e-5)
"""px, baselines/s and rad/s: no noise is less"""
CHI_SQUARE_MEDIAN = 0.4549
"""of one degree of freedom"""
MIN_REDUNDANCY = 0.05
"""of a velocity's residual: below it the fit follows the velocity, as over an interval that the cameras do not see, and
its residual is no evidence of noise"""
MIN_UNBROKEN = 5
"""intervals"""


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """What the windows agree on."""

    sigmas: Sigmas
    """the noise that a filter may believe"""
    shared: FloatArray
    """(8,) see `window_terms.SHARED`"""
    deviation: FloatArray
    """(8,) standard errors, from the spread between windows where that is larger than what each claims"""
    windows: int
    inflation: Inflation
    white: Sigmas
    """the noise as it seems within a window: `sigmas` without what lasts"""
    motion: FloatArray
    """(n, 6) velocity residuals of all windows, each over the deviation that the sigmas and its redundancy give it: of
    unit normal distribution where the noise is as found; NaN where the cameras tell nothing"""


def chains(odometry: Odometry, landmark: IntArray, frame: IntArray) -> IntArray:
    """(n,) a number for each observation: equal for those that inlier links join, -1 where none does."""
    n = len(landmark)
    linked = np.zeros(n, dtype=np.bool_)
    joined = np.zeros(n, dtype=np.bool_)
    inlier = odometry.inlier
    joined[odometry.links.after[inlier]] = True
    linked[odometry.links.after[inlier]] = linked[odometry.links.before[inlier]] = True
    order = np.lexsort((frame, landmark))
    chain = np.empty(n, dtype=np.int64)
    chain[order] = np.cumsum(~joined[order])
    return np.where(linked, chain, -1)


def fit_windows(sequence: Sequence, odometry: Odometry, twist: FloatArray, processes: int = 1) -> Fit | None:
    """The common answer of windows spread over the recording; None where no window has enough observations.

    `twist` (T-1, 6) is the recorded velocity of each interval, turned to the axes of imu_T_cam. The sigmas are the
    variance components at which residuals are as large as their degrees of freedom say; medians over axes and windows
    keep a bad window from deciding.
    """
    windows = _windows(sequence, odometry, twist, _spread(sequence.n_frames))
    if not windows:
        return None
    baseline = sequence.camera.baseline
    sigmas = replace(START, linear=START.linear * baseline)
    shared = [np.zeros(SHARED)] * len(windows)
    fits: list[WindowFit] = []
    for _ in range(ROUNDS):
        fits = fit_windows_alike(sequence.camera, sequence.imu_T_cam, windows, sigmas, shared, 1, processes)
        windows = [(data, fit.poses, fit.points) for (data, _, _), fit in zip(windows, fits, strict=True)]
        shared = [fit.shared for fit in fits]
        sigmas = _components(fits, sigmas, baseline)
    shared_mean, deviation = _agreed(fits)
    unbroken = _windows(sequence, odometry, twist, _unbroken(odometry))
    inflation = inflation_of(sequence, unbroken, shared_mean, sigmas, processes)
    believed = Sigmas(
        sigmas.pixel * inflation.pixel, sigmas.linear * inflation.velocity, sigmas.angular * inflation.velocity
    )
    residual = np.concatenate([fit.motion_residual for fit in fits]) / np.repeat([sigmas.linear, sigmas.angular], 3)
    redundancy = np.concatenate([fit.motion_redundancy for fit in fits])
    motion = np.where(redundancy > MIN_REDUNDANCY, residual / np.sqrt(np.maximum(redundancy, MIN_REDUNDANCY)), np.nan)
    return Fit(believed, shared_mean, deviation, len(fits), inflation, sigmas, motion)


def half_cost(sequence: Sequence, odometry: Odometry, twist: FloatArray, sigmas: Sigmas, processes: int = 1) -> float:
    """Half the sum of squares, in `sigmas`, that remains when windows are fitted to these velocities (T-1, 6)."""
    whiten = np.repeat([sigmas.linear, sigmas.angular], 3)
    total = 0.0
    windows = _windows(sequence, odometry, twist, _spread(sequence.n_frames))
    start = [np.zeros(SHARED)] * len(windows)
    for fit in fit_windows_alike(sequence.camera, sequence.imu_T_cam, windows, sigmas, start, 5, processes):
        total += 0.5 * float(fit.pixel_squared.sum() + np.sum((fit.motion_residual / whiten) ** 2))
    return total


Span = tuple[int, int]
"""first frame and number of frames of a window"""


def _spread(n_frames: int) -> list[Span]:
    """Windows spread evenly over the recording; neighbours share a frame, so that no interval is left out."""
    size = min(FRAMES, n_frames)
    count = max(1, min(MAX_WINDOWS, -(-(n_frames - 1) // (size - 1))))
    return [(int(start), size) for start in np.unique(np.linspace(0, n_frames - size, count).astype(int))]


def _unbroken(odometry: Odometry) -> list[Span]:
    """Windows without an interval over which the cameras see nothing, the longest stretches first."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], odometry.known, [False]]).astype(np.int8)))
    spans: list[Span] = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        for first in range(int(start), int(end) - MIN_UNBROKEN + 1, FRAMES):
            spans.append((first, min(FRAMES, int(end) - first + 1)))
    spans.sort(key=lambda span: -span[1])
    return spans[:MAX_UNBROKEN]


def _windows(sequence: Sequence, odometry: Odometry, twist: FloatArray, spans: list[Span]) -> list[Window]:
    """Data, initial poses and initial points of each window that has enough observations."""
    o, dt = sequence.observations, sequence.dt
    chain = chains(odometry, o.landmark, o.frame)
    known = odometry.known[:, None, None]
    step = np.where(known, odometry.motion, se3.exp(twist * dt[:, None]))
    starts, before = o.frame_starts(sequence.n_frames), 0
    parts: list[tuple[WindowData, FloatArray]] = []
    sights, views, rows = [], [], []
    for start, size in spans:
        chosen = np.arange(starts[start], starts[start + size])
        chosen = chosen[chain[chosen] >= 0]
        _, row, length = np.unique(chain[chosen], return_inverse=True, return_counts=True)
        chosen = chosen[length[row] >= MIN_TRACK]
        if len(chosen) < MIN_OBSERVATIONS:
            continue
        intervals = slice(start, start + size - 1)
        poses = se3.compose(step[intervals])
        row = np.unique(chain[chosen], return_inverse=True)[1].astype(np.int64)
        frame = o.frame[chosen] - start
        data = WindowData(frame, row, measured_rows(o.pixel[chosen]), twist[intervals], dt[intervals])
        parts.append((data, poses))
        sights.append(chosen)
        views.append((poses @ sequence.imu_T_cam)[frame])
        rows.append(row + before)
        before += int(row.max()) + 1
    if not parts:
        return []
    pixel, row = o.pixel[np.concatenate(sights)], np.concatenate(rows)
    unit = StereoMeasurement(sequence.camera, 1.0, HuberKernel())
    points = triangulate_tracks(unit, np.concatenate(views), row, pixel, before).position
    ends = np.cumsum([data.row.max() + 1 for data, _ in parts])[:-1]
    return [(data, poses, own) for (data, poses), own in zip(parts, np.split(points, ends), strict=True)]


def _components(fits: list[WindowFit], sigmas: Sigmas, baseline: float) -> Sigmas:
    residual = np.concatenate([fit.motion_residual for fit in fits])
    redundancy = np.concatenate([fit.motion_redundancy for fit in fits])
    told = redundancy > MIN_REDUNDANCY
    share = np.where(told, residual**2 / np.maximum(redundancy, MIN_REDUNDANCY), np.nan)
    variance = np.nanmedian(share, axis=0) / CHI_SQUARE_MEDIAN if told.any(axis=0).all() else np.zeros(6)
    pixel = np.median([fit.pixel_squared.sum() / max(fit.degrees_of_freedom, 1.0) for fit in fits])
    return Sigmas(
        pixel=max(FLOOR.pixel, sigmas.pixel * float(np.sqrt(pixel))),
        linear=max(FLOOR.linear * baseline, float(np.sqrt(variance[:3].mean()))),
        angular=max(FLOOR.angular, float(np.sqrt(variance[3:].mean()))),
    )


def _agreed(fits: list[WindowFit]) -> tuple[FloatArray, FloatArray]:
    """The information-weighted mean (8,) of the shared parameters, windows far off left out, and its deviation."""
    information = np.array([fit.shared_information for fit in fits])
    values = np.array([fit.shared for fit in fits])
    centre = np.median(values, axis=0)
    spread = 1.4826 * np.median(np.abs(values - centre), axis=0) + 1e-9
    keep = (np.abs(values - centre) < 5.0 * spread).all(axis=1) if len(fits) > 4 else np.ones(len(fits), dtype=bool)
    total = information[keep].sum(axis=0) + SHARED_PRIOR
    mean = np.linalg.solve(total, np.einsum("wij,wj->i", information[keep], values[keep]))
    claimed = np.sqrt(np.diag(np.linalg.inv(total)))
    # The same mean's variance from how the windows differ: (sum I)^-1 sum I d d^T I (sum I)^-1
    difference = np.einsum("wij,wj->wi", information[keep], values[keep] - mean)
    inverse = np.linalg.inv(total)
    seen = np.sqrt(np.diag(inverse @ (difference.T @ difference) @ inverse))
    return mean, np.asarray(np.maximum(claimed, seen), dtype=np.float64)
