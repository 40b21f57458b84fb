"""Rotations, rigid motions, stereo camera and measurement model on stacked arrays; the error base class."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import se3, so3, strapdown
    from .errors import FgbaselineError, InputError
    from .measurement_model import HuberKernel, MeasurementModel
    from .monocular_camera import Camera, MonocularCamera
    from .so3 import FloatArray
    from .stereo_camera import StereoCamera, disparity
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "se3": "se3",
            "so3": "so3 FloatArray",
            "strapdown": "strapdown",
            "errors": "FgbaselineError InputError",
            "measurement_model": "HuberKernel MeasurementModel",
            "monocular_camera": "Camera MonocularCamera",
            "stereo_camera": "StereoCamera disparity",
        },
    )

__all__ = [
    "Camera",
    "FgbaselineError",
    "FloatArray",
    "HuberKernel",
    "InputError",
    "MeasurementModel",
    "MonocularCamera",
    "StereoCamera",
    "disparity",
    "se3",
    "so3",
    "strapdown",
]
