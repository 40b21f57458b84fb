"""CSV files of columns, as pandas writes them, without its import: it takes longer than most of these files."""

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

EXACT = "%r"
"""all digits"""


def write_csv(path: Path, columns: Mapping[str, Sequence[Any] | NDArray[Any]], form: str = EXACT) -> None:
    """Writes a row of names and one per value, as `DataFrame.to_csv` without an index; NaN is an empty cell.

    Numbers that are no integers are written in the form, such as `%.9g`.
    """
    lists = [column.tolist() if isinstance(column, np.ndarray) else column for column in columns.values()]
    cells = [[_cell(value, form) for value in values] for values in lists]
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(columns)
        rows.writerows(zip(*cells, strict=True))


def _cell(value: object, form: str) -> object:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else form % value
