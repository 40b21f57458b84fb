"""Residuals in units of the noise they should have, beside the chi-square they should follow."""

import numpy as np
import pandas as pd

from fgbaseline.data import Problem
from fgbaseline.geometry import FloatArray

from ..statistics.chi_square import probability_beyond

WHITE_ROWS = ("uL", "uR", "v")


def whitened_rows(problem: Problem, table: pd.DataFrame) -> FloatArray:
    """(n, 3) residuals of (uL, uR, (vL + vR) / 2) of a reprojection table over the problem's sigma of each."""
    return problem.measurement.whitened(table[["uL", "vL", "uR", "vR"]].to_numpy(dtype=np.float64))


def judged(problem: Problem, table: pd.DataFrame) -> pd.DataFrame:
    """The rows of a reprojection table that an estimator used; where it uses none by nature, those of the problem."""
    used = table["used"].to_numpy(dtype=np.bool_)
    return table.loc[used if used.any() else problem.mask[table["observation"].to_numpy()]]


def track_chi_square(problem: Problem, table: pd.DataFrame) -> pd.DataFrame:
    """One row per landmark of a reprojection table: `n` sights, `squared` the sum of their squared whitened rows,

    `degrees` of freedom, 3 n - 3 (3 n where landmarks have a prior), and `probability` that chi-square is larger.
    The landmark takes three away; what the poses take is neglected, which makes the residuals of a good estimate a
    little too small. Uniform probabilities say that the noise is white, Gaussian and of the size assumed.
    """
    table = table[table["error"].notna()]
    squared = np.sum(whitened_rows(problem, table) ** 2, axis=1)
    groups = table.assign(squared=squared).groupby("landmark")["squared"]
    result = pd.DataFrame({"n": groups.size(), "squared": groups.sum()})
    result["degrees"] = 3 * result["n"] - (0 if problem.landmark_prior is not None else 3)
    result = result[result["degrees"] > 0].copy()
    result["probability"] = probability_beyond(result["squared"].to_numpy(), result["degrees"].to_numpy(np.float64))
    return result


def whitened_summary(problem: Problem, table: pd.DataFrame) -> dict[str, float | int]:
    """Over the tracks of `judged` rows: `ratio` of the squared residuals to their degrees of freedom (1 is expected),

    `beyond_95`, the share of tracks beyond the 95 % quantile (0.05 is expected), `tracks`, and for each row its
    `spread_*` in sigmas, sqrt(1 - m / n) being expected of m landmarks and n observations.
    """
    rows = judged(problem, table)
    rows = rows[rows["error"].notna()]
    tracks = track_chi_square(problem, rows)
    degrees = float(tracks["degrees"].sum())
    white = whitened_rows(problem, rows)
    spread = {
        f"spread_{name}": float(np.sqrt(np.mean(white[:, i] ** 2))) if len(white) else float("nan")
        for i, name in enumerate(WHITE_ROWS)
    }
    return {
        "ratio": float(tracks["squared"].sum()) / degrees if degrees else float("nan"),
        "beyond_95": float((tracks["probability"] < 0.05).mean()) if degrees else float("nan"),
        **spread,
        "tracks": len(tracks),
    }
