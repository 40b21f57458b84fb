"""One colour for an estimator, in every figure and on the page: Okabe and Ito's, told apart by the colour-blind."""

from collections.abc import Iterable, Mapping
from itertools import chain, cycle

from fgbaseline.reports.comparison import Run

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
"""for estimators of other packages, once the colours are used up that this run leaves"""


def colours(run: Run) -> dict[str, str]:
    """The colour of every estimator of a run, by name."""
    return colours_of(run.results, run.reference)


def colours_of(names: Iterable[str], reference: str | None) -> dict[str, str]:
    """The colour of each of the names.

    The reference is black, a known name has its own colour, and the others take, in their order, those colours that
    none of the names has.
    """
    every = list(names)
    taken = {name: OWN[name] for name in every if name in OWN}
    free = [colour for colour in OWN.values() if colour not in taken.values()]
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
"""the colours that dark ground would swallow: the same hue, lighter"""


def on_dark(colour: str) -> str:
    """The colour that stands for `colour` where the ground is dark."""
    return ON_DARK.get(colour, colour)
