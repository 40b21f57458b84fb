"""The page of a reproduction: one file that opens offline."""

from collections.abc import Mapping
from collections.abc import Sequence as Several
from dataclasses import replace
from importlib.resources import files

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.data.plural import plural

from ..formatting import number
from ..html.environment import Picture, picture
from .claim import Claim, Verdict
from .measures import metres, per_cent
from .study import Study
from .trial import Outcome

BADGES: Mapping[str, str] = {
    Verdict.HOLDS: "trusted",
    Verdict.IN_PART: "doubtful",
    Verdict.FALSE: "untrusted",
    Verdict.CANNOT_TELL: "",
}
"""the house's colours for good, fair and poor"""


def render(studies: Several[Study], claims: Several[Claim], figures: Mapping[str, Figure]) -> str:
    """`report.html`. All text that comes from files is escaped."""
    pictures = {name: picture(name, figure) for name, figure in figures.items()}
    return (
        _environment()
        .get_template("reproduce.html")
        .render(
            css=Markup(files("fgbaseline.reports.html").joinpath("report.css").read_text(encoding="utf-8")),
            studies=studies,
            claims=claims,
            badges=BADGES,
            sentences=[sentence for study in studies for sentence in verdict(study)],
            numbered=[p for name, p in pictures.items() if name.startswith("figure_")],
            others=[p for name, p in pictures.items() if not name.startswith(("figure_", "causes_", "sweep"))],
            sweep=_told(pictures["sweep"], SWEEP),
            causes=[_told(p, CAUSES) for name, p in pictures.items() if name.startswith("causes_")],
        )
    )


SWEEP = (
    "Landmarks updated in turn with the pose, W as in the report. Numbers in the fields: RMS distance from dead "
    "reckoning, and at how many frames the covariance as printed is lost; the darker, the farther. Below, the filter "
    "of figure 9 with one cause after another put right; 'behind' are observations of points that end up behind the "
    "camera."
)
CAUSES = "Each panel keeps the repairs of the one before. Distances are RMS from the dead reckoning beside it."


def verdict(study: Study) -> list[str]:
    """What was found on a recording, in two sentences."""
    label, now, then = study.subject.label, study.recorded, study.repaired
    first = (
        f"{label}: the documented filter with {now.features} features and V = {now.settings.pixel_variance:g} I is "
        f"{_state(now)}."
    )
    if not study.causes:
        return [first, f"{label}: nothing was found that could be repaired."]
    return [first, f"{label}, repaired ({'; '.join(study.causes)}): it is {_state(then)}."]


def _state(outcome: Outcome) -> str:
    lost = (
        f", its covariance as printed lost at {plural(outcome.lost, 'frame')}"
        if outcome.lost
        else ", no covariance lost"
    )
    return (
        f"{metres(outcome.apart_rmse)} (RMS) from dead reckoning with a median reprojection error of "
        f"{outcome.reprojection:.3g} px{lost}"
    )


def _told(shown: Picture, caption: str) -> Picture:
    return replace(shown, caption=caption)


def _environment() -> Environment:
    jinja = Environment(
        loader=FunctionLoader(lambda name: files(__package__).joinpath(name).read_text(encoding="utf-8")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    jinja.filters |= {"number": number, "metres": metres, "per_cent": per_cent}
    return jinja
