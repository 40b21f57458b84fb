"""Page of a diagnosis."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from ..results.diagnosis import Found
from ..tables.run_details import findings_table
from .page import Grid, Page, Section, Sentences, pictures
from .rendering import render_page

CAPTIONS: Mapping[str, str] = {
    "angular_rates": "About the IMU axes that imu_T_cam assumes, as moving averages. With the repairs the rates "
    "should follow visual odometry; where only visual odometry jumps, tracks are wrong.",
    "conventions": "Bars: by how much a convention of axes and signs is less likely than the best one. Differences in "
    "axes that are not identifiable do not count: of conventions that differ in these alone, the recorded one is kept.",
    "time_offset": "Agreement of the recorded rates with visual odometry, 1 for equal rates, at each time offset. "
    "The estimate is at its maximum; dotted lines mark the usual conventions.",
    "velocity_residuals": "Residuals of the velocities over the estimated noise, beside a normal distribution.",
    "tracks": "Features of each frame, and the share of its matches that contradict the motion.",
}


def render(found: Found, figures: Mapping[str, Figure]) -> str:
    """`report.html` of a diagnosis."""
    sequence, table = found.sequence, findings_table(found.findings)
    unknown = [Sentences(found.not_identifiable, "unknown")] if found.not_identifiable else []
    return render_page(
        Page(
            kind="diagnosis",
            title=sequence.name,
            about=f"{found.counts}.",
            verdict=[*found.verdict, *found.sentences],
            table=Section("table", "Faults", [Grid(table, "plain findings")] if table.rows else []),
            sections=[
                Section("unknown", "Not identifiable in this recording", unknown, "Not identifiable"),
                Section("figures", "Figures", list(pictures(figures, CAPTIONS).values())),
            ],
            settings={"Recording": {"name": sequence.name, "source": sequence.source, "format": sequence.form}},
        )
    )
