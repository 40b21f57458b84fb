"""Windows: the part of a scene that a figure shows, robust against a diverged estimate."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray

TAIL = 2.0
"""per cent of the points on either side that do not decide how far a cloud reaches"""


@dataclass(frozen=True, eq=False, slots=True)
class Window:
    """Axis-parallel box: of a plane, or of one axis."""

    low: FloatArray
    high: FloatArray

    @property
    def side(self) -> float:
        """Longer side."""
        return float(np.max(self.high - self.low))

    def grown(self, by: float) -> "Window":
        """Window with a margin of `by` all around."""
        return Window(self.low - by, self.high + by)

    def with_points(self, points: FloatArray, around: float) -> "Window":
        """Window grown to the bulk of those points (n, d) that lie within `around` of it."""
        near = robust_window(points[self.grown(around).holds(points)])
        return self if near is None else Window(np.minimum(self.low, near.low), np.maximum(self.high, near.high))

    def shaped(self, slimmest: tuple[float, float], least: float, share: float = 0.04) -> "Window":
        """Window (of a plane) with a margin, at least `least`, and a height over width within `slimmest`."""
        box = self.grown(max(share * self.side, least))
        width, height = box.high - box.low
        missing = np.array([height / slimmest[1] - width, width * slimmest[0] - height]).clip(min=0.0)
        return Window(box.low - 0.5 * missing, box.high + 0.5 * missing)

    def holds(self, points: FloatArray) -> BoolArray:
        """Mask (n,) of the points (n, d) inside."""
        return np.asarray(((points >= self.low) & (points <= self.high)).all(axis=1), dtype=np.bool_)


def known(points: FloatArray) -> FloatArray:
    """Finite ones (m, d) of the points (n, d)."""
    return np.asarray(points[np.isfinite(points).all(axis=1)])


def robust_window(points: FloatArray) -> Window | None:
    """Box of points (n, d), at most half its size beyond the bulk of them; None without a point."""
    finite = known(points)
    if len(finite) == 0:
        return None
    bulk = Window(*np.percentile(finite, [TAIL, 100.0 - TAIL], axis=0))
    return _box_of(finite, bulk.grown(0.5 * bulk.side + 1e-9))


def common_window(paths: Iterable[FloatArray], core: FloatArray | None, least: float = 1.0) -> Window:
    """Box around paths (n, d), of which none may reach farther than its side beyond the box of the core.

    The core is the path to be believed; without one, that of median size. Reaching `least` beyond it is always allowed.
    """
    every = list(paths)
    windows = sorted((w for w in map(robust_window, every) if w is not None), key=lambda w: w.side)
    believed = None if core is None else robust_window(core)
    if believed is None:
        believed = windows[(len(windows) - 1) // 2] if windows else Window(-np.ones(1), np.ones(1))
    allowed = believed.grown(max(believed.side, least))
    points = [known(path) for path in [*every, *([] if core is None else [core])]]
    return _box_of(np.concatenate(points), allowed) if any(map(len, points)) else believed


def signed_range(series: Iterable[FloatArray], least: float) -> float:
    """Reach of an axis on either side of zero for several series (n,) of signed values.

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
