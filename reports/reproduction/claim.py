"""A claim of the report, tested, and how what lies behind a figure is told."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from .study import Staged, Study

SIGNIFICANT = 1.5
"""a cause is named where putting it right changes the figure at least by this factor"""


class Verdict(StrEnum):
    """What comes of a claim."""

    HOLDS = "holds"
    IN_PART = "holds in part"
    FALSE = "does not hold"
    CANNOT_TELL = "cannot tell"


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim of the report on one recording, tested."""

    code: str
    recording: str
    claim: str
    verdict: Verdict
    measured: str
    cause: str
    """what the toolkit finds behind the figure"""
    repaired: str
    """the same filter on the repaired recording; empty where that has no bearing"""
    simulated: bool
    """whether the filter saw simulated features"""


def claim_on(
    study: Study, code: str, claim: str, verdict: Verdict, measured: str, cause: str, repaired: str = ""
) -> Claim:
    """A claim on what a study is of, with its verdict."""
    simulated = study.subject.stand_in is not None and code not in ("samples", "prediction")
    return Claim(code, study.subject.name, claim, verdict, measured, cause, repaired, simulated)


def causes(study: Study, figure: Callable[[Staged], float], told: Callable[[float], str]) -> str:
    """Which causes, once put right, change a figure, and from what to what."""
    before, parts = figure(study.staged[0]), []
    for staged in study.staged[1:]:
        after = figure(staged)
        alike = before / SIGNIFICANT < after < before * SIGNIFICANT
        if not alike and told(before) != told(after):
            parts.append(f"{staged.stage.cause}: {told(before)} → {told(after)}")
        before = after
    if not study.causes:
        return "nothing that the diagnosis finds"
    return "; ".join(parts) or "none of what was repaired changes it"
