"""Text files of numbers, a fixed count to a line, read fast and yet with the line named where something is wrong."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ..observations import IntArray


@dataclass(frozen=True, slots=True)
class NumberTable:
    """n lines of m finite numbers, and where in the file each of them stands."""

    values: FloatArray
    """(n, m)"""
    line: IntArray
    """(n,) line numbers, from 1"""


@dataclass(frozen=True, slots=True)
class Lines:
    """The lines of a text file that say something, without comments."""

    number: list[int]
    """where in the file each stands, from 1"""
    text: list[str]

    @property
    def separator(self) -> str | None:
        """What stands between the words of the first line: a comma, or None for blanks."""
        return "," if "," in self.text[0] else None

    @property
    def width(self) -> int:
        """How many words the first line has."""
        return len(self.text[0].split(self.separator))


def read_lines(file: Path) -> Lines:
    """The lines of a text file; blank lines and everything behind a `#` are left out.

    Raises InputError naming the line for what is no text, and where nothing is left; OSError as `open` does.
    """
    numbers, texts = [], []
    for number, line in enumerate(_text(file).split("\n"), start=1):
        content = line.partition("#")[0].strip()
        if content:
            numbers.append(number)
            texts.append(content)
    if not texts:
        raise InputError("the file has no poses in it; check that it is the right one")
    return Lines(numbers, texts)


def read_numbers(file: Path, counts: dict[int, str]) -> NumberTable:
    """The numbers of a text file, separated by blanks. Raises as `read_lines` and `numbers_of`."""
    return numbers_of(read_lines(file), counts)


def numbers_of(lines: Lines, counts: dict[int, str], separator: str | None = None) -> NumberTable:
    """The numbers of lines, separated by blanks (or by `separator`).

    `counts` says how many numbers a line may have, and what such a file is called; the first line decides. Raises
    InputError naming the line for a word that is no number, a wrong count, NaN or infinity.
    """
    width = len(lines.text[0].split(separator))
    if width not in counts:
        expected = " or ".join(f"{n} ({name})" for n, name in counts.items())
        kind = "numbers" if separator is None else "numbers between commas"
        raise InputError(f"line {lines.number[0]}: expected {expected} {kind}, got {width}: {_short(lines.text[0])}")
    try:
        values = np.loadtxt(lines.text, dtype=np.float64, comments=None, ndmin=2, delimiter=separator)
    except ValueError as error:
        raise _culprit(lines, width, separator) from error
    if values.shape[1] != width or not np.isfinite(values).all():
        raise _culprit(lines, width, separator)
    return NumberTable(values, np.array(lines.number, dtype=np.int64))


def _text(file: Path) -> str:
    content = file.read_bytes()
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"line {line}: it is not text (byte {content[error.start]:#04x}); give a text file") from error


def _culprit(lines: Lines, width: int, separator: str | None) -> InputError:
    """The error for the first line that is not `width` finite numbers."""
    for number, text in zip(lines.number, lines.text, strict=True):
        words = [word.strip() for word in text.split(separator)]
        if len(words) != width:
            return InputError(f"line {number}: expected {width} numbers, got {len(words)}: {_short(text)}")
        for word in words:
            if not _is_finite_number(word):
                return InputError(f"line {number}: {_short(word)} is no finite number; remove the line or mend it")
    return InputError(f"the file is no table of {width} numbers a line; check that it is the right one")


def _is_finite_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word))) and "_" not in word and word.isascii()
    except ValueError:
        return False


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")
