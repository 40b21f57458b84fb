"""To which interval does a velocity belong, where turns are too few to tell? By how well windows can be fitted.

All that the velocities say takes part, linear ones too. Only whole shifts compete: between them, two samples are
averaged, and less noise would pass for better agreement.
"""

from collections.abc import Callable

import numpy as np

from fgbaseline.geometry import FloatArray

from .time_delay import TimeDelay

SHIFTS = (-2.0, -1.0, 0.0, 1.0)
"""intervals"""
ENOUGH = 25.0
"""log-likelihood by which one shift must lead all others; errors of the cameras last, so that it counts too much"""
INFLATION = 3.0
"""of the standard error, for the same reason"""


def integer_delay(cost: Callable[[float], float], dt: float) -> TimeDelay | None:
    """The shift by a parabola through the half cost (log-likelihood) at the best of a few and next to it; None where
    the recording does not tell, or where the best is the outermost of those tried."""
    tried = np.array(SHIFTS)
    costs = np.array([cost(shift) for shift in SHIFTS])
    best = int(np.argmin(costs))
    if best in (0, len(SHIFTS) - 1) or np.delete(costs, best).min() - costs[best] < ENOUGH:
        return None
    before, at, after = costs[best - 1 : best + 2]
    curvature = before - 2.0 * at + after
    shift = tried[best] + 0.5 * (before - after) / curvature
    return TimeDelay(float(shift) * dt, INFLATION / float(np.sqrt(curvature)) * dt, True, tried, _relative(costs))


def _relative(costs: FloatArray) -> FloatArray:
    """(m,) 1 at the best shift, less where the fit is worse: how likely it is beside it, for errors as lasting."""
    return np.asarray(np.exp(-(costs - costs.min()) / ENOUGH), dtype=np.float64)
