"""Claims of the report, each tested: verdict, measured figure, cause, and the same filter on the repaired recording."""

from collections.abc import Callable
from collections.abc import Sequence as Several
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from fgbaseline.data import Status
from fgbaseline.data.plural import plural

from ..formatting import meters, per_cent, pixels
from .recordings import REPORTED, Reported
from .study import Staged, Study
from .trial import Outcome, path_length

SIGNIFICANT = 1.5
"""a cause is named where its repair changes the figure at least by this factor"""
LEVEL = 0.03
"""of the path's length: a climb beyond it is no town's"""
ALIKE = 0.02
"""of the path's length: two paths that stay closer look the same on a page"""
SMOOTH = 0.1
"""m and degrees that an update may add to a frame's motion, before the path looks noisy"""
WELL = 3.0
"""px, median error below which a filter may be said to work"""


class Verdict(StrEnum):
    """Result of the test of a claim."""

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
    """cause of the figure, as the diagnosis finds it"""
    repaired: str
    """the same filter on the repaired recording; empty where that has no bearing"""
    simulated: bool
    """whether the filter saw simulated features"""


def claim_on(
    study: Study, code: str, claim: str, verdict: Verdict, measured: str, cause: str, repaired: str = ""
) -> Claim:
    """A claim on the recording of a study, with its verdict."""
    simulated = study.subject.stand_in is not None and code not in ("samples", "prediction")
    return Claim(code, study.subject.name, claim, verdict, measured, cause, repaired, simulated)


def causes(study: Study, figure: Callable[[Staged], float], text: Callable[[float], str]) -> str:
    """The causes whose repair changes a figure, each with the figure before and after."""
    before, parts = figure(study.staged[0]), []
    for staged in study.staged[1:]:
        after = figure(staged)
        alike = before / SIGNIFICANT < after < before * SIGNIFICANT
        if not alike and text(before) != text(after):
            parts.append(f"{staged.stage.cause}: {text(before)} → {text(after)}")
        before = after
    if not study.causes:
        return "nothing that the diagnosis finds"
    return "; ".join(parts) or "none of what was repaired changes it"


def claims_of(study: Study) -> list[Claim]:
    """All claims that bear on a recording."""
    reported = study.subject.reported
    tests: list[Callable[[Study], Claim]] = [_predicted, _mapped]
    if reported is None or reported.slam is not None:
        tests += [_works, _like_dead_reckoning]
    tests.append(_low_noise)
    if reported is None or reported.slam is None:
        tests.append(_every_noise)
    counts = [] if reported is None else [_samples(study, reported), _features(study, reported)]
    return [*counts, *(test(study) for test in tests)]


def missing_claims(studies: Several[Study]) -> list[Claim]:
    """Claims on the report's recordings that are not given: none of them is tested."""
    given = {study.subject.name for study in studies}
    return [
        Claim(
            "recording",
            r.name,
            f"{r.frames} samples and {r.tracks} features",
            Verdict.CANNOT_TELL,
            f"{r.name} was not given",
            f"give {r.name}, or its velocities alone, as a further SEQUENCE",
            "",
            False,
        )
        for r in REPORTED
        if r.name not in given
    ]


def _samples(study: Study, reported: Reported) -> Claim:
    sequence = study.subject.recorded
    seconds = float(sequence.t[-1] - sequence.t[0])
    return claim_on(
        study,
        "samples",
        f"the data is given over {reported.frames} seconds",
        Verdict.FALSE,
        f"{plural(sequence.n_frames, 'frame')} in {seconds:.1f} s",
        f"{reported.frames} is the number of samples, taken {1 / np.median(sequence.dt):.1f} times a second",
    )


def _features(study: Study, reported: Reported) -> Claim:
    claim = f"it has {reported.tracks} features"
    if study.subject.stand_in is not None:
        return claim_on(
            study,
            "features",
            claim,
            Verdict.CANNOT_TELL,
            "the recording has no features here",
            "so many were simulated in their place",
        )
    o = study.subject.recorded.observations
    tracks = len(np.unique(o.landmark))
    return claim_on(
        study,
        "features",
        claim,
        Verdict.HOLDS if tracks == reported.tracks else Verdict.FALSE,
        f"{plural(tracks, 'track')}, {plural(len(o), 'observation')}",
        f"on average {len(o) / max(1, tracks):.0f} frames a track and "
        f"{len(o) / study.subject.recorded.n_frames:.0f} tracks a frame",
    )


def _predicted(study: Study) -> Claim:
    def climb(staged: Staged) -> float:
        return abs(float(staged.predicted[-1, :3, 3] @ staged.stage.sequence.up))

    road, end = path_length(study.predicted), float(study.predicted[-1, :3, 3] @ study.subject.recorded.up)
    way = "above" if end > 0 else "below"
    return claim_on(
        study,
        "prediction",
        "the predicted trajectory may be assumed to be correct",
        Verdict.FALSE if abs(end) > LEVEL * road else Verdict.HOLDS,
        f"it ends {meters(abs(end))} {way} the start after {meters(road)} on the road, which a view from above hides",
        causes(study, climb, meters),
        f"{meters(climb(study.staged[-1]))} in height",
    )


