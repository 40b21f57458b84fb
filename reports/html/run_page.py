"""Pages of a run and of a diagnosis."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data.tracking import Pictures
from fgbaseline.data.wording import capitalized

from ..figures.drawing import EncodedFigure
from ..figures.style import colors
from ..formatting import counted, number
from ..phrases.run import track_sentences, verdict
from ..results.diagnosis import Found
from ..tables import run as tables
from ..tables import run_details as details
from .page import (
    Block,
    Folded,
    Grid,
    Live,
    Note,
    Page,
    Picture,
    Section,
    Sentences,
    figure_blocks,
    folded,
    pictures,
    render_page,
    still_figures,
    trust,
)
from .plot_data import image_data, page_data
from .plot_encoding import embedded_json

CAPTIONS: Mapping[str, str] = {
    "paths_overlaid": "Seen from above; all have the same start. Squares mark the ends.",
    "paths_side_by_side": "All panels have the same limits. Green dots: landmarks. Thin line: ground truth "
    "(dashed) or, without it, the reference.",
    "divergence": "Position and rotation difference from the reference, without alignment, and the position "
    "difference ahead of the reference, to its left and above it.",
    "error_to_truth": "Difference from ground truth in the same components, without alignment: all have the start of "
    "the ground truth. With raw inertial data this is its position and heading; roll and pitch are estimated.",
    "height": "Along the up direction of the recording.",
    "reprojection_over_time": "Above, the median error over all observations of an estimator's landmarks, "
    "including those that the mask excludes. Below, the recorded observations of each frame, and which of them the "
    "mask excludes.",
    "reprojection_distribution": "Solid over all observations of an estimator's landmarks, including those that the "
    "mask excludes; dashed over those that it used. Curves farther left are better.",
    "nees": "The band holds 95 % of the frames of a consistent estimator. Above it an estimator is overconfident, "
    "below it conservative. The errors of one run are time-correlated, so the share within the band varies.",
    "held_out": "Each half of a track is predicted from its other half along each trajectory. Trajectories whose "
    "intervals overlap can still be separated: the table has the paired difference from the best.",
    "consistency": "The bands of NEES and NIS hold 95 % of the frames of a consistent filter. The NEES is "
    "time-correlated. Where the pixel noise is inflated, a NIS far below the band is expected. The sigma ratio of a "
    "consistent filter is at least 1 (dotted line).",
    "reprojection_classes": "Flat lines mean that the error does not depend on distance or track age. The "
    "dotted curve is expected if the noise is as assumed. Curves to its left have smaller residuals, as with inflated "
    "pixel noise; curves to its right larger ones. Errors include those of masked observations, which can dominate a "
    "class of few observations.",
    "image_regions": "Errors that grow towards an edge can indicate distortion or a wrong rectification; near points "
    "at the bottom of the image and wrong matches raise them as well. All panels share "
    "one logarithmic scale.",
    "map_difference": "Landmarks are matched by the index of their track. Distances in the world include the drift of "
    "the trajectories; those in the camera frames do not.",
    "time_per_frame": "Below the dotted line an estimator runs in real time.",
}
"""captions by the names of figures"""
DIAGNOSIS_CAPTIONS: Mapping[str, str] = {
    "angular_rates": "About the IMU axes that imu_T_cam assumes, as moving averages. With the repairs the rates "
    "should follow visual odometry; where only visual odometry jumps, tracks are wrong.",
    "conventions": "Bars: by how much a convention of axes and signs is less likely than the best one. Differences in "
    "axes that are not identifiable do not count: of conventions that differ in these alone, the recorded one is kept.",
    "time_offset": "Agreement of the recorded rates with visual odometry, 1 for equal rates, at each time offset. "
    "The estimate is at its maximum; dotted lines mark the usual conventions.",
    "velocity_residuals": "Residuals of the velocities over the estimated noise, beside a normal distribution.",
    "tracks": "Features of each frame, and the share of its matches that contradict the motion.",
}

PAGE_BYTES = 20_000_000
"""largest page with images; they are thinned to what its plots and figures leave"""
MARKUP_BYTES = 500_000
"""upper bound on tables, style and script"""
BAND_FIGURES = ("three_sigma_", "velocity_and_biases_")
EVIDENCE_FIGURES = ("held_out", *BAND_FIGURES, "reprojection_classes", "image_regions", "map_difference")
"""beginnings of the names of the figures that stand beside the evidence"""
CHART_FIGURES = ("reprojection_distribution",)
"""figures that stand beside the interactive charts, because they show what these do not; the others are folded away"""


def render(
    run: Run,
    summary: Mapping[str, Any],
    figures: Mapping[str, Figure | EncodedFigure],
    images: Pictures | None = None,
) -> str:
    """`report.html` of a run.

    `summary` is `summary.json` as a dict and gives the numbers, `figures` is what `figures.draw(run)` or
    `figures.drawn_in_background(run, n)` gives; `images` lie under the observations.
    """
    stills = pictures(figures, CAPTIONS)
    images = Pictures() if images is None else images
    plots = None
    if run.answered or run.problem.sequence.truth is not None:
        plots = page_data(run, images.size)
        if images.size is not None:
            rest = len(embedded_json(plots)) + sum(len(each.source) for each in stills.values()) + MARKUP_BYTES
            images.thin(max(0, PAGE_BYTES - rest) * 3 // 4)  # base64 has four letters for three bytes
        plots["images"] = image_data(run, images)
    sequence, problem = summary["sequence"], summary["problem"]
    table = Grid(tables.main_table(run, summary["estimators"]))
    added = [Note(f"{name}: {caption}.") for name, caption in run.added.items()]
    remarks = [*sequence["remarks"], *problem["remarks"]]
    recording = {"name": sequence["name"], "source": sequence["source"], "format": sequence["form"]}
    return render_page(
        Page(
            kind="report",
            title=run.problem.sequence.name,
            about=_about(run, sequence, problem),
            verdict=verdict(run),
            table=Section("table", "Metrics by estimator", [table, *added], "Metrics"),
            sections=_sections(run, summary, stills, plots, images),
            record=[Note("Remarks on the recording and the problem", is_heading=True), Sentences(remarks, "remarks")]
            if remarks
            else [],
            settings={"Recording": recording, "Settings": summary["settings"]},
            colors=colors(run.results, run.reference),
            plots=plots,
            still_paths=stills.get("paths_overlaid"),
        )
    )


def _about(run: Run, sequence: Mapping[str, Any], problem: Mapping[str, Any]) -> str:
    length = sequence["path_length_m"]
    source = "" if run.problem.sequence.truth is None else " by ground truth"  # not that of the reference
    spans = [f"{number(sequence['duration_s'])} s", *([] if length is None else [f"{number(length)} m{source}"])]
    kind = "observation" if run.problem.sequence.monocular else "stereo observation"
    return (
        f"{', '.join(run.results)} on {counted(sequence['frames'], 'frame')} ({', '.join(spans)}) with "
        f"{counted(sequence['observations'], kind)} of {counted(sequence['tracks'], 'track')}"
        f"{' (after repair)' if problem['repairs'] else ''}. Preset {problem['preset']}: "
        f"{number(problem['features'])} of the tracks have unmasked observations."
    )


def _sections(
    run: Run,
    summary: Mapping[str, Any],
    drawn: Mapping[str, Picture],
    plots: Mapping[str, Any] | None,
    images: Pictures,
) -> list[Section]:
    """The sections below table and trajectories; those without blocks are left out."""
    estimators = summary["estimators"]
    evidence, components = tables.evidence_table(run, estimators), details.components_table(estimators)
    excluded, events = details.exclusions_table(summary), details.events_tables(run)
    bands = [p for name, p in drawn.items() if name.startswith(BAND_FIGURES)]
    stills = figure_blocks(drawn, [n for n in drawn if not n.startswith((*EVIDENCE_FIGURES, *CHART_FIGURES))])
    beyond: list[Block] = [
        Grid(evidence.transposed("metric")),
        *figure_blocks(drawn, ["held_out"]),
        *([Folded("Errors with ±3-sigma bounds, for each estimator", bands)] if bands else []),
        *figure_blocks(drawn, ["reprojection_classes", "image_regions", "map_difference"]),
        *(folded(table) for table in details.long_tables(run)),
    ]
    live = plots is not None
    seen = plots is not None and plots["observations"] is not None
    frame: list[Block] = [Live("frame")]
    if images.step > 1:
        frame.insert(0, Note(f"To keep the page small, one frame in {images.step} has its images."))
    out: list[Block] = [*([Grid(excluded, "plain")] if excluded.rows else []), *map(folded, events)]
    return [
        Section("behind", "Reference and recording", _behind(run, plots)),
        Section("over-time", "Over time", [Live("charts"), *figure_blocks(drawn, CHART_FIGURES)] if live else []),
        Section("one-frame", "One frame in the images", frame if seen else [], "One frame", needs_script=True),
        Section(
            "evidence",
            "Consistency, residuals and map" if run.held_out is None else "Held-out error, consistency, residuals, map",
            beyond if evidence.columns else [],
        ),
        Section("components", "Reprojection errors by component", [Grid(components, "")] if components.rows else []),
        Section("left-out", "Excluded observations and events", out),
        Section("stills", "Static figures", [still_figures(stills)] if stills else []),
    ]


def _behind(run: Run, plots: Mapping[str, Any] | None) -> list[Block]:
    """Trust in the reference with its criteria, the tracks, and the diagnosis with its findings and repairs."""
    blocks: list[Block] = []
    if run.reference is not None:
        criteria = details.trust_table(run.trust.criteria)
        blocks.append(trust(run.reference, run.trust.verdict.name.lower(), run.trust.reasons, criteria))
    problem = run.problem
    size = None if plots is None else (plots["camera"]["width"], plots["camera"]["height"])
    if size is not None and (tracks := track_sentences(problem.sequence, size)):
        blocks += [Note("Tracks", is_heading=True), Sentences(tracks, "tracks")]
    findings = details.findings_table(problem.findings)
    if not (problem.diagnosed or findings.rows or problem.repairs):
        return blocks
    found = counted(len(findings.rows), "fault") + " detected" if findings.rows else "no fault detected"
    inner: list[Block] = [Grid(findings, "plain findings")] if findings.rows else []
    if problem.repairs:
        repairs = [f"{capitalized(repair)}." for repair in problem.repairs]
        inner += [Note("Repairs (the same for all estimators)", is_heading=True), Sentences(repairs, "repairs")]
    title = f"The recording: {found if problem.diagnosed or findings.rows else 'it could not be diagnosed'}"
    return [*blocks, Folded(title, inner, "diagnosis", is_open=bool(findings.rows))]


def render_diagnosis(found: Found, figures: Mapping[str, Figure]) -> str:
    """`report.html` of a diagnosis."""
    sequence, table = found.sequence, details.findings_table(found.findings)
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
                Section("figures", "Figures", list(pictures(figures, DIAGNOSIS_CAPTIONS).values())),
            ],
            settings={"Recording": {"name": sequence.name, "source": sequence.source, "format": sequence.form}},
        )
    )
