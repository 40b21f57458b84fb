"""Images with their local mean and contrast equalized.

Lucas-Kanade takes the brightness of a point for constant. Cameras of a pair differ in exposure and vignetting, and
exposure changes from frame to frame.
"""

import numpy as np

from .opencv import opencv
from .rig import Image

WINDOW = 31
"""px, side of the square over which mean and deviation are taken"""
NOISE = 10.0
"""gray levels; keeps the noise of surfaces without texture small"""
GAIN = 45.0
"""gray levels for a standard deviation"""


def equalized(image: Image) -> Image:
    """128 plus `GAIN` times the deviation from the local mean, in local standard deviations; (height, width)."""
    cv2 = opencv()
    values = image.astype(np.float32)
    mean = cv2.blur(values, (WINDOW, WINDOW))
    square = cv2.sqrBoxFilter(image, cv2.CV_32F, (WINDOW, WINDOW))
    deviation = cv2.sqrt(cv2.max(square - mean * mean, 0.0) + NOISE**2)
    result: Image = cv2.addWeighted(
        cv2.divide(values - mean, deviation), GAIN, np.zeros_like(values), 0.0, 128.0, dtype=cv2.CV_8U
    )
    return result
