"""Logarithmic axes that are labelled with numbers: 0.01, 3, 200, and powers only where these would be long."""

from collections.abc import Iterable

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT, MarkerStyle
from matplotlib.ticker import LogFormatter, LogFormatterSciNotation, NullLocator

from fgbaseline.geometry import FloatArray

LONG = (1e-4, 1e5)
"""an axis that reaches beyond these is labelled with powers of ten"""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Numbers(LogFormatter):
    """Which ticks are labelled is matplotlib's choice; how, needs none of its mathematics, slow to be set."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of the tick at x; empty where it has none."""
        return self._number(x) if super().__call__(x, pos) else ""

    def _number(self, x: float) -> str:
        low, high = sorted(self.axis.get_view_interval())  # type: ignore[union-attr]
        if LONG[0] <= low and high <= LONG[1]:
            return f"{x:g}"
        mantissa, _, exponent = f"{x:e}".partition("e")
        power = f"10{str(int(exponent)).translate(RAISED)}"
        return power if float(mantissa) == 1.0 else f"{float(mantissa):g}×{power}"


def label_with_numbers(axis: Axis) -> None:
    """Labels a logarithmic axis, once its limits are final, unless it was given labels of its own."""
    if not isinstance(axis.get_major_formatter(), LogFormatterSciNotation):
        return
    axis.set_major_formatter(Numbers())
    if isinstance(axis.get_minor_formatter(), LogFormatterSciNotation):
        axis.set_minor_formatter(Numbers(labelOnlyBase=False))
    if not any(axis.get_minor_formatter().format_ticks(list(axis.get_minorticklocs()))):
        axis.set_tick_params(which="minor", labelleft=False, labelbottom=False)


def draw_minor_ticks_at_once(panels: Iterable[Axes]) -> None:
    """Makes one line of the minor ticks of each logarithmic axis, once its limits are final, unless some have labels.

    As ticks each is five artists, which are measured and drawn in every form whether they show or not.
    """
    bare = [(axes, axis, _unlabelled(axis)) for axes in panels for axis in (axes.xaxis, axes.yaxis)]
    for axes, axis, at in bare:  # panels that share an axis share its locator too: all are asked before
        if len(at) == 0:
            continue
        axis.set_minor_locator(NullLocator())
        zero, rc = np.zeros(len(at)), mpl.rcParams
        if axis.axis_name == "x":
            ticks = Line2D(at, zero, transform=axes.get_xaxis_transform(), marker=MarkerStyle(TICKDOWN))
            size, width, colour = rc["xtick.minor.size"], rc["xtick.minor.width"], rc["xtick.color"]
        else:
            ticks = Line2D(zero, at, transform=axes.get_yaxis_transform(), marker=MarkerStyle(TICKLEFT))
            size, width, colour = rc["ytick.minor.size"], rc["ytick.minor.width"], rc["ytick.color"]
        ticks.set(markersize=size, markeredgewidth=width, color=colour, linestyle="none", clip_on=False)
        ticks.set_in_layout(False)
        axes.add_artist(ticks)


def _unlabelled(axis: Axis) -> FloatArray:
    """(n,) where the minor ticks of a logarithmic axis are; none where one of them has a label."""
    if axis.get_scale() != "log":
        return np.empty(0)
    low, high = sorted(axis.get_view_interval())
    at = np.asarray(axis.get_minorticklocs(), dtype=np.float64)
    at = at[(at >= low) & (at <= high)]
    return np.empty(0) if any(axis.get_minor_formatter().format_ticks(at.tolist())) else at
