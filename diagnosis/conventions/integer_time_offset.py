"""Integer delay of the velocities by the cost of fitted windows, where turns are too few for a cross-correlation.

Linear velocities count too. Only integer shifts compete: between them two samples are averaged, and the lower noise
would be taken for a better fit.
"""

from collections.abc import Callable

import numpy as np

from fgbaseline.geometry import FloatArray

from .velocity_time_offset import VelocityTimeOffset

SHIFTS = (-2.0, -1.0, 0.0, 1.0)
"""intervals"""
ENOUGH = 25.0
"""log-likelihood lead over all other shifts; high, since time-correlated pixel errors exaggerate it"""
STANDARD_ERROR_FACTOR = 3.0
"""factor on the standard error, for the same reason"""
HELD = 0.5
"""actual decrease of the cost over that predicted by the parabola, above which the parabola is accepted"""
ROUNDING = 1.0 / np.sqrt(12.0)
"""intervals, the standard error of an integer"""


def integer_time_offset(cost: Callable[[float], float], dt: float) -> VelocityTimeOffset | None:
    """The delay by a parabola through half the cost (negative log-likelihood) at the best shift and its neighbors.

    None where no shift leads, or where the best one is at the edge of the range. Where motion changes too much from
    frame to frame, the cost is no parabola and does not fall between the shifts: the best integer remains.
    """
    tried = np.array(SHIFTS)
    costs = np.array([cost(shift) for shift in SHIFTS])
    best = int(np.argmin(costs))
    if best in (0, len(SHIFTS) - 1) or np.delete(costs, best).min() - costs[best] < ENOUGH:
        return None
    before, at, after = costs[best - 1 : best + 2]
    curvature = before - 2.0 * at + after
    shift = tried[best] + 0.5 * (before - after) / curvature
    deviation = STANDARD_ERROR_FACTOR / float(np.sqrt(curvature))
    if at - cost(float(shift)) < HELD * 0.5 * curvature * (shift - tried[best]) ** 2:
        shift, deviation = tried[best], max(deviation, float(ROUNDING))
    return VelocityTimeOffset(float(shift) * dt, deviation * dt, True, tried, _relative(costs))


def _relative(costs: FloatArray) -> FloatArray:
    """Relative likelihood (m,) of each shift, 1 at the best, for time-correlated errors."""
    return np.asarray(np.exp(-(costs - costs.min()) / ENOUGH), dtype=np.float64)
