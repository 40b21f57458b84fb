"""Rotations, rigid motions, stereo camera and measurement model on stacked arrays; the error base class."""

from . import se3, so3, strapdown
from .errors import FgbaselineError, InputError
from .measurement import HuberKernel, StereoMeasurement
from .so3 import FloatArray
from .stereo import StereoCamera, disparity

__all__ = [
    "FgbaselineError",
    "FloatArray",
    "HuberKernel",
    "InputError",
    "StereoCamera",
    "StereoMeasurement",
    "disparity",
    "se3",
    "so3",
    "strapdown",
]
