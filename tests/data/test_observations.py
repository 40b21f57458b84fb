import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.data import Observations
from fgbaseline.geometry import FgbaselineError

FRAMES = 6
seen = st.sets(st.tuples(st.integers(0, FRAMES - 1), st.integers(0, 4)))


def observed(pairs: set[tuple[int, int]]) -> Observations:
    frame, landmark = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2).T
    return Observations.sort(frame, landmark, np.zeros((len(frame), 4)))


@given(seen)
def test_ties_are_the_landmarks_seen_on_both_sides(pairs: set[tuple[int, int]]) -> None:
    before = [{j for frame, j in pairs if frame <= k} for k in range(FRAMES - 1)]
    behind = [{j for frame, j in pairs if frame > k} for k in range(FRAMES - 1)]
    expected = [len(a & b) for a, b in zip(before, behind, strict=True)]
    assert observed(pairs).ties(FRAMES).tolist() == expected


@given(seen, st.integers(0, FRAMES - 1), st.integers(0, FRAMES - 1))
def test_the_observations_of_frames_are_those_whose_frame_lies_between(
    pairs: set[tuple[int, int]], first: int, last: int
) -> None:
    o = observed(pairs).of_frames(first, last)
    assert list(zip(o.frame.tolist(), o.landmark.tolist(), strict=True)) == sorted(
        pair for pair in pairs if first <= pair[0] <= last
    )


def test_unsorted_observations_are_refused() -> None:
    with pytest.raises(FgbaselineError, match="sorted by frame"):
        Observations(np.array([1, 0]), np.array([0, 0]), np.zeros((2, 4)))


def test_they_are_read_only_where_they_are_unpickled_too() -> None:
    sent: Observations = pickle.loads(pickle.dumps(observed({(0, 3), (2, 1)})))
    assert np.array_equal(sent.landmark, [3, 1])
    assert not any(array.flags.writeable for array in (sent.frame, sent.landmark, sent.pixel))
