"""Image files as 8-bit grey images, read pair by pair."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import InputError

from ...formats.files.file_errors import reading, shown
from ..opencv import opencv
from ..rectification import Image
from .image_recording import ImagePair

SUFFIXES = (".png", ".jpg", ".jpeg", ".pgm", ".tif", ".tiff", ".bmp")
ENDS = {b"\x89PNG": b"IEND", b"\xff\xd8\xff": b"\xff\xd9"}
"""marks near the end of a complete file, by its first bytes: decoders fill in what is missing"""
TAIL = 64
BITS = (8, 10, 12, 14, 16)
"""bits of cameras whose images are stored with 16"""
Raw = NDArray[Any]


def image_files(folder: Path) -> list[Path]:
    """Image files of a folder, by name. Raises InputError where there is none."""
    with reading(folder):
        found = sorted(file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES)
        if not found:
            raise InputError(f"there is no image in it; expected files that end in {', '.join(SUFFIXES)}")
    return found


def decoded(data: bytes) -> Raw | None:
    """Grey image (height, width) of 8 or 16 bits in the bytes of a file; None where it is damaged."""
    cv2 = opencv()
    end = next((end for start, end in ENDS.items() if data.startswith(start)), b"")
    if not data or end not in data[-TAIL:]:
        return None
    try:
        image: Raw | None = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_ANYDEPTH)
    except cv2.error:
        return None
    return image


class EightBits:
    """Conversion of one camera's images to 8 bits, by the largest value so far: no image is clipped.

    The shift only rises. An image after a brighter one keeps its scale; a step of the scale is one of the exposure.
    """

    def __init__(self) -> None:
        self._shift = 0

    def __call__(self, image: Raw | None) -> Image | None:
        """The image in 8 bits; None stays None."""
        if image is None or image.dtype == np.uint8:
            return image
        self._shift = max(self._shift, next(bits for bits in BITS if int(image.max()) < 2**bits) - 8)
        eight: Image = (image >> self._shift).astype(np.uint8)
        return eight


def size_of(file: Path) -> tuple[int, int]:
    """Width and height, px, from the head of a file. Raises InputError."""
    from PIL import Image as Pillow
    from PIL import UnidentifiedImageError

    with reading(file):
        try:
            with Pillow.open(file) as image:
                return image.size
        except UnidentifiedImageError:
            raise InputError("it is not an image; check the file") from None


def file_pairs(files: Sequence[tuple[Path, ...]]) -> Callable[[], Iterator[ImagePair]]:
    """Reader of pairs of files, or of the files of one camera."""

    def pairs() -> Iterator[ImagePair]:
        convert = EightBits(), EightBits()
        for both in files:
            images = [to(_image(file)) for to, file in zip(convert, both, strict=False)]
            broken = next((file for file, image in zip(both, images, strict=True) if image is None), both[0])
            yield ImagePair(images[0], images[1] if len(images) == 2 else None, shown(broken))

    return pairs


def _image(file: Path) -> Raw | None:
    try:
        return decoded(file.read_bytes())
    except OSError:
        return None
