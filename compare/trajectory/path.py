"""How far a path went, and which way it was heading, seen from above."""

import numpy as np

from fgbaseline.geometry import FloatArray

STANDING = 0.1
"""of the path's brisk steps (their 90th percentile): below it noise decides where a step points, and the path keeps the
direction it had"""


def distance_travelled(positions: FloatArray) -> FloatArray:
    """(T,) length of the path through positions (T, 3), m; steps to or from an unknown position count as zero."""
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])


def travel_frame(positions: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit vectors forward (T, 3) and left (T, 3) of a path (T, 3) seen from above, and upward (3,).

    Forward is the horizontal part of the step around each frame; where the path stands, that of the last frame that
    moved (before the first one, of that).
    """
    upward = up / np.linalg.norm(up)
    step = np.gradient(positions, axis=0) if len(positions) > 1 else np.zeros_like(positions)
    horizontal = step - np.outer(step @ upward, upward)
    length = np.linalg.norm(horizontal, axis=1)
    brisk = np.nanpercentile(length, 90) if np.isfinite(length).any() else 0.0
    moving = np.flatnonzero(length > max(STANDING * float(brisk), np.finfo(np.float64).tiny))
    if len(moving) == 0:
        sideways = np.eye(3)[int(np.argmin(np.abs(upward)))]
        direction = np.cross(np.cross(upward, sideways), upward)
        forward = np.tile(direction / np.linalg.norm(direction), (len(positions), 1))
    else:
        source = moving[np.maximum(np.searchsorted(moving, np.arange(len(positions)), side="right") - 1, 0)]
        forward = horizontal[source] / length[source, None]
    return forward, np.cross(upward, forward), upward
