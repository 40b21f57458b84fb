"""The page of a reproduction, which opens offline: sentences, captions, and the tables of claims and repairs."""

from collections.abc import Mapping
from collections.abc import Sequence as Several

from matplotlib.figure import Figure

from fgbaseline.data.wording import plural

from ..formatting import meters, number, per_cent
from ..html.page import Block, Grid, Note, Page, Pair, Section, pictures, render_page
from ..results.glossary import INERTIAL_TERMS, TERMS
from ..tables.table import Column, Row, Table, numbers, words
from .claims import Claim, Verdict
from .experiments import Outcome, Study

BADGES: Mapping[str, str] = {
    Verdict.HOLDS: "trusted",
    Verdict.IN_PART: "doubtful",
    Verdict.FALSE: "untrusted",
    Verdict.CANNOT_TELL: "",
}
"""style of each verdict: good, fair and poor"""
STAGES = (
    *words("repaired"),
    *numbers("from dead reckoning, RMS", "largest"),
    Column("reprojection", unit="px"),
    *numbers("cheirality violated", "frames, not positive definite", "correction per update, RMS"),
)
CAPTIONS: Mapping[str, str] = {
    "sweep": "Landmarks updated in turn with the pose, W as in the source paper. Numbers: RMS distance from dead "
    "reckoning (darker: larger), and frames where the printed covariance is not positive definite. Below: the filter "
    "of figure 9 after one repair after another, and the share of observations that violate cheirality.",
    "causes_": "Each panel has the repairs of the one before. Distances: RMS from the dead reckoning of the same "
    "panel.",
}
"""captions by the beginning of a figure's name"""
NUMBERED = (
    "In the order and under the numbers of the report; x and y of the world as it plots them, seen along z of the IMU "
    "at the start."
)


def render(studies: Several[Study], claims: Several[Claim], figures: Mapping[str, Figure]) -> str:
    """The page `report.html`; text from files is escaped."""
    drawn = pictures(figures, CAPTIONS)
    numbered = [p for name, p in drawn.items() if name.startswith("figure_")]
    others = [p for name, p in drawn.items() if not name.startswith(("figure_", *CAPTIONS))]
    stand_ins = [
        Note(f"{subject.name}. {subject.stand_in.remark} The results of its SLAM are those of this simulation.")
        for subject in (study.subject for study in studies)
        if subject.stand_in is not None
    ]
    paper: list[Block] = [Note(NUMBERED), Pair(numbered)] if numbered else []
    if others:
        paper += [Note("Of the same kind, not in the report", is_heading=True), Pair(others)]
    stages: list[Block] = [p for name, p in drawn.items() if name.startswith("causes_")]
    stages += [Grid(_stages(study), "stages", is_titled=True) for study in studies]
    return render_page(
        Page(
            kind="reproduction",
            title="The report on the documented filter, reproduced",
            about=" ".join(_about(study) for study in studies),
            verdict=[sentence for study in studies for sentence in sentences(study)],
            table=Section(
                "claims", "The report's claims", [*stand_ins, Grid(_claims(claims), "plain claims", BADGES)], "Claims"
            ),
            sections=[
                Section("sweep", "Where the filter breaks, and why", [drawn["sweep"]], "Where it breaks"),
                Section("figures", "Figures of the source paper", paper, "Figures"),
                Section("stages", "Cause by cause", stages),
            ],
            terms=TERMS.keys() - INERTIAL_TERMS.keys(),
        )
    )


def _about(study: Study) -> str:
    recorded, studied = study.subject.recorded, study.subject.studied
    return (
        f"{study.subject.label}: {number(recorded.n_frames)} frames, {number(len(studied.observations))} stereo "
        f"observations of {number(studied.n_landmarks)} tracks."
    )


def _claims(claims: Several[Claim]) -> Table:
    """Table of the claims for the page."""
    columns = words("of", "verdict", "measured", "behind it", "on the repaired recording")
    rows = [Row.of(c.claim, _recording(c), c.verdict, c.measured, c.cause, c.repaired or "–") for c in claims]
    return Table(columns, tuple(rows), name="the report says")


def _recording(claim: Claim) -> str:
    return f"{claim.recording} (simulated features)" if claim.simulated else claim.recording


def claims_table(claims: Several[Claim]) -> Table:
    """Table of the claims by recording, for the terminal."""
    names = (f"{claim.recording} (simulated)" if claim.simulated else claim.recording for claim in claims)
    rows = (Row.of(name, c.claim, c.verdict, c.measured) for name, c in zip(names, claims, strict=True))
    return Table(words("claim of the source paper", "verdict", "measured"), tuple(rows), name="recording")


def _stages(study: Study) -> Table:
    """Table of the documented filter after each repair of a recording."""
    truth = study.subject.studied.truth is not None
    rows = []
    for staged in study.staged:
        o = staged.outcome
        texts = [staged.stage.cause or "–", meters(o.apart_rmse), meters(o.apart_max), number(o.reprojection)]
        texts += [per_cent(o.behind), number(o.lost), meters(o.correction_m)]
        texts += [meters(o.truth_rmse)] if truth else []
        rows.append(Row.of(staged.stage.name, *texts))
    columns = (*STAGES, *(numbers("from ground truth, RMS") if truth else ()))
    return Table(columns, tuple(rows), name="stage", title=study.subject.label)


def sentences(study: Study) -> list[str]:
    """Two sentences on a recording: the filter on the data as recorded, and on the repaired data."""
    label, now, then = study.subject.label, study.recorded, study.repaired
    first = (
        f"{label}: the documented filter with {now.features} features and V = {now.settings.pixel_variance:g} I is "
        f"{_state(now)}."
    )
    if not study.causes:
        return [first, f"{label}: no fault detected."]
    return [first, f"{label}, repaired ({'; '.join(study.causes)}): it is {_state(then)}."]


def _state(outcome: Outcome) -> str:
    lost = f"not positive definite at {plural(outcome.lost, 'frame')}" if outcome.lost else "always positive definite"
    return (
        f"{meters(outcome.apart_rmse)} (RMS) from dead reckoning with a median reprojection error of "
        f"{outcome.reprojection:.3g} px, its printed covariance {lost}"
    )
