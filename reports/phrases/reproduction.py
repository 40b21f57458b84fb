"""Sentences and captions of a reproduction."""

from fgbaseline.data.plural import plural

from ..formatting import meters
from ..reproduction.study import Study
from ..reproduction.trial import Outcome

SWEEP = (
    "Landmarks updated in turn with the pose, W as in the report. Numbers in the fields: RMS distance from dead "
    "reckoning, and at how many frames the covariance as printed is lost; the darker, the farther. Below, the filter "
    "of figure 9 with one cause after another put right; 'behind' are observations of points that end up behind the "
    "camera."
)
CAUSES = "Each panel keeps the repairs of the one before. Distances are RMS from the dead reckoning beside it."


def sentences(study: Study) -> list[str]:
    """Two sentences on a recording: the filter as recorded, and repaired."""
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
        f"{meters(outcome.apart_rmse)} (RMS) from dead reckoning with a median reprojection error of "
        f"{outcome.reprojection:.3g} px{lost}"
    )
