"""Stereo front end: from images to tracks, with OpenCV (extra `fgbaseline[images]`)."""

from .pictures import Picture, Pictures
from .pipeline import TrackedRecording, opened_images, track, track_images
from .settings import TrackerSettings
from .sources import ImageOptions, has_images
from .stereo_tracker import StereoTracker, Tracks

__all__ = [
    "ImageOptions",
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
