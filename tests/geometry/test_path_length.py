"""Length of a path of which positions are missing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.geometry.path_length import distance_traveled, path_length


def test_a_gap_counts_as_the_straight_line_across_it_from_its_end_on() -> None:
    positions = np.array([[np.nan] * 3, [0.0, 0, 0], [np.nan, 0, 0], [2.0, 0, 0], [2.0, 3.0, 4.0], [np.nan] * 3])
    assert distance_traveled(positions).tolist() == [0.0, 0.0, 0.0, 2.0, 7.0, 7.0]
    assert path_length(positions) == 7.0


@pytest.mark.parametrize("n", [0, 1, 3])
def test_without_two_known_positions_the_length_is_zero(n: int) -> None:
    assert path_length(np.full((n, 3), np.nan)) == 0.0
    assert distance_traveled(np.full((n, 3), np.nan)).tolist() == [0.0] * n


@given(st.sets(st.integers(1, 18), max_size=15))
def test_positions_missing_on_a_straight_path_do_not_change_its_length(missing: set[int]) -> None:
    positions = np.outer(np.linspace(0.0, 10.0, 20), [0.6, 0.0, 0.8])
    positions[sorted(missing)] = np.nan
    assert path_length(positions) == pytest.approx(10.0)
