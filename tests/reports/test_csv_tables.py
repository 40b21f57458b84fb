"""CSV files: byte for byte those of pandas."""

from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fgbaseline.reports.tables.writers import EXACT, write_csv

NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), min_size=1, max_size=6)
CELLS = st.tuples(st.text('ab," é', min_size=1), st.floats(), st.integers(-(2**60), 2**60), st.booleans())


@pytest.mark.parametrize("form", [EXACT, "%.9g"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(names=st.lists(NAMES, min_size=4, max_size=4, unique=True), rows=st.lists(CELLS, min_size=1, max_size=5))
def test_columns_are_written_as_pandas_writes_them(
    tmp_path: Path, form: str, names: list[str], rows: list[tuple[str, float, int, bool]]
) -> None:
    texts, numbers, counts, flags = map(list, zip(*rows, strict=True))
    columns = dict(zip(names, (texts, np.array(numbers), np.array(counts), flags), strict=True))
    write_csv(tmp_path / "columns.csv", columns, form)
    expected = StringIO()
    pd.DataFrame(columns).to_csv(expected, index=False, float_format=None if form == EXACT else form)
    assert (tmp_path / "columns.csv").read_bytes().decode("utf-8") == expected.getvalue()
