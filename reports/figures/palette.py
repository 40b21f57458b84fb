"""One color for an estimator, in every figure and on the page: Okabe and Ito's, distinct to the color-blind."""

from collections.abc import Iterable, Mapping
from itertools import chain, cycle

REFERENCE = "#000000"
TRUTH = "#7f7f7f"
LANDMARK = "#5fb98c"

OWN: Mapping[str, str] = {
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

SPARE = ("#44AA99", "#999933", "#661100", "#6699CC", "#AA4499", "#332288")
"""for estimators of other packages, once the colors are used up that this run leaves"""


def colors(names: Iterable[str], reference: str | None) -> dict[str, str]:
    """Color of each of the names.

    The reference is black, a known name has its own color, and the others take, in their order, those colors that
    none of the names has.
    """
    every = list(names)
    taken = {name: OWN[name] for name in every if name in OWN}
    free = [color for color in OWN.values() if color not in taken.values()]
    rest = chain(free, SPARE, cycle(SPARE))
    chosen: dict[str, str] = {}
    for name in every:
        if name == reference:
            chosen[name] = REFERENCE
        else:
            chosen[name] = taken[name] if name in taken else next(rest)
    return chosen


ON_DARK: Mapping[str, str] = {
    REFERENCE: "#FFFFFF",
    TRUTH: "#A8A8A8",
    "#0072B2": "#2E96D3",
    "#882255": "#C2457F",
    "#661100": "#B5533C",
    "#332288": "#8273D9",
}
"""colors that dark ground would swallow: the same hue, lighter"""


def on_dark(color: str) -> str:
    """Color in place of `color` where the ground is dark."""
    return ON_DARK.get(color, color)
