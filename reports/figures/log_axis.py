"""Logarithmic axes that are labelled with numbers: 0.01, 3, 200, and powers only where these would be long."""

from matplotlib.axis import Axis
from matplotlib.ticker import LogFormatter, LogFormatterSciNotation

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
