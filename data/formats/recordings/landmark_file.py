"""Landmarks in a CSV: a header with `id`, `x`, `y`, `z` (further columns are left alone), then one landmark a line."""

import numpy as np

from fgbaseline.geometry import InputError

from ...estimators.estimate import Landmarks
from ..files.file_errors import FilePath, reading, regular_file
from ..files.number_table import numbers_of, read_lines, require_width, split

COLUMNS = ("id", "x", "y", "z")


def read_landmarks(path: FilePath) -> Landmarks:
    """The landmarks of a CSV as `fgbaseline run` writes them: id is the index in the sequence, x y z are m.

    They may stand in any order. Raises InputError naming file and line for a missing column, what is no number, an id
    that is no whole number from 0 on, and one that stands there twice.
    """
    with reading(path), np.errstate(all="ignore"):
        lines = read_lines(regular_file(path))
        titles = split(lines.title or "", ",")
        missing = [title for title in COLUMNS if title not in titles]
        if missing:
            raise InputError(
                f"line 1: expected a header with id,x,y,z, but {', '.join(missing)} is missing from "
                f"{(lines.title or '')[:60]!r}"
            )
        if not lines.text:
            return Landmarks.none()
        require_width(lines, {len(titles): f"{','.join(titles)}"})
        table = numbers_of(lines)
        columns = [titles.index(title) for title in COLUMNS]
        number, position = table.values[:, columns[0]], table.values[:, columns[1:]]
        wrong = np.flatnonzero((number < 0) | (number != np.floor(number)) | (number >= 2**53))
        if len(wrong):
            raise InputError(
                f"line {table.line[wrong[0]]}: the id {number[wrong[0]]:g} is not a whole number from 0 on"
            )
        order = np.argsort(number, kind="stable")
        index = number[order].astype(np.int64)
        again = np.flatnonzero(np.diff(index) == 0)
        if len(again):
            raise InputError(
                f"line {table.line[order[again[0] + 1]]}: the landmark {index[again[0]]} stands on line "
                f"{table.line[order[again[0]]]} too; keep one"
            )
        return Landmarks(index, np.ascontiguousarray(position[order]))
