"""Front end: from images of a pair or of one camera to tracks, with OpenCV (extra `fgbaseline[images]`)."""

from .monocular_tracker import MonocularTracker
from .pipeline import TrackedRecording, opened_images, track, track_images
from .settings import TrackerSettings
from .sources import Cameras, ImageOptions, has_images
from .stereo_tracker import StereoTracker, Tracks
from .thumbnails import Picture, Pictures

__all__ = [
    "Cameras",
    "ImageOptions",
    "MonocularTracker",
    "Picture",
    "Pictures",
    "StereoTracker",
    "TrackedRecording",
    "TrackerSettings",
    "Tracks",
    "has_images",
    "opened_images",
    "track",
    "track_images",
]
