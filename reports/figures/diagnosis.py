"""Figures of a diagnosis: visual odometry beside the recorded velocities, and the likelihood of each convention."""

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.data.axis_conventions import IDENTITY, twist_in_imu_axes
from fgbaseline.data.velocity_increments import Shift, zero_order_hold
from fgbaseline.data.wording import per_cent, plural
from fgbaseline.diagnosis import Diagnosis, TrackStatistics
from fgbaseline.diagnosis.repairs.significance import significant_bias
from fgbaseline.geometry import FloatArray

from .drawing import DrawOne, drawn
from .layout import title_and_legend
from .panels import swatch
from .style import GRAY, SCREEN, stacked_panels

SEEN, RECORDED, REPAIRED = "#111111", "#D55E00", "#0072B2"
"""the cameras, the recording and what the repair makes of it"""
WRONG, COPIED, OTHERS = "#c0392b", "#E69F00", "#b8c4d0"
AVERAGED_OVER = 1.0
"""s over which rates are averaged, so that the noise of one frame does not hide the rest"""
BINS = np.linspace(-5.0, 5.0, 61)


def draw_diagnosis(diagnosis: Diagnosis, tracks: TrackStatistics) -> dict[str, Figure]:
    """Figures of a diagnosis by name; those for which it has nothing to show are missing."""
    figures: dict[str, DrawOne] = {}
    if diagnosis.odometry is not None and diagnosis.fit is not None:
        of_motion = angular_rates, conventions, time_offset, velocity_residuals
        figures = {one.__name__: partial(one, diagnosis) for one in of_motion}
    return drawn(figures | {"tracks": partial(tracks_over_time, diagnosis, tracks)})


def angular_rates(diagnosis: Diagnosis) -> Figure:
    """Angular rates that the cameras see, as recorded and as repaired, about each axis of imu_T_cam."""
    assert diagnosis.odometry is not None
    sequence, known, bias = diagnosis.sequence, diagnosis.odometry.known, significant_bias(diagnosis)
    recorded = zero_order_hold(sequence, Shift.AFTER)[:, 3:]
    repaired = zero_order_hold(sequence, diagnosis.shift)
    repaired[:, 3:] -= bias
    repaired = twist_in_imu_axes(repaired, IDENTITY, diagnosis.angular.name)[:, 3:]
    seen = np.where(known[:, None], diagnosis.odometry.twist(sequence.dt)[:, 3:], np.nan)
    t = sequence.t[:-1] - sequence.t[0]
    width = AVERAGED_OVER / float(np.median(sequence.dt))
    figure, axes = stacked_panels(6.4, 3)
    shown = {"visual odometry": (seen, SEEN, 2.2), "as recorded": (recorded, RECORDED, 1.1)}
    changed = diagnosis.angular.changed or bool(bias.any()) or diagnosis.shift != 0.0
    if changed:
        shown["repaired"] = (repaired, REPAIRED, 1.1)
    handles: list[Any] = []
    for i, axis in enumerate(axes):
        for label, (rates, color, thick) in shown.items():
            handles += axis.plot(t, moving_mean(rates[:, i], width), color=color, linewidth=thick, label=label)
        axis.set_ylabel(f"w_{'xyz'[i]}, rad/s")
        before, after = (float(np.median(np.abs(seen[known, i] - r[known, i]))) for r in (recorded, repaired))
        text = f"median difference of single intervals {before:.3f} rad/s"
        text += f", repaired {after:.3f}" if changed else ""
        axis.set_title(text, loc="right", fontsize=8, color=GRAY, pad=2.0)
    axes[-1].set(xlabel="time, s", xlim=(0.0, float(t[-1])))
    title = f"Angular velocity about the IMU axes, averaged over {AVERAGED_OVER:g} s"
    title_and_legend(figure, title, handles)
    return figure


def conventions(diagnosis: Diagnosis) -> Figure:
    """Log-likelihood by which each of the 24 conventions falls behind the best, for both velocities."""
    figure = Figure(figsize=(SCREEN.width, 5.0))
    panels = figure.subplots(1, 2)
    for panel, which, axes in zip(panels, ("angular", "linear"), (diagnosis.angular, diagnosis.linear), strict=True):
        ranked = sorted(axes.scores, key=lambda name: -axes.scores[name])
        best = axes.scores[ranked[0]]
        behind = [best - axes.scores[name] for name in ranked]
        colors = [REPAIRED if n == axes.name else RECORDED if n == IDENTITY else OTHERS for n in ranked]
        rows = np.arange(len(ranked))
        panel.barh(rows, behind, color=colors, height=0.75)
        first = np.flatnonzero(np.array(behind) == 0.0)
        panel.plot(np.zeros(len(first)), first, ".", color="#333333")
        panel.set_yticks(rows, ranked, fontsize=7.5)
        for label, name in zip(panel.get_yticklabels(), ranked, strict=True):
            if name in (axes.name, IDENTITY):
                label.set_color(REPAIRED if name == axes.name else RECORDED)
                label.set_fontweight("bold")
        panel.invert_yaxis()
        panel.grid(axis="y", visible=False)
        unseen = [n for n, s in zip("xyz", axes.determined, strict=True) if not s]
        kept = ": as recorded" if axes.name == IDENTITY else ""
        remark = f" ({', '.join(unseen)} not identifiable{kept})" if unseen else ""
        panel.set(title=f"{which} velocity{remark}", xlabel="behind the best, log-likelihood")
    changed = diagnosis.angular.changed or diagnosis.linear.changed
    handles = [swatch(REPAIRED, "used" if changed else "used: as recorded")]
    handles += [swatch(RECORDED, "as recorded, not used")] if changed else []
    handles.append(swatch(OTHERS, "others"))
    title_and_legend(figure, "Likelihood of the 24 axis conventions, by visual odometry", handles)
    return figure


