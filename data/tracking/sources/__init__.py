"""Recordings of stereo images: EuRoC, TUM-VI, KITTI, two folders with a calibration, and ROS bags."""

from .detection import ImageOptions, has_images, open_recording
from .image_recording import ImagePair, ImageRecording

__all__ = ["ImageOptions", "ImagePair", "ImageRecording", "has_images", "open_recording"]
