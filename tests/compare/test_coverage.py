"""Share of a time span that intervals cover, against counting a fine grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.compare import interval_coverage

WHOLE = np.linspace(0.0, 100.0, 1001)
INTERVALS = st.lists(st.tuples(st.integers(0, 100), st.integers(0, 100)).map(sorted), min_size=1, max_size=8)


@given(INTERVALS)
def test_intervals_count_once_where_they_overlap(intervals: list[list[int]]) -> None:
    start, end = np.array(intervals, dtype=np.float64).T
    seconds = np.arange(100) + 0.5
    inside = ((start[:, None] < seconds) & (seconds < end[:, None])).any(axis=0)
    assert interval_coverage(start, end, WHOLE) == pytest.approx(inside.mean())


def test_time_in_a_gap_is_not_part_of_the_whole() -> None:
    gap = WHOLE[(WHOLE <= 40.0) | (WHOLE >= 60.0)]
    assert interval_coverage(np.array([0.0]), np.array([40.0]), gap) == pytest.approx(0.5)
    assert interval_coverage(np.array([0.0]), np.array([1.0]), np.array([0.0])) == 1.0