def time_offset(diagnosis: Diagnosis) -> Figure | None:
    """Agreement of the recorded rates with the cameras at each shift in time; None where none was tried."""
    timing = diagnosis.timing
    if len(timing.shifts) == 0:
        return None
    dt = float(np.median(diagnosis.sequence.dt))
    figure, (axes,) = stacked_panels(3.6)
    axes.plot(timing.shifts, timing.agreement, color=REPAIRED, linewidth=1.8)
    best = timing.shift / dt
    handles: list[Any] = []
    if timing.identifiable:
        spread = timing.deviation / dt
        handles.append(axes.axvspan(best - 2 * spread, best + 2 * spread, color="#cfe3f2", label="two standard errors"))
        handles.append(axes.axvline(best, color=REPAIRED, linewidth=1.0, label=f"found: {best:+.2f} intervals"))
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.22 * (high - low))
    usual = ((Shift.AFTER, "interval after"), (Shift.MIDDLE, "instant of the frame"), (Shift.BEFORE, "interval before"))
    look: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "va": "top", "fontsize": 8, "color": GRAY}
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
    for row, (shift, text) in enumerate(usual):
        axes.axvline(shift, color="#888888", linewidth=0.9, linestyle=":")
        axes.text(shift, 0.99 - 0.06 * row, f" {text}", **look, bbox=box)
    axes.set_yticks([tick for tick in axes.get_yticks() if low <= tick <= 1.0])
    axes.set(xlabel=f"shift of the velocities, intervals of {dt:.3f} s", ylabel="agreement (1: equal rates)")
    title = "Agreement of the recorded rates with visual odometry"
    title_and_legend(figure, title if timing.identifiable else f"{title}: no shift is identifiable", handles)
    return figure


def velocity_residuals(diagnosis: Diagnosis) -> Figure:
    """Residuals of the velocities in the windows' fits, over the noise that was found, beside a normal distribution."""
    assert diagnosis.fit is not None
    fit = diagnosis.fit
    figure = Figure(figsize=(SCREEN.width, 4.6))
    panels = figure.subplots(2, 3, sharex=True, sharey=True).ravel()
    bell = np.exp(-0.5 * BINS**2) / np.sqrt(2.0 * np.pi)
    handles: list[Any] = []
    for i, panel in enumerate(panels):
        values = fit.motion[np.isfinite(fit.motion[:, i]), i]
        panel.hist(np.clip(values, BINS[0], BINS[-1]), BINS, density=len(values) > 0, color=OTHERS)
        handles = panel.plot(BINS, bell, color=SEEN, linewidth=1.2, label="normal distribution")
        beyond = float(np.mean(np.abs(values) > 3.0)) if len(values) else 0.0
        panel.set_title(f"{'vw'[i // 3]}_{'xyz'[i % 3]}: {per_cent(beyond)} beyond 3 sigma")
    for panel in panels[3:]:
        panel.set_xlabel("residual, sigmas")
    for panel in panels[::3]:
        panel.set_ylabel("density")
    sigma = fit.sigmas
    noise = f"{sigma.linear_velocity:.3f} m/s, {sigma.angular_velocity:.4f} rad/s"
    title = f"Residuals of the velocities over the noise found: {noise}"
    title_and_legend(figure, title, [swatch(OTHERS, plural(len(fit.motion), "interval")), *handles])
    return figure


def tracks_over_time(diagnosis: Diagnosis, tracks: TrackStatistics) -> Figure:
    """Features of each frame, and the share of its matches that contradict the motion."""
    sequence = diagnosis.sequence
    t = sequence.t - sequence.t[0]
    figure, (upper, lower) = stacked_panels(5.0, 2)
    handles: list[Any] = list(upper.plot(t, tracks.usable, color=GRAY, linewidth=1.0, label="usable features"))
    upper.set(ylabel="features per frame", ylim=(0, None))
    lower.bar(t[:-1], 100.0 * np.nan_to_num(tracks.wrong_share), sequence.dt, align="edge", color=WRONG)
    handles.append(swatch(WRONG, "matches that contradict the motion of their frame"))
    copied = np.flatnonzero(diagnosis.repeated) + 1
    if len(copied):
        _mark(upper, t[copied], COPIED, 0.0)
        handles.append(swatch(COPIED, plural(len(copied), "copied frame")))
    few = np.flatnonzero(tracks.few)
    if len(few):
        _mark(upper, t[few], WRONG, 0.94)
    lower.set(ylabel="wrong matches, %", ylim=(0, None), xlabel="time, s", xlim=(0.0, float(t[-1])))
    title = "Tracks: usable features and wrong matches" + (", copied frames" if len(copied) else "")
    title_and_legend(figure, title, handles)
    return figure


def moving_mean(values: FloatArray, width: float) -> FloatArray:
    """Moving means (n,) over the known ones of the `width` entries around each; NaN where none is known.

    The window is rounded to whole entries, at least one; an even one reaches one entry further back than ahead.
    """
    import pandas as pd

    window = max(1, round(min(width, 2.0 * len(values))))
    rolling = pd.Series(values).rolling(window, center=True, min_periods=1)
    return np.asarray(rolling.mean().to_numpy(dtype=np.float64))


def _mark(axes: Axes, t: FloatArray, color: str, height: float) -> None:
    """Ticks along the lower or upper edge of a panel."""
    axes.vlines(t, height, height + 0.06, transform=axes.get_xaxis_transform(), color=color, linewidth=1.0, zorder=3)
