"""Reads text files of numbers with equally many fields on each line; each fault is reported with its line.

This module is plain Python, so that a fault is reported before numpy is imported; `NumberTable` has arrays.
"""

import re
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import isfinite, isnan
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING

from fgbaseline.geometry import InputError

from .wrong_file_type import require_table

if TYPE_CHECKING:
    from fgbaseline.geometry import FloatArray

    from ...observations import IntArray

GZIP = b"\x1f\x8b"
AT_ONCE = 10_000
"""lines that are split at a time"""
MOST_BYTES = 2**30
"""limit on a file, unpacked"""
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(e[+-]?\d+)?", re.IGNORECASE)
WINDOWS_NAN = re.compile(r"nan\([a-z]*\)", re.IGNORECASE)
MISSING = ("", "none", "null", "na", "n/a")
"""fields that pandas, Python, JSON and R write for NaN, in lower case"""
DATE = re.compile(r"\d{4}-\d{1,2}-\d{1,2}([T ].*)?")


@dataclass(frozen=True, slots=True)
class NumberTable:
    """n lines of m numbers, with their line numbers in the file."""

    numbers: "array[float]"
    """n times m, line by line"""
    number: Sequence[int]
    """(n,) line numbers, from 1"""

    @property
    def values(self) -> "FloatArray":
        """Numbers (n, m), a row per line."""
        import numpy as np

        return np.array(self.numbers).reshape(len(self.number), -1)

    @property
    def line(self) -> "IntArray":
        """Line numbers (n,) in the file, from 1."""
        import numpy as np

        return np.array(self.number, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines of data in a text file, with the header and comments above them."""

    number: Sequence[int]
    """line number of each in the file, from 1"""
    text: Sequence[str]
    separator: str | None
    """a comma, a semicolon, or None for blanks and tabs"""
    title: str | None
    """first line, if none of its fields is a number"""
    comments: tuple[str, ...]
    """comments above the first line of data, without comment characters"""
    title_line: int = 1

    def require_some(self, what: str = "numbers") -> None:
        """Raises InputError where there is no line of data; `what` the file should have."""
        if not self.text and self.title is not None:
            raise InputError(f"line {self.title_line}: {_short(self.title)} has no number, and no {what} follow")
        if not self.text:
            raise InputError(f"the file has no {what} in it; check that it is the right one")

    @property
    def width(self) -> int:
        """Number of fields on the first line of data."""
        return len(self.words(0))

    def words(self, i: int) -> list[str]:
        """Fields of line i of the data."""
        return split(self.text[i], self.separator)

    def column(self, k: int) -> list[str]:
        """Field k of each line, without blanks or quotes; all lines must have as many fields as the first."""
        return [line.split(self.separator, k + 1)[k].strip(' \t"') for line in self.text]


def read_lines(file: Path) -> Lines:
    """Lines of a text file (UTF-8 or UTF-16, also packed by gzip), without blank lines and comments.

    Raises InputError naming the line for what is no text or has decimal commas; OSError as `open` does.
    """
    every = _text(file).split("\n")
    comments: list[str] = []
    title, title_line = None, 1
    for first, line in enumerate(every):
        content, comment = _without_comment(line)
        if comment.strip():
            comments.append(comment.strip("# \t,;"))
        if content and title is None and _has_no_number(content):
            title, title_line = content, first + 1
        elif content:
            break
    else:
        first = len(every)
    numbers, texts = _lines_of_data(every, first)
    separator = _separator(texts[0], numbers[0]) if texts else None
    if separator is not None:
        texts = _without_last_separator(texts, separator)
    return Lines(numbers, texts, separator, title, tuple(comments), title_line)


def _without_comment(line: str) -> tuple[str, str]:
    """Data of a line, and its comment."""
    bare, _, comment = line.partition("#")
    content = bare.strip()
    return ("", content) if content.startswith("%") else (content, comment)


def _lines_of_data(every: Sequence[str], first: int) -> tuple[Sequence[int], list[str]]:
    """Line numbers, from 1, and texts of all lines from `first` on, without blank lines and comments."""
    texts = [line.strip() for line in every[first:]]
    while texts and not texts[-1]:
        texts.pop()
    if all(texts) and not any("#" in text or "%" in text for text in texts):
        return range(first + 1, first + 1 + len(texts)), texts
    data = [(number, _without_comment(text)[0]) for number, text in enumerate(texts, start=first + 1)]
    return [number for number, text in data if text], [text for _, text in data if text]


def split(text: str, separator: str | None) -> list[str]:
    """Fields of a line, without blanks or quotes around them."""
    return [word.strip(' \t"') for word in text.split(separator)]


def _without_last_separator(texts: list[str], separator: str) -> list[str]:
    """Lines without a separator at the end; one before an empty last field stays."""
    widths = [_count(text, separator) for text in texts if not text.endswith(separator)]
    width = max(widths, default=0)
    return [
        text.removesuffix(separator).rstrip() if not width or _count(text, separator) == width + 1 else text
        for text in texts
    ]


def numbers_of(lines: Lines, columns: Sequence[int] | None = None, *, nan: bool = False) -> NumberTable:
    """Numbers of all columns, or of some of them.

    Raises InputError naming a line that has not as many fields as the first, or a field that is no finite number. `nan`
    allows NaN, also as an empty field or one of MISSING.
    """
    lines.require_some()
    width = lines.width
    wanted = list(range(width)) if columns is None else list(columns)
    try:
        numbers = _floats(lines, width, wanted)
    except ValueError:
        if not nan:
            raise _culprit(lines, wanted, nan=nan) from None
        try:
            numbers = _floats(lines, width, wanted, _nan_if_missing)
        except ValueError:
            raise _culprit(lines, wanted, nan=nan) from None
    odd = any("_" in text or not text.isascii() for text in lines.text)  # Python's float reads more than others do
    if odd or not all(map(isfinite, numbers)):
        _require_numbers(lines, wanted, nan=nan)
    return NumberTable(numbers, lines.number)


def _floats(
    lines: Lines, width: int, wanted: Sequence[int], replaced: Callable[[str], str] | None = None
) -> "array[float]":
    """The numbers in the `wanted` columns. Raises InputError for a line of another width, and ValueError."""
    numbers = array("d")
    quoted, in_order = any('"' in text for text in lines.text), list(wanted) == list(range(width))
    chosen = itemgetter(*wanted) if len(wanted) > 1 else lambda row: (row[wanted[0]],)
    for k in range(0, len(lines.text), AT_ONCE):
        rows = [text.split(lines.separator) for text in lines.text[k : k + AT_ONCE]]
        for i, row in enumerate(rows, start=k):
            if len(row) != width:
                raise InputError(
                    f"line {lines.number[i]}: expected {width} numbers, got {len(row)}: {_short(lines.text[i])}"
                )
        words: Iterable[str] = chain.from_iterable(rows if in_order else map(chosen, rows))
        if quoted or replaced is not None:
            words = (word.strip(' \t"') for word in words)
        numbers.extend(map(float, words if replaced is None else map(replaced, words)))
    return numbers


def require_width(lines: Lines, counts: dict[int, str]) -> None:
    """Raises InputError where the first line has none of these counts of numbers; they come with what they mean."""
    lines.require_some()
    if lines.width not in counts:
        expected = " or ".join(f"{n} ({name})" for n, name in counts.items())
        raise InputError(
            f"line {lines.number[0]}: expected {expected} numbers, got {lines.width}: {_short(lines.text[0])}"
        )


def is_number(word: str) -> bool:
    """Whether a field is a number as every language writes it; NaN and infinity are numbers too."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word and word.isascii()


def _text(file: Path) -> str:
    content = file.read_bytes()
    if content.startswith(GZIP):
        content = _unpacked(file)
    require_table(content)
    encoding = _encoding(content)
    try:
        return content.decode(encoding).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"line {line}: it is not text (byte {content[error.start]:#04x}); give a text file") from error


