"""Windows of a recording for bundle adjustment: which frames, and their tracks, initial poses and points."""

from itertools import pairwise

import numpy as np

from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, se3
from fgbaseline.geometry.measurement_model import three_rows
from fgbaseline.geometry.triangulation import triangulate_tracks

from ..odometry.stereo_odometry import Odometry
from ..tracks.track_segments import track_chains
from .residuals import Window, WindowData

FRAMES = 25
"""number of frames of a window: more than most tracks have"""
MAX_WINDOWS = 48
MAX_UNBROKEN = 24
"""number of the longest windows without gaps"""
MIN_TRACK = 3
MIN_OBSERVATIONS = 60
MIN_UNBROKEN = 5
"""intervals"""

Span = tuple[int, int]
"""first frame and number of frames of a window"""


def spread_spans(n_frames: int) -> list[Span]:
    """Windows spread evenly over the recording, of at most FRAMES frames.

    Neighbors share a frame where all intervals fit into MAX_WINDOWS, and never more: an interval in two windows would
    count twice.
    """
    intervals, longest = n_frames - 1, FRAMES - 1
    count = max(1, min(MAX_WINDOWS, -(-intervals // longest)))
    if count * longest >= intervals:
        edges = np.round(np.linspace(0, intervals, count + 1)).astype(int)
        return [(int(a), int(b - a) + 1) for a, b in pairwise(edges)]
    return [(int(start), FRAMES) for start in np.linspace(0, n_frames - FRAMES, count).astype(int)]


def unbroken_spans(odometry: Odometry) -> list[Span]:
    """Windows in which odometry knows the motion of every interval, the longest first."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], odometry.known, [False]]).astype(np.int8)))
    spans: list[Span] = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        for first in range(int(start), int(end) - MIN_UNBROKEN + 1, FRAMES):
            spans.append((first, min(FRAMES, int(end) - first + 1)))
    spans.sort(key=lambda span: -span[1])
    return spans[:MAX_UNBROKEN]


def windows_of(
    sequence: Sequence, odometry: Odometry, twist: FloatArray, spans: list[Span], deviation: FloatArray | None = None
) -> list[Window]:
    """Data, initial poses and initial points of each window that has enough observations.

    `twist` (T-1, 6) is the velocity of each interval, and `deviation` that of interpolated ones.
    """
    deviation = np.zeros_like(twist) if deviation is None else deviation
    o, dt = sequence.observations, sequence.dt
    chain = track_chains(odometry.segments.before, odometry.segments.after, odometry.inlier, o)
    known = odometry.known[:, None, None]
    step = np.where(known, odometry.motion, se3.exp(twist * dt[:, None]))
    starts, before = o.frame_starts(sequence.n_frames), 0
    parts: list[tuple[WindowData, FloatArray]] = []
    observed, views, landmarks = [], [], []
    for start, size in spans:
        chosen = np.arange(starts[start], starts[start + size])
        chosen = chosen[chain[chosen] >= 0]
        _, index, length = np.unique(chain[chosen], return_inverse=True, return_counts=True)
        chosen = chosen[length[index] >= MIN_TRACK]
        if len(chosen) < MIN_OBSERVATIONS:
            continue
        intervals = slice(start, start + size - 1)
        poses = se3.compose(step[intervals])
        landmark = np.unique(chain[chosen], return_inverse=True)[1].astype(np.int64)
        frame = o.frame[chosen] - start
        rows_of_pixels = three_rows(o.pixel[chosen])
        data = WindowData(frame, landmark, rows_of_pixels, twist[intervals], dt[intervals], deviation[intervals])
        parts.append((data, poses))
        observed.append(chosen)
        views.append((poses @ sequence.imu_T_cam)[frame])
        landmarks.append(landmark + before)
        before += int(landmark.max()) + 1
    if not parts:
        return []
    pixel, landmark = o.pixel[np.concatenate(observed)], np.concatenate(landmarks)
    unit = MeasurementModel(sequence.camera, 1.0, HuberKernel())
    points = triangulate_tracks(unit, np.concatenate(views), landmark, pixel, before).position
    ends = np.cumsum([data.landmark.max() + 1 for data, _ in parts])[:-1]
    return [(data, poses, own) for (data, poses), own in zip(parts, np.split(points, ends), strict=True)]
