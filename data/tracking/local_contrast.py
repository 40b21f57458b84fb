"""Images with their local mean and contrast equalized.

Lucas-Kanade takes the brightness of a point for constant. Cameras of a pair differ in exposure and vignetting, and
exposure changes from frame to frame.
"""

import numpy as np

from .opencv import opencv
from .rectification import Image

COARSE = 4
"""side in px of the image for one px of the coarse image, in which mean and deviation are computed"""
WINDOW = 9
"""side of the square over which mean and deviation are computed, px of the coarse image"""
NOISE = 10.0
"""gray levels; keeps the noise of surfaces without texture small"""
GAIN = 45.0
"""gray levels for a standard deviation"""


def equalized(image: Image) -> Image:
    """128 plus `GAIN` times the deviation from the local mean, in local standard deviations; (height, width)."""
    cv2 = opencv()
    height, width = image.shape
    coarse = (max(1, width // COARSE), max(1, height // COARSE))
    values = image.astype(np.float32)
    mean, square = (
        cv2.blur(cv2.resize(each, coarse, interpolation=cv2.INTER_AREA), (WINDOW, WINDOW))
        for each in (values, cv2.multiply(values, values))
    )
    gain = GAIN / np.sqrt(np.maximum(square - mean * mean, 0.0) + np.float32(NOISE**2))
    gains, offset = (cv2.resize(each, (width, height)) for each in (gain, 128.0 - gain * mean))
    result: Image = cv2.add(cv2.multiply(values, gains), offset, dtype=cv2.CV_8U)
    return result
