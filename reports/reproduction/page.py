"""The page of a reproduction, one file that opens offline, and the table of its claims."""

from collections.abc import Mapping
from collections.abc import Sequence as Several
from dataclasses import replace

from matplotlib.figure import Figure

from ..formatting import meters, number, per_cent
from ..html.environment import environment, picture
from ..phrases.reproduction import CAUSES, SWEEP, sentences
from ..tables import Cell, Column, Row, Table
from .claims import Claim, Verdict
from .study import Study

BADGES: Mapping[str, str] = {
    Verdict.HOLDS: "trusted",
    Verdict.IN_PART: "doubtful",
    Verdict.FALSE: "untrusted",
    Verdict.CANNOT_TELL: "",
}
"""the house's colors for good, fair and poor"""
STAGES = (
    Column("put right", words=True),
    Column("from dead reckoning, RMS"),
    Column("largest"),
    Column("reprojection", unit="px"),
    Column("share behind the camera"),
    Column("frames lost"),
    Column("an update moves a frame by"),
)
FROM_TRUTH = Column("from the truth, RMS")


def render(studies: Several[Study], claims: Several[Claim], figures: Mapping[str, Figure]) -> str:
    """`report.html`. All text that comes from files is escaped."""
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
    """The claims by recording, as the terminal shows them."""
    rows = (
        Row(
            f"{claim.recording} (simulated)" if claim.simulated else claim.recording,
            (Cell(claim.claim), Cell(claim.verdict), Cell(claim.measured)),
        )
        for claim in claims
    )
    columns = tuple(Column(title, words=True) for title in ("the report says", "verdict", "measured"))
    return Table(columns, tuple(rows), name="recording")


def _stages(study: Study) -> Table:
    """The documented filter after each repair of a recording."""
    truth = study.subject.studied.truth is not None
    rows = []
    for staged in study.staged:
        o = staged.outcome
        texts = [staged.stage.cause or "–", meters(o.apart_rmse), meters(o.apart_max), number(o.reprojection)]
        texts += [per_cent(o.behind), number(o.lost), meters(o.correction_m)]
        texts += [meters(o.truth_rmse)] if truth else []
        rows.append(Row(staged.stage.name, tuple(map(Cell, texts))))
    columns = (*STAGES, FROM_TRUTH) if truth else STAGES
    return Table(columns, tuple(rows), name="stage", title=study.subject.label)
