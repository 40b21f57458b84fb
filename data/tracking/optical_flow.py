"""Lucas-Kanade optical flow from one image to another, and back."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray

from ..observations import BoolArray
from .opencv import opencv
from .rectification import Image
from .settings import TrackerSettings


@dataclass(frozen=True, slots=True)
class OpticalFlow:
    """Flow of points, with the settings of a tracker."""

    settings: TrackerSettings

    def forth_and_back(
        self, first: Image, second: Image, points: FloatArray, guess: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        """Points (n, 2) of the second image, and those of them that flow back to where they were.

        `points` (n, 2) are of the first image, and searched at `guess` (n, 2) of the second one.
        """
        new, found = self._flow(first, second, points, guess)
        back, returned = self._flow(second, first, new, points)
        apart = np.linalg.norm(back - points, axis=1)
        return new, found & returned & (apart < self.settings.forward_backward) & _inside(new, second)

    def _flow(self, first: Image, second: Image, points: FloatArray, guess: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Points (n, 2) of the second image, and which were found, of points (n, 2) of the first."""
        cv2, n = opencv(), len(points)
        if n == 0:
            return np.empty((0, 2)), np.zeros(0, dtype=np.bool_)
        new, status, _ = cv2.calcOpticalFlowPyrLK(
            first,
            second,
            points.astype(np.float32).reshape(n, 1, 2),
            guess.astype(np.float32).reshape(n, 1, 2),
            winSize=(self.settings.window, self.settings.window),
            maxLevel=self.settings.pyramid_levels,
            criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01),
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )
        return new.reshape(n, 2).astype(np.float64), status.reshape(n).astype(np.bool_)


def _inside(points: FloatArray, image: Image) -> BoolArray:
    """Points (n, 2) at least a pixel within the image."""
    height, width = image.shape
    x, y = points[:, 0], points[:, 1]
    return np.asarray((x >= 1.0) & (x <= width - 2.0) & (y >= 1.0) & (y <= height - 2.0), dtype=np.bool_)