def _unpacked(file: Path) -> bytes:
    import gzip
    import zlib

    try:
        with gzip.open(file) as packed:
            content = packed.read(MOST_BYTES + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"it is packed by gzip and damaged ({error}); pack it again") from error
    if len(content) > MOST_BYTES:
        raise InputError(f"it unpacks to more than {MOST_BYTES >> 20} MiB, which is not a trajectory; check the file")
    return content


def _encoding(content: bytes) -> str:
    """UTF-16 by its mark, or by the zero bytes that it has in every second place; else UTF-8."""
    if content.startswith(UTF_16):
        return "utf-16"
    head = content[:200]
    for first, name in ((1, "utf-16-le"), (0, "utf-16-be")):
        if len(head) > 8 and head[first::2].count(0) > 0.9 * len(head[first::2]) and head[1 - first :: 2].count(0) == 0:
            return name
    return "utf-8-sig"


def _separator(text: str, number: int) -> str | None:
    """Separator of the numbers of a line. Raises InputError for decimal commas."""
    if ";" in text:
        words, found = text.split(";"), ";"
    elif "\t" in text:
        words, found = text.split("\t"), None
    else:
        words, found = text.split(), None
    decimal = [word for word in words if DECIMAL_COMMA.fullmatch(word.strip())]
    if len(words) > 1 and 2 * len(decimal) >= len(words):
        raise InputError(
            f"line {number}: {decimal[0].strip()!r} is written with a decimal comma; write decimals with points"
        )
    return "," if found is None and "," in text else found


def _has_no_number(text: str) -> bool:
    words = re.split(r"[,;\s]+", text)
    return len(words) > 1 and not any(is_number(word) for word in words)


def _nan_if_missing(word: str) -> str:
    return "nan" if word.lower() in MISSING else WINDOWS_NAN.sub("nan", word)


def _count(text: str, separator: str | None) -> int:
    return len(text.split()) if separator is None else text.count(separator) + 1


def _require_numbers(lines: Lines, columns: Sequence[int], *, nan: bool) -> None:
    """Raises InputError for the first line whose `columns` are not all numbers."""
    for i, number in enumerate(lines.number):
        words = lines.words(i)
        for k in columns:
            word = _nan_if_missing(words[k]) if nan else words[k]
            if is_number(word) and (isfinite(float(word)) or (nan and isnan(float(word)))):
                continue
            if DATE.fullmatch(word):
                raise InputError(f"line {number}: {_short(word)} is a date; write time stamps in seconds since 1970")
            raise InputError(f"line {number}: {_short(word)} is not a finite number; remove the line or mend it")


def _culprit(lines: Lines, columns: Sequence[int], *, nan: bool) -> InputError:
    """The error of `_require_numbers`, or of a file of which each field is a number and the whole is no table."""
    try:
        _require_numbers(lines, columns, nan=nan)
    except InputError as error:
        return error
    return InputError(f"the file is not a table of {lines.width} numbers a line; check that it is the right one")


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")
