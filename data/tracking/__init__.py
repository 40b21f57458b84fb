"""Stereo front end: from rectified image pairs to tracks, with OpenCV (extra `fgbaseline[images]`)."""

from .settings import TrackerSettings
from .stereo_tracker import StereoTracker, Tracks

__all__ = ["StereoTracker", "TrackerSettings", "Tracks"]
