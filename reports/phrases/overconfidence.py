"""Sentences on overconfident estimators: the position sigma that they claim beside their error."""

import numpy as np

from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.geometry import FloatArray

from ..formatting import listed, number
from .evidence import overconfidence_bound

IN_FULL = 3
"""estimators with their values; of the others only the names"""


def overconfidence_sentences(run: Run) -> list[str]:
    """One sentence on all overconfident estimators, the largest error over its claimed sigma first."""
    found = sorted(
        (r for r in run.answered if is_overconfident(run, r)), key=lambda r: -_actual(run, r)[0] / _claimed(r)
    )
    if not found:
        return []
    each = "; ".join(_claim(run, result) for result in found[:IN_FULL])
    others = [result.name for result in found[IN_FULL:]]
    more = f"; likewise {listed(others)}" if others else ""
    return [f"Overconfident: {each}{more}."]


def is_overconfident(run: Run, result: Result) -> bool:
    """Whether the claimed sigma is below the error to truth or the reference, and their covariances contradict it.

    The median NEES of either exceeds the bound of a single pose, or P is smaller than P_ref in most frames.
    """
    if not 0.0 < _claimed(result) < _actual(run, result)[0]:
        return False
    difference = None if result.name in run.unranked else result.evidence.difference
    beside = difference is not None and (
        difference.is_overconfident or _median(difference.nees) > overconfidence_bound()
    )
    return beside or (result.nees is not None and _median(result.nees) > overconfidence_bound())


def _claim(run: Run, result: Result) -> str:
    distance, other = _actual(run, result)
    ratio, difference = result.evidence.sigma_ratio, result.evidence.difference
    if difference is not None and difference.is_overconfident:
        difference = None  # its NEES is that of the few frames in which P - P_ref is positive definite
    figures = {
        "NEES": float("nan") if result.nees is None else _median(result.nees),
        "reference NEES": float("nan") if difference is None else _median(difference.nees),
        "sigma ratio": float("nan") if ratio is None else float(ratio["position"].median()),
    }
    known = ", ".join(f"{name} {number(value)}" for name, value in figures.items() if np.isfinite(value))
    measured = f"; {known}" if known else ""
    claimed = number(_claimed(result))
    return (
        f"{result.name} claims a position sigma of {claimed} m (RMS) but differs from {other} by {number(distance)} m "
        f"(RMSE{measured})"
    )


def _actual(run: Run, result: Result) -> tuple[float, str]:
    """RMSE of the positions, m, unaligned, and what it is measured from: ground truth where NEES rests on it."""
    by_truth = result.nees is not None and _median(result.nees) > overconfidence_bound()
    table = result.truth if by_truth or result.name == run.reference else result.divergence
    distance = float("nan") if table is None else float(np.sqrt(np.nanmean(table["position"].to_numpy() ** 2)))
    return distance, "ground truth" if table is result.truth else str(run.reference)


def _claimed(result: Result) -> float:
    return result.evidence.sigma.position_rmse


def _median(values: FloatArray) -> float:
    known = values[~np.isnan(values)]
    return float(np.median(known)) if len(known) else float("nan")