def _mapped(study: Study) -> Claim:
    mapped = study.mapped[max(study.mapped)]
    apart = float(np.abs(mapped.estimate.world_T_imu - study.staged[0].predicted).max())
    before, after = mapped.before.reprojection, mapped.after.reprojection
    return claim_on(
        study,
        "mapping",
        "after the landmark update the trajectory is dead reckoning's, which justifies that update",
        Verdict.IN_PART if apart == 0.0 else Verdict.FALSE,
        f"{_apart(apart)}, while the median reprojection error of {mapped.after.features} landmarks goes from "
        f"{before:.3g} to {after:.3g} px",
        "equal by construction: mapping takes the poses as given, so this says nothing of the landmarks, which keep "
        "the errors of the path they are seen from",
    )


def _works(study: Study) -> Claim:
    now, features = study.recorded, study.recorded.features
    good = not now.breaks and now.reprojection < WELL
    lost = (
        ""
        if now.lost == 0
        else (
            f", and the printed equations lose their covariance at {plural(now.lost, 'frame')}, "
            f"first at {now.first_lost}"
        )
    )
    return claim_on(
        study,
        "works",
        f"SLAM worked perfectly with {features} features",
        Verdict.HOLDS if good else Verdict.FALSE,
        f"median reprojection error {pixels(now.reprojection)}, {per_cent(now.behind)} of the observations of points "
        f"behind the camera{lost}",
        causes(study, lambda s: s.outcome.reprojection, pixels),
        f"{pixels(study.repaired.reprojection)}, {per_cent(study.repaired.behind)} behind, {_lost(study.repaired)}",
    )


def _like_dead_reckoning(study: Study) -> Claim:
    now, road = study.recorded, path_length(study.predicted)
    noisy = now.correction_m > SMOOTH or now.correction_deg > SMOOTH
    alike = now.apart_rmse < ALIKE * road
    verdict = Verdict.HOLDS if alike and noisy else Verdict.IN_PART if alike or noisy else Verdict.FALSE
    return claim_on(
        study,
        "like dead reckoning",
        "SLAM looks like dead reckoning, but noisy",
        verdict,
        f"{meters(now.apart_rmse)} (RMS) and up to {meters(now.apart_max)} from dead reckoning, of a path of "
        f"{meters(road)}; an update moves a frame by {_moved(now)}",
        causes(study, lambda s: s.outcome.apart_rmse, meters),
        f"{meters(study.repaired.apart_rmse)}, up to {meters(study.repaired.apart_max)}; {_moved(study.repaired)}",
    )


def _low_noise(study: Study) -> Claim:
    pixels, motion, none = (study.low[name] for name in ("pixels", "motion", "none"))
    singular = pixels.lost > study.recorded.lost or pixels.status is Status.FAILED
    without = none.status is Status.FAILED
    verdict = Verdict.HOLDS if singular and without else Verdict.IN_PART if singular or without else Verdict.FALSE
    zero = f"with W = 0 it stops ({none.reason})" if without else "with W = 0 it goes through"
    return claim_on(
        study,
        "low noise",
        "low noise gives a singular covariance",
        verdict,
        f"with V = {pixels.settings.pixel_variance:g} I the covariance as printed is lost at "
        f"{plural(pixels.lost, 'frame')} ({study.recorded.lost} with {study.recorded.settings.pixel_variance:g} I); "
        f"with a millionth of W at {plural(motion.lost, 'frame')}; {zero}",
        "(I - K H) Sigma loses its small eigenvalues to rounding where V is small beside H Sigma H^T, most near the "
        "camera plane; with W = 0 Sigma of the first pose, zero, stays zero and has no inverse",
    )


def _every_noise(study: Study) -> Claim:
    runs = [*study.swept, *study.held]
    broken = sum(run.breaks for run in runs)
    off = sum(not run.breaks and not run.apart_rmse < ALIKE * path_length(study.predicted) for run in runs)
    verdict = Verdict.HOLDS if broken == len(runs) else Verdict.IN_PART if broken else Verdict.FALSE
    repaired = study.swept_repaired
    return claim_on(
        study,
        "every noise",
        "singularity error for different numbers of features and every noise level",
        verdict,
        f"the printed equations break in {broken} of {len(runs)} settings, and in {off} more the path is over "
        f"{per_cent(ALIKE)} of its length from dead reckoning",
        "landmarks that pass through the camera plane: " + causes(study, lambda s: s.outcome.apart_rmse, meters),
        f"they break in {sum(run.breaks for run in repaired)} of {len(repaired)} settings" if repaired else "",
    )


def _apart(difference: float) -> str:
    return "the paths are equal to the last bit" if difference == 0.0 else f"the paths differ by up to {difference:.2g}"


def _moved(outcome: Outcome) -> str:
    return f"{meters(outcome.correction_m)} and {outcome.correction_deg:.2g}° (RMS)"


def _lost(outcome: Outcome) -> str:
    return "no covariance lost" if outcome.lost == 0 else f"covariance lost at {plural(outcome.lost, 'frame')}"
