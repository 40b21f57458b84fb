"""Rotations, rigid motions and the stereo camera on stacked arrays; the error base class."""

from . import se3, so3
from .errors import FgbaselineError, InputError
from .so3 import FloatArray
from .stereo import StereoCamera, disparity

__all__ = ["FgbaselineError", "FloatArray", "InputError", "StereoCamera", "disparity", "se3", "so3"]
