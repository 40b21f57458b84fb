"""Stereo tracker: Lucas-Kanade from frame to frame and from left to right, with checks that end a track.

A track keeps its point or ends. It ends where the forward-backward check, the gate on vL - vR, the disparity or the
motion of the rig rejects it; a corner found there later begins a new track.
"""

from dataclasses import dataclass, field

import numpy as np

from fgbaseline.geometry import FloatArray, StereoCamera, se3

from ..observations import BoolArray, IntArray
from .corners import detect_corners
from .local_contrast import equalized
from .opencv import opencv
from .optical_flow import OpticalFlow
from .rectification import Image
from .settings import TrackerSettings

MIN_POINTS = 8
"""points that the motion of the rig is estimated from"""
RANSAC_ITERATIONS = 200
CONFIDENCE = 0.999
SEED = 1
NEAREST = 0.3
"""m; a point predicted nearer to the camera is searched where it was"""


@dataclass(frozen=True, eq=False, slots=True)
class Tracks:
    """Points tracked into one frame."""

    number: IntArray
    """(n,) number of each track, unique in a recording"""
    pixel: FloatArray
    """(n, 4) uL, vL, uR, vR, px, in the rectified pair; NaN in uR and vR with one camera"""

    def select(self, chosen: BoolArray) -> "Tracks":
        """The chosen points (n,)."""
        return Tracks(self.number[chosen], self.pixel[chosen])

    @staticmethod
    def none() -> "Tracks":
        """No point."""
        return Tracks(np.empty(0, np.int64), np.empty((0, 4)))


@dataclass(eq=False)
class StereoTracker:
    """Tracks of a recording, pair by pair; results depend only on images, predictions and settings.

    Corners are found in the images, and tracked and matched in images of equalized local contrast.
    """

    camera: StereoCamera
    settings: TrackerSettings = field(default_factory=TrackerSettings)

    def __post_init__(self) -> None:
        self.tracks = Tracks.none()
        self._left: Image | None = None
        self._motion = np.eye(4)
        self._next = 0
        self._cv2 = opencv()
        self._cv2.setRNGSeed(SEED)
        self._flow = OpticalFlow(self.settings)

    def step(self, left: Image, right: Image, *, rotation: FloatArray | None = None) -> Tracks:
        """Tracks in the next rectified pair of gray images (height, width).

        `rotation` (3, 3), new_R_previous of the left camera, predicts the pixels with the translation of the last
        estimated motion; without it the rotation is that of this motion too.
        """
        even_left, even_right = equalized(left), equalized(right)
        if self._left is not None and len(self.tracks.number):
            self.tracks = self._tracked(self._left, even_left, even_right, rotation)
        corners = self._new_corners(left)
        self.tracks = self._with_matches(corners, even_left, even_right)
        self._left = even_left
        return self.tracks

    def _tracked(self, before: Image, left: Image, right: Image, rotation: FloatArray | None) -> Tracks:
        old = self.tracks
        motion = self._motion.copy()
        if rotation is not None:
            motion[:3, :3] = rotation
        points = self.camera.triangulate(old.pixel)
        predicted = self._projected(motion, points, old.pixel)
        new, found = self._flow.forth_and_back(before, left, old.pixel[:, :2], predicted[:, :2])
        old, points, new, predicted = old.select(found), points[found], new[found], predicted[found]
        offset = predicted[:, 2:] - predicted[:, :2]
        other, matched = self._match(left, right, new, offset)
        tracks = Tracks(old.number, np.concatenate([new, other], axis=1)).select(matched)
        return tracks.select(self._consistent(points[matched], tracks.pixel))

    def _consistent(self, points: FloatArray, pixel: FloatArray) -> BoolArray:
        """Mask (n,) of the points that agree with one motion of the rig (RANSAC), which is kept; all if none is found.

        `points` (n, 3), m, are in the previous left camera frame; `pixel` (n, 4), px, are in this pair.
        """
        everything = np.ones(len(points), dtype=np.bool_)
        if len(points) < MIN_POINTS:
            return everything
        cv2, K, gate = self._cv2, self.camera.K, self.settings.reprojection_gate
        found, rotation, translation, inlier = cv2.solvePnPRansac(
            points,
            pixel[:, :2].copy(),
            K,
            None,
            reprojectionError=gate,
            iterationsCount=RANSAC_ITERATIONS,
            confidence=CONFIDENCE,
            flags=cv2.SOLVEPNP_EPNP,
        )
        if not found or inlier is None or len(inlier) < max(MIN_POINTS, self.settings.static_share * len(points)):
            return everything
        inlier = inlier[:, 0]
        rotation, translation = cv2.solvePnPRefineLM(
            points[inlier], pixel[inlier, :2].copy(), K, None, rotation, translation
        )
        self._motion = np.eye(4)
        self._motion[:3, :3], self._motion[:3, 3] = cv2.Rodrigues(rotation)[0], translation[:, 0]
        error = pixel - self._projected(self._motion, points, pixel)
        disparity_error = np.abs(error[:, 0] - error[:, 2])
        return np.asarray((np.linalg.norm(error[:, :2], axis=1) < gate) & (disparity_error < gate), dtype=np.bool_)

    def _projected(self, motion: FloatArray, points: FloatArray, otherwise: FloatArray) -> FloatArray:
        """Pixels (n, 4) of points (n, 3) of the previous frame after a motion; `otherwise` (n, 4) for near ones."""
        moved = se3.transform(motion, points)
        ahead = moved[:, 2] > NEAREST
        pixel = otherwise.copy()
        pixel[ahead] = self.camera.project(moved[ahead])
        return pixel

    def _match(self, left: Image, right: Image, points: FloatArray, offset: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Points (n, 2) of the right image of points (n, 2) of the left one, searched at an offset (n, 2), px."""
        other, found = self._flow.forth_and_back(left, right, points, points + offset)
        found &= np.abs(other[:, 1] - points[:, 1]) < self.settings.row_gate
        found &= points[:, 0] - other[:, 0] > self.settings.min_disparity
        return other, found

    def _new_corners(self, left: Image) -> FloatArray:
        """Corners (n, 2) of the left image away from the tracks; none where there is no room."""
        room = self.settings.max_features - len(self.tracks.number)
        return detect_corners(left, self.tracks.pixel[:, :2], self.settings) if room > 0 else np.empty((0, 2))

    def _with_matches(self, corners: FloatArray, left: Image, right: Image) -> Tracks:
        """The tracks with new ones of the corners (n, 2) that are found in the right image."""
        tracks, room = self.tracks, self.settings.max_features - len(self.tracks.number)
        if len(corners) == 0:
            return tracks
        offset = np.zeros_like(corners)
        if len(tracks.number):  # the disparity of the nearest track; where that fails, none
            apart = np.linalg.norm(corners[:, None] - tracks.pixel[None, :, :2], axis=2)
            near = tracks.pixel[apart.argmin(axis=1)]
            offset[:, 0] = near[:, 2] - near[:, 0]
        other, matched = self._match(left, right, corners, offset)
        again = ~matched & (offset[:, 0] != 0.0)
        other[again], matched[again] = self._match(left, right, corners[again], np.zeros((int(again.sum()), 2)))
        pixel = np.concatenate([corners, other], axis=1)[matched][:room]
        number = np.arange(self._next, self._next + len(pixel))
        self._next += len(pixel)
        return Tracks(np.concatenate([tracks.number, number]), np.concatenate([tracks.pixel, pixel]))
