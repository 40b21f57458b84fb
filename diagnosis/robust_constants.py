"""Factors from a median to a sigma of Gaussian residuals; literals, so that a diagnosis need not import scipy."""

CHI_SQUARE_MEDIAN = {1: 0.4549, 2: 1.3863, 3: 2.366, 6: 5.3481}
"""degrees of freedom -> median of the chi-square distribution"""
MAD_TO_SIGMA = 1.4826
"""sigma over the median absolute deviation, 1 / sqrt(median of chi-square with one degree of freedom)"""
