"""Overconfidence: covariances that the errors to ground truth, or the differences from the reference, contradict."""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.geometry import FloatArray

from .statistics.descriptive import summarized, without_nan

if TYPE_CHECKING:
    from .estimate_comparison import Result, Run

DEGREES_OF_FREEDOM = 6
"""degrees of freedom of a pose"""


@dataclass(frozen=True, slots=True)
class Overconfidence:
    """An overconfident estimate: its position sigma beside its position error, and what shows it; NaN without a value.

    The error is taken to ground truth where the NEES rests on it, and for the reference, otherwise from the reference.
    """

    name: str
    sigma: float
    """RMS position sigma by its own covariances, m"""
    rmse: float
    """RMSE of the positions, unaligned, m"""
    from_truth: bool
    """whether `rmse` is to ground truth"""
    nees: float
    """median NEES to ground truth"""
    reference_nees: float
    """median reference NEES; NaN also where P - P_ref is positive definite in few frames"""
    sigma_ratio: float
    """median ratio of the position sigma to the reference's"""


@cache
def overconfidence_bound() -> float:
    """Upper bound of the NEES of a single pose, 95 %: a larger mean or median is that of an overconfident estimate."""
    from .statistics.chi_square import chi_square_bounds  # scipy: not for trajectories without covariances

    return float(chi_square_bounds(DEGREES_OF_FREEDOM)[1])


def overconfident_estimates(run: "Run") -> list[Overconfidence]:
    """The overconfident estimates: the reference, then by falling ratio of error to sigma.

    The median NEES to ground truth exceeds the bound of a single pose. Against the reference this counts only beside a
    sigma below the divergence; P smaller than P_ref in most frames counts in the same way.
    """
    found = [each for result in run.answered if (each := _overconfidence(run, result)) is not None]
    return sorted(found, key=lambda each: (each.name != run.reference, -each.rmse / each.sigma))


def large_reference_nees(run: "Run") -> dict[str, float]:
    """Median reference NEES above the bound of a single pose, of estimates that are not overconfident.

    Their position sigma is not below the divergence. Those whose P - P_ref is not positive definite in most frames are
    left out.
    """
    medians = {}
    for result in run.answered:
        difference = None if result.name in run.unranked else result.evidence.difference
        if difference is not None and 2 * difference.left_out.sum() <= run.problem.n_frames:
            median = _median(difference.nees)
            if median > overconfidence_bound() and _overconfidence(run, result) is None:
                medians[result.name] = median
    return medians


def _overconfidence(run: "Run", result: "Result") -> Overconfidence | None:
    difference, ratio = result.evidence.difference, result.evidence.sigma_ratio
    nees = float("nan") if result.nees is None else _median(result.nees)
    is_smaller = difference is not None and difference.is_overconfident
    reference_nees = float("nan") if difference is None or is_smaller else _median(difference.nees)
    is_inconsistent = nees > overconfidence_bound()
    from_truth = is_inconsistent or result.name == run.reference
    table = result.truth if from_truth else result.divergence
    found = Overconfidence(
        name=result.name,
        sigma=result.evidence.sigma.position_rmse,
        rmse=float("nan") if table is None else summarized(table["position"])["rmse"],
        from_truth=from_truth,
        nees=nees,
        reference_nees=reference_nees,
        sigma_ratio=float("nan") if ratio is None else float(ratio["position"].median()),
    )
    is_contradicted = is_smaller or reference_nees > overconfidence_bound()
    is_ranked = result.name not in run.unranked
    return found if is_inconsistent or (is_ranked and is_contradicted and 0.0 < found.sigma < found.rmse) else None


def _median(values: FloatArray) -> float:
    known = without_nan(values)
    return float(np.median(known)) if len(known) else float("nan")
