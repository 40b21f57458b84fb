"""Observations of one camera in files: NaN in uR and vR of all of them."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError
from fgbaseline.geometry.stereo_camera import PIXEL_COMPONENTS

from ...observations import IntArray, Observations

IGNORED_BASELINE = "b is ignored: all observations are of one camera."


def require_one_kind(key: str, frame: IntArray, landmark: IntArray, pixel: FloatArray) -> None:
    """Refuses values that are not finite in pixels (n, 4), but for NaN in uR and vR of all observations.

    Raises InputError naming frame and landmark.
    """
    finite = np.isfinite(pixel)
    if finite.all():
        return
    alone = np.isnan(pixel[:, 2:]).all(axis=1)
    broken = ~finite.all(axis=1) & ~(alone & finite[:, :2].all(axis=1))
    if broken.any():
        i = int(np.argmax(broken))
        row = int(np.argmax(~finite[i]))
        raise InputError(
            f"{key}: {PIXEL_COMPONENTS[row]} of landmark {landmark[i]} in frame {frame[i]} is {pixel[i, row]}; leave "
            "out what was not observed (-1 in all four rows of a block), and for one camera write NaN in both uR and vR"
        )
    if not alone.all():
        one, two = int(np.argmax(alone)), int(np.argmin(alone))
        raise InputError(
            f"{key}: landmark {landmark[one]} in frame {frame[one]} is observed by one camera (uR and vR are NaN), "
            f"landmark {landmark[two]} in frame {frame[two]} by two; give all observations of two cameras, or NaN in "
            "uR and vR of all"
        )


def is_of_one_camera(observations: Observations) -> bool:
    """Whether the observations, all of one kind, are of one camera."""
    return bool(len(observations) and np.isnan(observations.pixel[0, 2]))
