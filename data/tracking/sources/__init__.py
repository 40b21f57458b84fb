"""Recordings of images: EuRoC, TUM-VI, KITTI, folders with a calibration, and ROS bags."""

from .format_detection import Cameras, ImageOptions, has_images, open_recording
from .image_recording import ImagePair, ImageRecording

__all__ = ["Cameras", "ImageOptions", "ImagePair", "ImageRecording", "has_images", "open_recording"]
