"""Whitened residuals, in sigmas of the noise model, and their chi-square test by track."""

import numpy as np
import pandas as pd

from fgbaseline.data import Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement_model import MONOCULAR_ROWS, STEREO_ROWS

from ..statistics.chi_square import p_value


def whitened_rows(problem: Problem, table: pd.DataFrame) -> FloatArray:
    """Residuals (n, r) of the rows of a reprojection table, in sigmas of the problem's noise."""
    return problem.measurement.whitened(table[["uL", "vL", "uR", "vR"]].to_numpy(dtype=np.float64))


def evaluated_rows(problem: Problem, table: pd.DataFrame) -> pd.DataFrame:
    """Rows of a reprojection table that the estimator used; those of the problem where it uses none by design."""
    used = table["used"].to_numpy(dtype=np.bool_)
    return table.loc[used if used.any() else problem.mask[table["observation"].to_numpy()]]


def track_chi_square(problem: Problem, table: pd.DataFrame) -> pd.DataFrame:
    """Chi-square test of the residuals of each landmark of a reprojection table, one row per `landmark`.

    Columns: `n` observations; `squared`, the sum of their squared whitened residuals; `degrees` of freedom, r n - 3 for
    r rows (r n where landmarks have a prior); and `probability`, the p-value, which is uniform for white Gaussian noise
    of the assumed sigma. The degrees of freedom of the poses are neglected, so residuals are slightly too small.
    """
    table = table[table["error"].notna()]
    squared = np.sum(whitened_rows(problem, table) ** 2, axis=1)
    groups = table.assign(squared=squared).groupby("landmark")["squared"]
    result = pd.DataFrame({"n": groups.size(), "squared": groups.sum()})
    result["degrees"] = problem.measurement.n_rows * result["n"] - (0 if problem.landmark_prior is not None else 3)
    result = result[result["degrees"] > 0].copy()
    result["probability"] = p_value(result["squared"].to_numpy(), result["degrees"].to_numpy(np.float64))
    return result


def whitened_summary(problem: Problem, table: pd.DataFrame) -> dict[str, float | int]:
    """Chi-square statistics over the tracks of `evaluated_rows`:

    `ratio` of squared residuals to degrees of freedom (expected 1), `beyond_95`, the share of tracks beyond the 95 %
    quantile (expected 0.05), the number of `tracks`, and the `spread_*` of each row in sigmas (expected
    sqrt(1 - 3 m / (r n)) for m landmarks and n observations; NaN for a row that one camera does not have).
    """
    rows = evaluated_rows(problem, table)
    rows = rows[rows["error"].notna()]
    tracks = track_chi_square(problem, rows)
    degrees = float(tracks["degrees"].sum())
    white = whitened_rows(problem, rows)
    names = MONOCULAR_ROWS if problem.measurement.monocular else STEREO_ROWS
    spread = {f"spread_{name}": float("nan") for name in STEREO_ROWS}
    if len(white):
        spread |= {f"spread_{name}": float(np.sqrt(np.mean(white[:, i] ** 2))) for i, name in enumerate(names)}
    return {
        "ratio": float(tracks["squared"].sum()) / degrees if degrees else float("nan"),
        "beyond_95": float((tracks["probability"] < 0.05).mean()) if degrees else float("nan"),
        **spread,
        "tracks": len(tracks),
    }
