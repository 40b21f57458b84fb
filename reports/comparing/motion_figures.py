"""Errors of motions: between poses a delta apart, and over KITTI's segments."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..figures.lettering import plain
from ..figures.style import WIDTH, head
from ..trajectories.comparison import Comparison
from .lines import colours, line


def relative(comparison: Comparison) -> Figure | None:
    """Errors of the motion over each delta, as boxes."""
    deltas = [d for d in comparison.deltas if any(d in r.relative for r in comparison.results.values())]
    if not deltas:
        return None
    names = list(comparison.results)
    figure = Figure(figsize=(WIDTH, 0.9 + len(deltas) * (0.75 + 0.27 * len(names))))
    panels = figure.subplots(len(deltas), 2, squeeze=False, sharey=True)
    for row, delta in zip(panels, deltas, strict=True):
        for panel, column, unit in zip(row, ("translation", "rotation_deg"), ("m", "°"), strict=True):
            _boxes(comparison, panel, delta, column)
            panel.set_xlabel(f"over {delta}: {'translation' if unit == 'm' else 'rotation'}, {unit}")
            panel.set_xlim(left=0.0)
    pairs = "all pairs" if comparison.settings.all_pairs else "consecutive pairs"
    head(figure, f"Errors of the motion between {pairs} of poses")
    return figure


def _boxes(comparison: Comparison, panel: Axes, delta: str, column: str) -> None:
    colour = colours(comparison)
    for i, (name, result) in enumerate(comparison.results.items()):
        if delta in result.relative:
            panel.boxplot(
                [result.relative[delta][column].dropna().to_numpy()],
                positions=[i],
                orientation="horizontal",
                widths=0.55,
                whis=(5, 95),
                showfliers=False,
                patch_artist=True,
                boxprops={"facecolor": colour[name], "alpha": 0.45, "edgecolor": colour[name]},
                medianprops={"color": "#222222", "linewidth": 1.6},
                whiskerprops={"color": colour[name]},
                capprops={"color": colour[name]},
            )
    panel.set_yticks(range(len(comparison.results)), [plain(name) for name in comparison.results])
    panel.set_ylim(len(comparison.results) - 0.5, -0.5)
    panel.grid(axis="y", visible=False)


def segments(comparison: Comparison) -> Figure | None:
    """KITTI's segment errors by the length of the segments; None where none has two lengths."""
    known = {n: r.segments for n, r in comparison.results.items() if r.segments is not None}
    if not any(len(found.by_length) > 1 for found in known.values()):
        return None  # the table says as much
    figure = Figure(figsize=(WIDTH, 3.4))
    left, right = figure.subplots(1, 2)
    handles: list[Line2D] = []
    for name, found in known.items():
        table = found.by_length
        style = {**line(comparison, name), "marker": "o", "markersize": 4}
        handles += left.plot(table.index, table["translation_percent"], **style)
        right.plot(table.index, table["rotation_deg_per_m"], **style)
    for panel, title in ((left, "translation, %"), (right, "rotation, °/m")):
        panel.set_ylabel(title)
        panel.set_xlabel("length of the segments, m")
        panel.set_ylim(bottom=0.0)
    official = all(found.official for found in known.values())
    which = "KITTI's lengths" if official else "lengths fitted to the path, not KITTI's"
    head(figure, f"Segment errors ({which})", handles)
    return figure
