"""NIS per degree of freedom is one where innovations are drawn from what the filter expects, and NaN where none are."""

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import compare
from fgbaseline.data import Estimate, Innovations
from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray


def recorded(nis: FloatArray, degrees: IntArray) -> Estimate:
    """An estimate with these innovations."""
    poses = np.tile(np.eye(4), (len(nis), 1, 1))
    return Estimate("filter", poses, np.zeros(0, dtype=np.bool_), innovations=Innovations(nis, degrees))


def test_the_nis_of_each_frame_is_tested_with_its_own_degrees_of_freedom() -> None:
    estimate = recorded(np.array([2.0, 6.0, 0.0, np.nan, 5.0]), np.array([1, 3, 6, 3, 0]))
    np.testing.assert_array_equal(compare.nis_per_degree(estimate), [2.0, 2.0, 0.0, np.nan, np.nan])


def test_the_summary_is_that_of_chi_square() -> None:
    random = np.random.default_rng(3)
    degrees = 3 * random.integers(1, 30, 5000)
    nis = random.chisquare(degrees)
    summary = compare.nis_summary(recorded(nis, degrees))
    total = int(degrees.sum())
    assert summary.frames == 5000
    assert summary.per_degree == pytest.approx(nis.sum() / total, rel=1e-12)
    assert (summary.low, summary.high) == pytest.approx(chi2.ppf([0.025, 0.975], total) / total, rel=1e-9)
    assert summary.low < summary.per_degree < summary.high
    assert summary.inside_95 == pytest.approx(0.95, abs=0.01)


def test_frames_without_innovations_are_excluded() -> None:
    nis, degrees = np.array([4.0, np.nan, 7.0, 1.0]), np.array([3, 3, 6, 0])
    some, known = (
        compare.nis_summary(recorded(nis, degrees)),
        compare.nis_summary(recorded(nis[[0, 2]], degrees[[0, 2]])),
    )
    assert some == known
    assert known.frames == 2
    assert known.per_degree == 11.0 / 9.0


@pytest.mark.parametrize("innovations", [None, Innovations.none(4)])
def test_a_filter_without_recorded_innovations_has_no_nis(innovations: Innovations | None) -> None:
    estimate = Estimate("filter", np.tile(np.eye(4), (4, 1, 1)), np.zeros(0, dtype=np.bool_), innovations=innovations)
    summary = compare.nis_summary(estimate)
    assert np.isnan(compare.nis_per_degree(estimate)).all()
    assert len(compare.nis_per_degree(estimate)) == 4
    assert np.isnan([summary.per_degree, summary.low, summary.high, summary.inside_95]).all()
    assert summary.frames == 0
