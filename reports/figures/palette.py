"""Colors and dashes of estimators, one in every figure and on the page, and what they become on a dark ground.

The colors are Okabe and Ito's; lines that color-blind readers could confuse have different dashes.
"""

from collections.abc import Iterable, Mapping
from functools import cache
from itertools import chain, cycle

import numpy as np
from matplotlib.colors import to_hex, to_rgb

REFERENCE = "#000000"
TRUTH = "#7f7f7f"
LANDMARK = "#5fb98c"

ESTIMATOR_COLORS: Mapping[str, str] = {
    "dead-reckoning": "#0072B2",
    "ekf": "#D55E00",
    "joint-ekf": "#E69F00",
    "isam2": "#882255",
    "isam2-online": "#CC79A7",
    "fixed-lag": "#56B4E9",
    "batch": "#009E73",
    "landmark-mapping": "#B3A100",
}
"""by the name an estimator is registered under; the reference of a run is black instead, whatever its name"""

EXTRA_COLORS = ("#44AA99", "#999933", "#661100", "#6699CC", "#AA4499", "#332288")
"""for estimators of other packages, once the colors are used up that this run leaves"""
DASHED, DASH_DOT, DASH_DOT_DOT = (6.0, 3.0), (8.0, 2.5, 1.5, 2.5), (8.0, 2.0, 1.5, 2.0, 1.5, 2.0)
"""lengths of dashes and gaps, px on the page"""
DASHES: Mapping[str, tuple[float, ...]] = {
    TRUTH: DASHED,
    "#0072B2": DASHED,
    "#CC79A7": DASH_DOT,
    "#B3A100": DASHED,
    "#44AA99": DASH_DOT_DOT,
    "#999933": DASH_DOT,
    "#661100": DASHED,
    "#6699CC": DASHED,
    "#AA4499": DASH_DOT,
    "#332288": DASH_DOT_DOT,
}
"""dashes of the lines of a color, solid without: two colors that color-blind readers may confuse differ in these"""
DARK_GROUND, DARK_INK, DARK_CHROMA = "#1d2126", "#edf0f2", 1.15
"""ground and black ink of a figure on a dark page, and by how much colors are stronger there"""
GREEN, BAND, GRAY = "#6b9a72", "#d7e8d9", "#555555"
"""expected values, the band around them, and marks of no estimator"""


def colors(names: Iterable[str], reference: str | None) -> dict[str, str]:
    """Color of each of the names.

    The reference is black, a known name has its own color, and the others take, in their order, those colors that
    none of the names has.
    """
    every = list(names)
    taken = {name: ESTIMATOR_COLORS[name] for name in every if name in ESTIMATOR_COLORS}
    free = [color for color in ESTIMATOR_COLORS.values() if color not in taken.values()]
    rest = chain(free, EXTRA_COLORS, cycle(EXTRA_COLORS))
    chosen: dict[str, str] = {}
    for name in every:
        if name == reference:
            chosen[name] = REFERENCE
        else:
            chosen[name] = taken[name] if name in taken else next(rest)
    return chosen


def on_dark(color: str) -> str:
    """Color in place of `color` where the ground is dark: as `dark_matrix` makes it of a still figure."""
    matrix = np.array(dark_matrix())
    rgb = np.clip(matrix[:, :3] @ to_rgb(color) + matrix[:, 3], 0.0, 1.0)
    return to_hex((float(rgb[0]), float(rgb[1]), float(rgb[2]))).upper()


@cache
def dark_matrix() -> tuple[tuple[float, ...], ...]:
    """Affine map (3, 4) of sRGB values in [0, 1]: white becomes the dark ground, black light ink, hues stay."""
    luma = np.tile([0.2126, 0.7152, 0.0722], (3, 1))
    ground, ink = np.array(to_rgb(DARK_GROUND)), np.array(to_rgb(DARK_INK))
    linear = DARK_CHROMA * (np.eye(3) - luma) + (ground - ink)[:, None] * luma
    return tuple(tuple(round(float(v), 4) for v in (*row, at)) for row, at in zip(linear, ink, strict=True))


def linestyle(color: str) -> str | tuple[float, tuple[float, ...]]:
    """Matplotlib's line style of a color."""
    return (0.0, tuple(0.6 * length for length in DASHES[color])) if color in DASHES else "solid"
