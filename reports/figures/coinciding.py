"""Lines of a panel that coincide: drawn on each other like the stripes of a ribbon, so that all of them show."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fgbaseline.geometry import FloatArray

SAMPLES = 200
"""points of a line that are compared"""
SAME = 1.5
"""px of a PNG: lines nearer than this everywhere coincide"""
STRIPE = 1.4
"""points by which a line is wider than the one on it"""
BELOW_REFERENCE = 1.9
"""zorder of what coincides with the reference"""


def widen_coinciding(axes: Axes, reference_order: float) -> None:
    """Makes lines wider than those that they coincide with and that lie on them.

    The reference, the line of this zorder, lies on the lines that coincide with it, and below all others.
    """
    lines = [line for line in axes.get_lines() if len(_x(line)) > 2 and not str(line.get_label()).startswith("_")]
    places = {line: axes.transData.transform(np.column_stack([_x(line), _y(line)])) for line in lines}
    for reference in [line for line in lines if line.get_zorder() == reference_order]:
        for line in lines:
            if line is not reference and _coincide(places[line], places[reference]):
                line.set_zorder(BELOW_REFERENCE)
    drawn = sorted(lines, key=Line2D.get_zorder)
    for i in reversed(range(len(drawn))):
        above = [on.get_linewidth() for on in drawn[i + 1 :] if _coincide(places[drawn[i]], places[on])]
        drawn[i].set_linewidth(max([drawn[i].get_linewidth(), *(STRIPE + width for width in above)]))


def _coincide(a: FloatArray, b: FloatArray) -> bool:
    """Whether points (n, 2) of two lines, px, are the same; a line without a finite point coincides with none."""
    if len(a) != len(b):
        return False
    step = max(1, len(a) // SAMPLES)
    apart = np.abs(a[::step] - b[::step]).max(axis=1)
    known = np.isfinite(a[::step]).all(axis=1), np.isfinite(b[::step]).all(axis=1)
    both = known[0] & known[1]
    return bool(both.any() and (known[0] == known[1]).all() and apart[both].max() <= SAME)


def _x(line: Line2D) -> FloatArray:
    return np.asarray(line.get_xdata(), dtype=np.float64)


def _y(line: Line2D) -> FloatArray:
    return np.asarray(line.get_ydata(), dtype=np.float64)
