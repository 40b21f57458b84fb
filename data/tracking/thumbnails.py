"""Images of a recording for its page: downscaled JPEGs of rectified images, thinned evenly to a number of bytes."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray

from .opencv import opencv
from .rectification import Image

WIDEST = 480
"""px; wider images are downscaled to it"""
QUALITY = 60
"""quality of the JPEGs, up to 100"""
MOST_BYTES = 12_000_000
"""limit on all JPEGs, so that a page with them stays below 20 MB in base64"""


class Picture(NamedTuple):
    """Rectified images of one frame as JPEG."""

    t: float
    """s, stamp of the frame"""
    images: tuple[bytes, ...]
    """left and, of a pair, right"""

    @property
    def n_bytes(self) -> int:
        """Size of all."""
        return sum(map(len, self.images))


@dataclass(eq=False)
class Pictures:
    """Images of every `step`-th frame; the step doubles when the pairs outgrow `most_bytes`."""

    most_bytes: int = MOST_BYTES
    step: int = 1
    size: tuple[int, int] | None = None
    """width and height of the rectified images before downscaling, px"""
    pairs: dict[int, Picture] = field(default_factory=dict)
    """pictures by the number of the frame"""

    def add(self, frame: int, t: float, *images: Image) -> None:
        """Adds the images of a frame, left and right or left alone, if its turn has come."""
        self.size = images[0].shape[1], images[0].shape[0]
        if frame % self.step:
            return
        self.pairs[frame] = Picture(t, tuple(map(_jpeg, images)))
        self.thin(self.most_bytes)

    def thin(self, most_bytes: int) -> None:
        """Doubles the step until the pairs have at most so many bytes, or one pair is left."""
        while len(self.pairs) > 1 and sum(pair.n_bytes for pair in self.pairs.values()) > most_bytes:
            self.step *= 2
            self.pairs = {k: pair for k, pair in self.pairs.items() if k % self.step == 0}

    def by_frame(self, t: FloatArray) -> dict[int, Picture]:
        """Pairs by their frames among the stamps t (T,), s, rising; pairs of other stamps are left out."""
        found = {}
        for pair in self.pairs.values():
            k = int(np.searchsorted(t, pair.t))
            if k < len(t) and t[k] == pair.t:
                found[k] = pair
        return found


def _jpeg(image: Image) -> bytes:
    cv2 = opencv()
    height, width = image.shape
    if width > WIDEST:
        image = cv2.resize(image, (WIDEST, round(height * WIDEST / width)), interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1])
