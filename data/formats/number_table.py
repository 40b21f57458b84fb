"""Text files of numbers, the same count on each line: decoded, split into lines, each fault with its line."""

import gzip
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ..observations import IntArray
from .foreign_files import require_table

GZIP = b"\x1f\x8b"
MOST_BYTES = 2**30
"""of a file once unpacked"""
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(e[+-]?\d+)?", re.IGNORECASE)
WINDOWS_NAN = re.compile(r"nan\([a-z]*\)", re.IGNORECASE)
MISSING = ("", "none", "null", "na", "n/a")
"""words that pandas, Python, JSON and R write for NaN, in lower case"""
DATE = re.compile(r"\d{4}-\d{1,2}-\d{1,2}([T ].*)?")


@dataclass(frozen=True, slots=True)
class NumberTable:
    """n lines of m numbers, and where in the file each of them stands."""

    values: FloatArray
    """(n, m)"""
    line: IntArray
    """(n,) line numbers, from 1"""


@dataclass(frozen=True, slots=True)
class Lines:
    """The lines of a text file that hold data, without comments, and what stands above them."""

    number: list[int]
    """where in the file each stands, from 1"""
    text: list[str]
    separator: str | None
    """a comma, a semicolon, or None for blanks and tabs"""
    title: str | None
    """the first line, where no word of it is a number"""
    comments: tuple[str, ...]
    """the comments above the first line of data, without their marks"""
    title_line: int = 1

    def require_some(self) -> None:
        """Raises InputError where there is no line of data."""
        if not self.text and self.title is not None:
            raise InputError(f"line {self.title_line}: {_short(self.title)} has no number, and no poses follow")
        if not self.text:
            raise InputError("the file has no poses in it; check that it is the right one")

    @property
    def width(self) -> int:
        """Number of words on the first line of data."""
        return len(self.words(0))

    def words(self, i: int) -> list[str]:
        """The words of line i of the data."""
        return split(self.text[i], self.separator)

    def column(self, k: int) -> list[str]:
        """The k-th word of each line, without blanks or quotes; all lines must be as wide as the first."""
        return [line.split(self.separator)[k].strip(' \t"') for line in self.text]


def read_lines(file: Path) -> Lines:
    """The lines of a text file (UTF-8 or UTF-16, also packed by gzip), without blank lines and comments.

    Raises InputError naming the line for what is no text or has decimal commas; OSError as `open` does.
    """
    numbers: list[int] = []
    texts: list[str] = []
    comments: list[str] = []
    title, title_line = None, 1
    for number, line in enumerate(_text(file).split("\n"), start=1):
        bare, _, comment = line.partition("#")
        content = bare.strip()
        if content.startswith("%"):
            content, comment = "", content
        if not texts and comment.strip():
            comments.append(comment.strip("# \t,;"))
        content = content.rstrip(" \t")
        if not content:
            continue
        if not texts and title is None and _has_no_number(content):
            title, title_line = content, number
            continue
        numbers.append(number)
        texts.append(content)
    separator = _separator(texts[0], numbers[0]) if texts else None
    if separator is not None:
        texts = _without_last_separator(texts, separator)
    return Lines(numbers, texts, separator, title, tuple(comments), title_line)


def split(text: str, separator: str | None) -> list[str]:
    """The words of a line, without blanks or quotes around them."""
    return [word.strip(' \t"') for word in text.split(separator)]


def _without_last_separator(texts: list[str], separator: str) -> list[str]:
    """Lines without the separator behind their last word; where the last word is empty, its separator stays."""
    widths = [_count(text, separator) for text in texts if not text.endswith(separator)]
    width = max(widths, default=0)
    return [
        text.removesuffix(separator).rstrip() if not width or _count(text, separator) == width + 1 else text
        for text in texts
    ]


def numbers_of(lines: Lines, columns: Sequence[int] | None = None, *, nan: bool = False) -> NumberTable:
    """The numbers of all columns, or of some of them.

    Raises InputError naming the line where it is not as wide as the first, or a word is no finite number. `nan` allows
    NaN, also as an empty word or one of MISSING.
    """
    lines.require_some()
    width = lines.width
    for number, text in zip(lines.number, lines.text, strict=True):
        if (words := _count(text, lines.separator)) != width:
            raise InputError(f"line {number}: expected {width} numbers, got {words}: {_short(text)}")
    wanted = list(range(width)) if columns is None else list(columns)
    texts = [WINDOWS_NAN.sub("nan", text) for text in lines.text] if nan else lines.text
    try:
        values = _loaded(texts, lines.separator, wanted)
    except ValueError as error:
        if not nan:
            raise _culprit(lines, wanted, nan=nan) from error
        texts = [(lines.separator or " ").join(map(_nan_if_missing, split(t, lines.separator))) for t in texts]
        try:
            values = _loaded(texts, lines.separator, wanted)
        except ValueError:
            raise _culprit(lines, wanted, nan=nan) from error
    if len(values) != len(texts) or np.isinf(values).any() or (np.isnan(values).any() and not nan):
        raise _culprit(lines, wanted, nan=nan)
    return NumberTable(values, np.array(lines.number, dtype=np.int64))


def require_width(lines: Lines, counts: dict[int, str]) -> None:
    """Raises InputError where the first line has none of these counts of numbers; they come with what they mean."""
    lines.require_some()
    if lines.width not in counts:
        expected = " or ".join(f"{n} ({name})" for n, name in counts.items())
        raise InputError(
            f"line {lines.number[0]}: expected {expected} numbers, got {lines.width}: {_short(lines.text[0])}"
        )


def is_number(word: str) -> bool:
    """Whether a word is a number as every language writes it; NaN and infinity are numbers too."""
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
    try:
        with gzip.open(file) as packed:
            content = packed.read(MOST_BYTES + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"it is packed by gzip and damaged ({error}); pack it again") from error
    if len(content) > MOST_BYTES:
        raise InputError(f"it unpacks to more than {MOST_BYTES >> 20} MiB, which is no trajectory; check the file")
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
    """What stands between the numbers of a line. Raises InputError for decimal commas."""
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


def _loaded(texts: list[str], separator: str | None, columns: list[int]) -> FloatArray:
    return np.loadtxt(texts, np.float64, comments=None, ndmin=2, delimiter=separator, usecols=columns, quotechar='"')


def _nan_if_missing(word: str) -> str:
    return "nan" if word.lower() in MISSING else word


def _count(text: str, separator: str | None) -> int:
    return len(text.split()) if separator is None else text.count(separator) + 1


def _culprit(lines: Lines, columns: Sequence[int], *, nan: bool) -> InputError:
    """The error for the first line whose `columns` are not all numbers."""
    for i, number in enumerate(lines.number):
        words = lines.words(i)
        for k in columns:
            word = _nan_if_missing(words[k]) if nan else words[k]
            if is_number(word) and (np.isfinite(float(word)) or (nan and np.isnan(float(word)))):
                continue
            if DATE.fullmatch(word):
                return InputError(f"line {number}: {_short(word)} is a date; write time stamps in seconds since 1970")
            return InputError(f"line {number}: {_short(word)} is no finite number; remove the line or mend it")
    return InputError(f"the file is no table of {lines.width} numbers a line; check that it is the right one")


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")
