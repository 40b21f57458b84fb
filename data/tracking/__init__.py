"""Stereo front end: from images to tracks, with OpenCV (extra `fgbaseline[images]`)."""

from .pipeline import TrackedRecording, track
from .settings import TrackerSettings
from .sources import ImageOptions, has_images
from .stereo_tracker import StereoTracker, Tracks

__all__ = ["ImageOptions", "StereoTracker", "TrackedRecording", "TrackerSettings", "Tracks", "has_images", "track"]
