"""What part of the data a figure shows: everything sensible, and never an empty plane because of one runaway."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray

TAIL = 2.0
"""per cent of the points on either side that do not decide how far a cloud reaches"""


@dataclass(frozen=True, eq=False, slots=True)
class Window:
    """An axis-parallel box: of a plane, or of one axis."""

    low: FloatArray
    high: FloatArray

    @property
    def side(self) -> float:
        """The longer side."""
        return float(np.max(self.high - self.low))

    def grown(self, by: float) -> "Window":
        """The window with a margin of `by` all around."""
        return Window(self.low - by, self.high + by)

    def holds(self, points: FloatArray) -> BoolArray:
        """(n,) which of the points (n, d) lie inside."""
        return np.asarray(((points >= self.low) & (points <= self.high)).all(axis=1), dtype=np.bool_)


def robust_window(points: FloatArray) -> Window | None:
    """The box of points (n, d), but no farther than half its size beyond the bulk of them; None without a point."""
    finite = points[np.isfinite(points).all(axis=1)]
    if len(finite) == 0:
        return None
    bulk = Window(*np.percentile(finite, [TAIL, 100.0 - TAIL], axis=0))
    return _box_of(finite, bulk.grown(0.5 * bulk.side + 1e-9))


def common_window(paths: Iterable[FloatArray], core: FloatArray | None, least: float = 1.0) -> Window:
    """The box around paths (n, d), of which none may reach farther than its side beyond the box of the core.

    The core is the path to be believed; without one, that of median size. Reaching `least` beyond it is always allowed.
    """
    every = list(paths)
    windows = sorted((w for w in map(robust_window, every) if w is not None), key=lambda w: w.side)
    believed = None if core is None else robust_window(core)
    if believed is None:
        believed = windows[(len(windows) - 1) // 2] if windows else Window(-np.ones(1), np.ones(1))
    allowed = believed.grown(max(believed.side, least))
    points = [path[np.isfinite(path).all(axis=1)] for path in [*every, *([] if core is None else [core])]]
    return _box_of(np.concatenate(points), allowed) if any(map(len, points)) else believed


def span(series: Iterable[FloatArray], least: float) -> float:
    """How far from zero an axis should reach for several series (n,) of signed values.

    To the largest value, unless one series reaches more than 30 times as far as any other and farther than `least`.
    """
    finite = [values[np.isfinite(values)] for values in series]
    reach = sorted((float(np.percentile(np.abs(v), 100.0 - TAIL)) for v in finite if len(v)), reverse=True)
    if not reach:
        return 1.0
    largest = max(float(np.abs(v).max()) for v in finite if len(v))
    second = reach[1] if len(reach) > 1 else 0.0
    trusted = 3.0 * reach[0] if reach[0] <= 30.0 * second else 3.0 * second
    return max(min(largest, max(trusted, least)), 1e-12)


def _box_of(points: FloatArray, allowed: Window) -> Window:
    inside = points[allowed.holds(points)]
    return Window(inside.min(axis=0), inside.max(axis=0)) if len(inside) else allowed
