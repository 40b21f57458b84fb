"""Factors from medians to sigmas are those of the distributions they are named by."""

import pytest
from scipy.stats import chi2

from fgbaseline.diagnosis.robust_constants import CHI_SQUARE_MEDIAN, MAD_TO_SIGMA


def test_medians_are_those_of_chi_square():
    for degrees, median in CHI_SQUARE_MEDIAN.items():
        assert median == pytest.approx(chi2.median(degrees), rel=1e-4)
    assert pytest.approx(chi2.median(1) ** -0.5, rel=1e-4) == MAD_TO_SIGMA
