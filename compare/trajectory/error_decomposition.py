"""What the difference between two paths is made of: scale, heading and the rest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray

from .alignment import Align
from .association import Matched

SCALE, WHOLE = 1, 3
"""how many columns of the basis each step fits"""


@dataclass(frozen=True, slots=True)
class DifferenceShares:
    """Shares of the sum of squared position differences; they add to one. NaN where there is no difference at all."""

    scale: float
    """what a wrong scale of the path explains"""
    heading: float
    """what a wrong heading explains beyond that: constant, and growing with time as a gyroscope's bias has it"""
    noise: float
    """the rest: all that is neither, tilt and random walk among it"""
    scale_percent: float
    """100 times the coefficient s of the fit, %: not by how much the path is longer"""
    heading_deg: float
    """the fitted constant error of heading, deg, to the left positive"""
    heading_deg_per_s: float
    """the fitted drift of heading (per pose without stamps)"""
    rms: float
    """m, of the difference itself"""


def difference_shares(matched: Matched, up: ArrayLike = (0.0, 0.0, 1.0)) -> DifferenceShares:
    """Nested least-squares fits of the difference d_k = p_k - r_k (m) of matched positions, scale first:

    d_k = s (r_k - r_a), then d_k = s (r_k - r_a) + h up x (r_k - r_a) + g (up x integral of (t - t_a) dr). A share is
    the drop of the residual sum of squares that its step brings, over the sum of squares of d. The anchor r_a is the
    first pose where the paths start together (`none`, `first-pose`) and the centroid for fits over the whole path,
    which have taken out what fits into them. First order in the angles: above some 20 degrees of heading error part of
    it counts as scale and noise.
    """
    d, columns = difference_basis(matched, up)
    total = float(np.sum(d**2))
    basis = columns.reshape(-1, WHOLE)
    (_, after_scale), (fitted, after_heading) = (_fit(basis[:, :m], d.ravel()) for m in (SCALE, WHOLE))
    if total == 0.0:
        shares = (np.nan, np.nan, np.nan)
    else:
        shares = (1.0 - after_scale / total, (after_scale - after_heading) / total, after_heading / total)
    return DifferenceShares(
        *shares,
        scale_percent=100.0 * float(fitted[0]),
        heading_deg=float(np.rad2deg(fitted[1])),
        heading_deg_per_s=float(np.rad2deg(fitted[2])),
        rms=float(np.sqrt(total / len(d))),
    )


def difference_basis(matched: Matched, up: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """The difference d (n, 3), m, and (n, 3, 3) what is fitted to it, a column each: scale, heading, its drift."""
    r = matched.reference.position
    d = matched.estimate.position - r
    t = matched.reference.t - matched.reference.t[0]
    upward = np.asarray(up, dtype=np.float64) / np.linalg.norm(up)
    steps = 0.5 * (t[1:] + t[:-1])[:, None] * np.cross(upward, np.diff(r, axis=0))
    drifting = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    columns = [r - r[0], np.cross(upward, r - r[0]), drifting]
    if matched.alignment.kind not in (Align.NONE, Align.FIRST_POSE):
        columns = [column - column.mean(axis=0) for column in columns]
    return d, np.stack(columns, axis=2)


def _fit(basis: FloatArray, wanted: FloatArray) -> tuple[FloatArray, float]:
    """Coefficients and residual sum of squares; the smallest coefficients where a standing path leaves them open."""
    size = np.linalg.norm(basis, axis=0)
    size = np.where(size > 0, size, 1.0)
    coefficients = np.linalg.lstsq(basis / size, wanted, rcond=1e-12)[0] / size
    return coefficients, float(np.sum((wanted - basis @ coefficients) ** 2))
