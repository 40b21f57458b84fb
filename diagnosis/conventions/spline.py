"""Cubic spline interpolation of odometry between frames.

Equal to `scipy.interpolate.CubicSpline`, by a test, without the imports of that package.
"""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Spline:
    """A twice continuously differentiable piecewise cubic, whose outer two pieces at either end are one cubic each."""

    knots: FloatArray
    """(n,) rising"""
    coefficients: FloatArray
    """(4, n-1, ...) of the powers 0 to 3 of the distance from the knot where a piece begins"""

    def __call__(self, x: FloatArray, derivative: int = 0) -> FloatArray:
        """Values or derivatives (order 1 or 2), (..., c), at x (...); beyond the knots those of the outer pieces."""
        piece = np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.knots) - 2)
        c = self.coefficients
        h = (x - self.knots[piece]).reshape(*x.shape, *([1] * (c.ndim - 2)))
        if derivative == 0:
            return np.asarray(c[0][piece] + h * (c[1][piece] + h * (c[2][piece] + h * c[3][piece])))
        if derivative == 1:
            return np.asarray(c[1][piece] + h * (2.0 * c[2][piece] + h * 3.0 * c[3][piece]))
        return np.asarray(2.0 * c[2][piece] + h * 6.0 * c[3][piece])


def spline_through(x: FloatArray, y: FloatArray) -> Spline:
    """The spline through y (n, ...) at rising x (n,), at least four, by its slopes there (de Boor, chapter IV)."""
    from scipy.linalg import solve_banded

    values = y.reshape(len(x), -1)
    dx = np.diff(x)
    slope = np.diff(values, axis=0) / dx[:, None]
    band = np.zeros((3, len(x)))
    right = np.empty_like(values)
    band[0, 2:], band[1, 1:-1], band[2, :-2] = dx[:-1], 2.0 * (dx[:-1] + dx[1:]), dx[1:]
    right[1:-1] = 3.0 * (dx[1:, None] * slope[:-1] + dx[:-1, None] * slope[1:])
    band[1, 0], band[0, 1], right[0] = _at_the_end(dx[0], dx[1], slope[0], slope[1])
    band[1, -1], band[2, -2], right[-1] = _at_the_end(dx[-1], dx[-2], slope[-1], slope[-2])
    s = solve_banded((1, 1), band, right)
    bend = (s[:-1] + s[1:] - 2.0 * slope) / dx[:, None]
    coefficients = np.stack([values[:-1], s[:-1], (slope - s[:-1]) / dx[:, None] - bend, bend / dx[:, None]])
    return Spline(x, coefficients.reshape(4, len(x) - 1, *y.shape[1:]))


def _at_the_end(
    outer: float, inner: float, outer_slope: FloatArray, inner_slope: FloatArray
) -> tuple[float, float, FloatArray]:
    """Not-a-knot end condition: factors of the outer two slopes, and right-hand side."""
    both = outer + inner
    return inner, both, ((outer + 2.0 * both) * inner * outer_slope + outer**2 * inner_slope) / both
