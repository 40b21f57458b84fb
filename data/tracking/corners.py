"""New corners where the grid has room: smallest eigenvalue of the structure tensor, with non-maximum suppression."""

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FloatArray

from .opencv import opencv
from .settings import TrackerSettings

BORDER = 6
"""px along the edges of the image without corners"""
STRONGEST = 99.9
"""percentile of the eigenvalues that `corner_quality` refers to"""


def detect_corners(image: NDArray[np.uint8], tracked: FloatArray, settings: TrackerSettings) -> FloatArray:
    """Corners (n, 2), px, strongest first, in cells with fewer than `features_per_cell` points of `tracked` (m, 2)."""
    cv2 = opencv()
    height, width = image.shape
    response = cv2.cornerMinEigenVal(image, 3, ksize=3)
    threshold = settings.corner_quality * float(np.percentile(response[::4, ::4], STRONGEST))
    free = np.zeros((height, width), np.uint8)
    free[BORDER : height - BORDER, BORDER : width - BORDER] = 255
    for x, y in np.rint(tracked).astype(int).tolist():
        cv2.circle(free, (x, y), settings.min_distance, 0, -1)
    response[free == 0] = 0.0
    side = 2 * (settings.min_distance // 2) + 1
    maximum = (response == cv2.dilate(response, np.ones((side, side), np.uint8))) & (response > threshold)
    y, x = np.nonzero(maximum)
    strength = response[y, x]
    occupied = np.bincount(_cells(tracked, image.shape, settings), minlength=settings.grid_rows * settings.grid_columns)
    corners = np.stack([x, y], axis=1).astype(np.float64)
    cell = _cells(corners, image.shape, settings)
    order = np.lexsort((-strength, cell))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.searchsorted(cell[order], cell[order])
    chosen = np.flatnonzero(rank < settings.features_per_cell - occupied[cell])
    return corners[chosen[np.argsort(-strength[chosen], kind="stable")]]


def _cells(points: FloatArray, shape: tuple[int, ...], settings: TrackerSettings) -> NDArray[np.int64]:
    """Cell of the grid (n,) of points (n, 2) in an image of the shape (height, width)."""
    height, width = shape
    row = np.clip(points[:, 1], 0, height - 1).astype(np.int64) * settings.grid_rows // height
    column = np.clip(points[:, 0], 0, width - 1).astype(np.int64) * settings.grid_columns // width
    return row * settings.grid_columns + column
