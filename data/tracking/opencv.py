"""OpenCV, which is optional: without it one sentence says what to install."""

from types import ModuleType

from fgbaseline.geometry import InputError


def opencv() -> ModuleType:
    """The module cv2. Raises InputError where it is not installed."""
    try:
        import cv2
    except ImportError:
        raise InputError("images: OpenCV is not installed; pip install 'fgbaseline[images]'") from None
    return cv2
