"""The statistics of errors, however many there are."""

import numpy as np
import pandas as pd

from fgbaseline import compare

AT_MOST = 100_000_000
"""errors that a bootstrap draws"""
REPETITIONS = 1000


def spread(errors: "pd.Series[float]", seed: int) -> pd.DataFrame:
    """`compare.error_statistics` with fewer repetitions for very long paths: a tenth of them gives an interval too."""
    repetitions = int(np.clip(AT_MOST // max(len(errors), 1), 100, REPETITIONS))
    return compare.error_statistics(errors, repetitions=repetitions, seed=seed)
