"""SLAM beside dead reckoning, one panel for each cause that is put right."""

import numpy as np
from matplotlib.figure import Figure

from ..figures.lettering import plain
from ..figures.style import WIDTH, head
from ..figures.view import TopView
from ..figures.window import common_window
from ..formatting import meters
from .plots import ENDS, PATH
from .study import Study
from .trial import pose

COLUMNS = 2
MARGIN = 1.1
"""times the largest box: all panels have one scale"""
SLIMMEST = 0.3
"""height over width of a panel, at least"""
DEAD_RECKONING = "#444444"


def stages_figure(study: Study) -> Figure:
    """The filter of figure 9 from above, on the recording as it is and after each repair."""
    view = TopView.of(pose(study.subject.studied, study.recorded.settings))
    pairs = [tuple(view.plane(poses[:, :3, 3]) for poses in (s.path, s.predicted)) for s in study.staged]
    boxes = [common_window([path], predicted) for path, predicted in pairs]
    width, height = np.max([box.high - box.low for box in boxes], axis=0) * MARGIN
    height = max(height, SLIMMEST * width)
    columns = min(COLUMNS, len(study.staged))
    rows = -(-len(study.staged) // columns)
    panel = (WIDTH / columns - 0.6) * height / width
    figure = Figure(figsize=(WIDTH, (panel + 0.55) * rows + 0.9))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    handles = []
    for axes, staged, box, (path, predicted) in zip(panels, study.staged, boxes, pairs, strict=False):
        middle = 0.5 * (box.low + box.high)
        handles = axes.plot(*predicted.T, color=DEAD_RECKONING, linewidth=2.2, label="dead reckoning")
        handles += axes.plot(*path.T, color=PATH, linewidth=1.0, label="SLAM, part (c)")
        handles += axes.plot(*predicted[:1].T, "s", color=ENDS, markersize=5, zorder=5, label="start")
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlim(middle[0] - 0.5 * width, middle[0] + 0.5 * width)
        axes.set_ylim(middle[1] - 0.5 * height, middle[1] + 0.5 * height)
        axes.set_title(f"{staged.stage.name}: {meters(staged.outcome.apart_rmse)}", fontsize=9)
        axes.tick_params(labelsize=7)
    for axes in panels[len(study.staged) :]:
        axes.set_visible(False)
    head(figure, f"{plain(study.subject.label)}, N = {study.recorded.features}: cause by cause, from above, m", handles)
    return figure
