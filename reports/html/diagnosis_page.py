"""Page of a diagnosis."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from ..results.diagnosis import Found
from ..tables.run_details import findings_table
from .page import Grid, Page, Section, Sentences, pictures
from .rendering import render_page

CAPTIONS: Mapping[str, str] = {
    "angular_rates": "About each axis of imu_T_cam, moving averages. The repaired rates follow visual odometry.",
    "conventions": "Each candidate is a convention of axes and signs; the most likely one is chosen.",
    "time_offset": "Agreement of the recorded rates with the cameras at each time offset; the estimate has the best.",
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
            settings={"Recording": {"name": sequence.name, "source": sequence.source, "form": sequence.form}},
        )
    )
