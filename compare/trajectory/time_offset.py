"""Time offset between the clocks of an estimate and a reference."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, InputError

from ..statistics.descriptive import rms_norm
from .alignment import Align, align
from .association import interpolated

STEPS = 400
MOST_POSES = 2000
AS_GOOD = 1.05
"""factor on the smallest RMSE up to which offsets are equally good"""


@dataclass(frozen=True, slots=True)
class TimeOffset:
    """Offset to add to an estimate's stamps to fit the reference best, and its uncertainty."""

    seconds: float
    rmse: float
    """m, of aligned positions, with the offset"""
    rmse_without: float
    """m, over the same poses, without the offset"""
    low: float
    """s; between low and high the RMSE is at most 5 % above the smallest"""
    high: float
    determined: bool
    """False where that range reaches an end of the search: widen it, or the path (straight, steady) is uninformative"""


def time_offset(
    reference: Trajectory, estimate: Trajectory, within: float, kind: Align | str = Align.SE3
) -> TimeOffset:
    """Offset within -`within` to `within` (s) of the smallest position RMSE after alignment of `kind`.

    The trajectory with the denser stamps is interpolated at those of the other (at most MOST_POSES of them, evenly
    chosen) that overlap at every offset of the search, so that all offsets use the same poses. Raises InputError
    for fewer than three such poses, missing stamps or an empty search.
    """
    from scipy.optimize import minimize_scalar

    for path in (reference, estimate):
        if not path.stamped:
            raise InputError(f"{path.source or path.name}: it has no time stamps, so no offset in time can be found")
        if len(path) < 2:
            raise InputError(f"{path.source or path.name}: it has one pose only, so no offset in time can be found")
    if not within > 0:
        raise InputError(f"the search for an offset in time needs a width above 0 s, got {within!r}")
    reference_is_coarse = np.median(np.diff(reference.t)) > np.median(np.diff(estimate.t))
    coarse, dense = (reference, estimate) if reference_is_coarse else (estimate, reference)
    both = np.flatnonzero((coarse.t - within >= dense.t[0]) & (coarse.t + within <= dense.t[-1]))
    if len(both) < 3:
        raise InputError(
            f"an offset within {within:g} s cannot be searched for: {len(both)} poses of {coarse.name} overlap with "
            f"{dense.name} at each of them, 3 are needed; give a width that is smaller than their overlap"
        )
    coarse = coarse.at(both[:: -(-len(both) // MOST_POSES)])

    def misfit(seconds: float) -> float:
        moved = interpolated(dense, coarse.t + (-seconds if reference_is_coarse else seconds))
        e, r = (moved, coarse) if reference_is_coarse else (coarse, moved)
        motion = align(e.world_T_body, r.world_T_body, kind)
        return rms_norm(motion.apply(e.world_T_body)[:, :3, 3] - r.position)

    step = max(float(np.median(np.diff(dense.t))), 2.0 * within / STEPS)
    n = int(np.ceil(within / step))
    grid = np.linspace(-within, within, 2 * n + 1)
    misfits = np.array([misfit(seconds) for seconds in grid])
    k = int(np.argmin(misfits))
    bounds = (float(grid[max(k - 1, 0)]), float(grid[min(k + 1, 2 * n)]))
    best = minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-7 * max(1.0, within)})
    seconds, lowest = (float(best.x), float(best.fun)) if best.fun < misfits[k] else (float(grid[k]), float(misfits[k]))
    rounding = 1e-9 * float(np.ptp(coarse.position, axis=0).max())
    limit = AS_GOOD * lowest + rounding
    good = np.append(grid[misfits <= limit], seconds)
    low, high = (_crossing(misfit, limit, float(end), grid, side) for end, side in ((good.min(), -1), (good.max(), 1)))
    edge = 0.5 * float(grid[1] - grid[0])
    determined = low > -within + edge and high < within - edge
    return TimeOffset(seconds, lowest, float(misfits[n]), low, high, determined)


def _crossing(misfit: Callable[[float], float], limit: float, good: float, grid: FloatArray, side: int) -> float:
    """Offset at which the misfit reaches the limit, between a good offset and its neighbor in the grid on that side.

    The good offset itself at the end of the grid.
    """
    from scipy.optimize import brentq

    beyond = grid[grid * side > good * side]
    if len(beyond) == 0:
        return good
    worse = float(beyond[np.argmin(np.abs(beyond - good))])
    if misfit(worse) <= limit or misfit(good) >= limit:
        return good
    return float(brentq(lambda seconds: misfit(seconds) - limit, good, worse, xtol=1e-6 * abs(worse - good)))
