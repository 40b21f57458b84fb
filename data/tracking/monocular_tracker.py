"""Tracker of one camera: Lucas-Kanade from image to image, with checks that end a track.

As in `stereo_tracker` a track keeps its point or ends. The forward-backward check is the same; in place of the match in
the right image, the epipolar constraint of one motion of the camera (five points, RANSAC) rejects what does not agree.
"""

from dataclasses import dataclass, field

import numpy as np

from fgbaseline.geometry import FloatArray, MonocularCamera

from ..observations import BoolArray
from .corners import detect_corners
from .local_contrast import equalized
from .opencv import opencv
from .optical_flow import OpticalFlow
from .rectification import Image
from .settings import TrackerSettings
from .stereo_tracker import CONFIDENCE, MIN_POINTS, Tracks


@dataclass(eq=False)
class MonocularTracker:
    """Tracks of one camera, image by image; results depend on nothing but images, predictions and settings."""

    camera: MonocularCamera
    settings: TrackerSettings = field(default_factory=TrackerSettings)

    def __post_init__(self) -> None:
        self.tracks = Tracks.none()
        self._before: Image | None = None
        self._next = 0
        self._flow = OpticalFlow(self.settings)

    def step(self, image: Image, *, rotation: FloatArray | None = None) -> Tracks:
        """Tracks in the next undistorted gray image (height, width); uR and vR of their pixels are NaN.

        `rotation` (3, 3), new_R_previous of the camera, predicts where points are searched; without it they are
        searched where they were.
        """
        even = equalized(image)
        if self._before is not None and len(self.tracks.number):
            self.tracks = self._tracked(self._before, even, rotation)
        room = self.settings.max_features - len(self.tracks.number)
        if room > 0:
            self._add(detect_corners(image, self.tracks.pixel[:, :2], self.settings)[:room])
        self._before = even
        return self.tracks

    def _tracked(self, before: Image, now: Image, rotation: FloatArray | None) -> Tracks:
        old = self.tracks.pixel[:, :2]
        guess = old if rotation is None else self._turned(old, rotation)
        new, found = self._flow.forth_and_back(before, now, old, guess)
        tracks = self.tracks.select(found)
        tracks = Tracks(tracks.number, _left(new[found]))
        return tracks.select(self._consistent(old[found], new[found]))

    def _turned(self, pixel: FloatArray, rotation: FloatArray) -> FloatArray:
        """Pixels (n, 2) of the same directions after a rotation; those that turn behind the camera stay."""
        K = self.camera.K
        turned = np.column_stack([pixel, np.ones(len(pixel))]) @ (K @ rotation @ np.linalg.inv(K)).T
        ahead = turned[:, 2] > 0.0
        return np.where(ahead[:, None], turned[:, :2] / np.where(ahead, turned[:, 2], 1.0)[:, None], pixel)

    def _consistent(self, old: FloatArray, new: FloatArray) -> BoolArray:
        """Mask (n,) of the points (n, 2) of two images that agree with one motion; all if none is found.

        Where the camera only turns, every direction of motion fits, and the rotation alone is checked.
        """
        everything = np.ones(len(old), dtype=np.bool_)
        if len(old) < MIN_POINTS:
            return everything
        cv2 = opencv()
        _, inlier = cv2.findEssentialMat(
            old, new, self.camera.K, method=cv2.RANSAC, prob=CONFIDENCE, threshold=self.settings.reprojection_gate
        )
        if inlier is None or np.count_nonzero(inlier) < max(MIN_POINTS, self.settings.static_share * len(old)):
            return everything
        return np.asarray(inlier[:, 0] > 0, dtype=np.bool_)

    def _add(self, corners: FloatArray) -> None:
        """Adds corners (n, 2) as new tracks."""
        number = np.arange(self._next, self._next + len(corners))
        self._next += len(corners)
        pixel = np.concatenate([self.tracks.pixel, _left(corners)])
        self.tracks = Tracks(np.concatenate([self.tracks.number, number]), pixel)


def _left(pixel: FloatArray) -> FloatArray:
    """Pixels (n, 4) of points (n, 2) of the left image."""
    return np.concatenate([pixel, np.full_like(pixel, np.nan)], axis=1)
