"""Along-track frame of a path."""

import numpy as np

from fgbaseline.geometry import FloatArray

STANDING = 0.1
"""ratio to the 90th percentile of step lengths up to which a step is a standstill, and its direction noise"""


def along_track_frame(positions: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit vectors along track (T, 3), across track to the left (T, 3) and up (3,) of positions (T, 3), m.

    Along track is the horizontal part of the central difference. At standstill it is that of the last moving frame,
    and before the first moving frame that of the first.
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
