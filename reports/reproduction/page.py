"""The page of a reproduction, which opens offline: sentences, captions, and the tables of claims and repairs."""

from collections.abc import Mapping
from collections.abc import Sequence as Several
from dataclasses import replace

from matplotlib.figure import Figure

from fgbaseline.data.wording import plural

from ..formatting import meters, number, per_cent
from ..html.templates import environment, picture
from ..tables.table import Column, Row, Table, numbers, words
from .claims import Claim, Verdict
from .study import Outcome, Study

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
SWEEP = (
    "Landmarks updated in turn with the pose, W as in the source paper. Numbers: RMS distance from dead reckoning "
    "(darker: larger), and frames where the printed covariance is not positive definite. Below: the filter of figure 9 "
    "after one repair after another, and the share of observations that violate cheirality."
)
CAUSES = "Each panel has the repairs of the one before. Distances: RMS from the dead reckoning of the same panel."


def render(studies: Several[Study], claims: Several[Claim], figures: Mapping[str, Figure]) -> str:
    """The page `report.html`; text from files is escaped."""
    pictures = {name: picture(name, figure) for name, figure in figures.items()}
    return (
        environment()
        .get_template("reproduction.html")
        .render(
            studies=studies,
            claims=claims,
            badges=BADGES,
            verdict=[sentence for study in studies for sentence in sentences(study)],
            numbered=[p for name, p in pictures.items() if name.startswith("figure_")],
            others=[p for name, p in pictures.items() if not name.startswith(("figure_", "causes_", "sweep"))],
            sweep=replace(pictures["sweep"], caption=SWEEP),
            causes=[replace(p, caption=CAUSES) for name, p in pictures.items() if name.startswith("causes_")],
            stages=[_stages(study) for study in studies],
        )
    )


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
