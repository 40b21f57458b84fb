"""Claims of the source paper: verdict, measured value, cause, and the same filter on the repaired recording."""

from collections.abc import Callable
from collections.abc import Sequence as Several
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from fgbaseline.data import Status
from fgbaseline.data.wording import plural

from ..formatting import limit_per_cent, meters, per_cent, pixels
from .experiments import Outcome, Staged, Study
from .recordings import PAPER_RECORDINGS, PaperRecording

MIN_CAUSE_FACTOR = 1.5
"""a cause is named where its repair changes the value at least by this factor"""
MAX_CLIMB = 0.03
"""largest plausible height of the end, as a share of the path's length"""
MAX_DISTANCE = 0.02
"""share of the path's length, below which two paths look the same in a figure"""
MAX_CORRECTION = 0.1
"""m and degrees; a path with larger corrections by an update looks noisy"""
MAX_REPROJECTION = 3.0
"""px, median; a filter below it works"""


class Verdict(StrEnum):
    """Verdict on a claim."""

    HOLDS = "holds"
    IN_PART = "holds in part"
    FALSE = "does not hold"
    CANNOT_TELL = "cannot tell"


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim of the source paper on one recording, with its test."""

    code: str
    recording: str
    claim: str
    verdict: Verdict
    measured: str
    cause: str
    """cause of the measured value, by the diagnosis"""
    repaired: str
    """result of the filter on the repaired recording; empty where it does not apply"""
    simulated: bool
    """whether the filter used simulated features"""


def claim_on(
    study: Study, code: str, claim: str, verdict: Verdict, measured: str, cause: str, repaired: str = ""
) -> Claim:
    """A claim on the recording of a study, with its verdict."""
    simulated = study.subject.stand_in is not None and code not in ("samples", "prediction")
    return Claim(code, study.subject.name, claim, verdict, measured, cause, repaired, simulated)


def causes(study: Study, figure: Callable[[Staged], float], text: Callable[[float], str]) -> str:
    """The causes whose repair changes a value, each with the value before and after."""
    before, parts = figure(study.staged[0]), []
    for staged in study.staged[1:]:
        after = figure(staged)
        alike = before / MIN_CAUSE_FACTOR < after < before * MIN_CAUSE_FACTOR
        if not alike and text(before) != text(after):
            parts.append(f"{staged.stage.cause}: {text(before)} → {text(after)}")
        before = after
    if not study.causes:
        return "no fault detected"
    return "; ".join(parts) or "no repair changes it"


def claims_of(study: Study) -> list[Claim]:
    """All claims that apply to a recording."""
    paper = study.subject.paper
    tests: list[Callable[[Study], Claim]] = [_predicted, _mapped]
    if paper is None or paper.slam is not None:
        tests += [_works, _like_dead_reckoning]
    tests.append(_low_noise)
    if paper is None or paper.slam is None:
        tests.append(_every_noise)
    counts = [] if paper is None else [_samples(study, paper), _features(study, paper)]
    return [*counts, *(test(study) for test in tests)]


def missing_claims(studies: Several[Study]) -> list[Claim]:
    """Claims on the source paper's recordings that are not given; they are not tested."""
    given = {study.subject.name for study in studies}
    return [
        Claim(
            "recording",
            r.name,
            f"{r.frames} samples and {r.tracks} features",
            Verdict.CANNOT_TELL,
            f"{r.name} was not given",
            f"give {r.name}, or its velocities alone, as a further RECORDING",
            "",
            False,
        )
        for r in PAPER_RECORDINGS
        if r.name not in given
    ]


def _samples(study: Study, paper: PaperRecording) -> Claim:
    sequence = study.subject.recorded
    claim = f"the data is given over {paper.frames} seconds"
    found = f"{plural(sequence.n_frames, 'frame')} in {float(sequence.t[-1] - sequence.t[0]):.1f} s"
    why = f"{paper.frames} is the number of samples, at {1 / np.median(sequence.dt):.1f} Hz"
    return claim_on(study, "samples", claim, Verdict.FALSE, found, why)


def _features(study: Study, paper: PaperRecording) -> Claim:
    claim, recorded = f"it has {paper.tracks} features", study.subject.recorded
    if study.subject.stand_in is not None:
        found, why = "the given recording has no features", "this number was simulated in their place"
        return claim_on(study, "features", claim, Verdict.CANNOT_TELL, found, why)
    n, tracks = len(recorded.observations), len(np.unique(recorded.observations.landmark))
    verdict = Verdict.HOLDS if tracks == paper.tracks else Verdict.FALSE
    found = f"{plural(tracks, 'track')}, {plural(n, 'observation')}"
    why = f"on average {n / max(1, tracks):.0f} frames per track and {n / recorded.n_frames:.0f} tracks per frame"
    return claim_on(study, "features", claim, verdict, found, why)


def _predicted(study: Study) -> Claim:
    def climb(staged: Staged) -> float:
        return abs(float(staged.predicted[-1, :3, 3] @ staged.stage.sequence.up))

    road, end = study.road, float(study.predicted[-1, :3, 3] @ study.subject.recorded.up)
    way = "above" if end > 0 else "below"
    return claim_on(
        study,
        "prediction",
        "the predicted trajectory may be assumed to be correct",
        Verdict.FALSE if abs(end) > MAX_CLIMB * road else Verdict.HOLDS,
        f"it ends {meters(abs(end))} {way} the start after {meters(road)}, not visible from above",
        causes(study, climb, meters),
        f"{meters(climb(study.staged[-1]))} in height",
    )


def _mapped(study: Study) -> Claim:
    mapped = study.mapped[max(study.mapped)]
    apart = float(np.abs(mapped.estimate.world_T_imu - study.staged[0].predicted).max())
    equal = "are bitwise equal" if apart == 0.0 else f"differ by up to {apart:.2g}"
    before, after = mapped.before.reprojection, mapped.after.reprojection
    return claim_on(
        study,
        "mapping",
        "after the landmark update the trajectory is dead reckoning's, which justifies that update",
        Verdict.IN_PART if apart == 0.0 else Verdict.FALSE,
        f"the trajectories {equal}, while the median reprojection error of {mapped.after.features} landmarks goes from "
        f"{before:.3g} to {after:.3g} px",
        "equal by construction: mapping does not change the poses. The landmarks have the errors of the trajectory",
    )


def _works(study: Study) -> Claim:
    now, features = study.recorded, study.recorded.features
    good = not now.breaks and now.reprojection < MAX_REPROJECTION
    frames = f"{plural(now.lost, 'frame')}, first at {now.first_lost}"
    lost = f", and the printed covariance is not positive definite at {frames}" if now.lost else ""
    return claim_on(
        study,
        "works",
        f"SLAM worked perfectly with {features} features",
        Verdict.HOLDS if good else Verdict.FALSE,
        f"median reprojection error {pixels(now.reprojection)}, {per_cent(now.behind)} of the observations violate "
        f"cheirality{lost}",
        causes(study, lambda s: s.outcome.reprojection, pixels),
        f"{pixels(study.repaired.reprojection)}, {per_cent(study.repaired.behind)} violate cheirality, "
        f"{_lost(study.repaired)}",
    )


def _like_dead_reckoning(study: Study) -> Claim:
    now, road = study.recorded, study.road
    noisy = now.correction_m > MAX_CORRECTION or now.correction_deg > MAX_CORRECTION
    alike = now.apart_rmse < MAX_DISTANCE * road
    verdict = Verdict.HOLDS if alike and noisy else Verdict.IN_PART if alike or noisy else Verdict.FALSE
    return claim_on(
        study,
        "like dead reckoning",
        "SLAM looks like dead reckoning, but noisy",
        verdict,
        f"{meters(now.apart_rmse)} (RMS) and up to {meters(now.apart_max)} from dead reckoning, over a path length of "
        f"{meters(road)}; correction per update {_correction(now)}",
        causes(study, lambda s: s.outcome.apart_rmse, meters),
        f"{meters(study.repaired.apart_rmse)}, up to {meters(study.repaired.apart_max)}; {_correction(study.repaired)}",
    )


def _low_noise(study: Study) -> Claim:
    pixels, motion, none = (study.low[name] for name in ("pixels", "motion", "none"))
    singular = pixels.lost > study.recorded.lost or pixels.status is Status.FAILED
    without = none.status is Status.FAILED
    verdict = Verdict.HOLDS if singular and without else Verdict.IN_PART if singular or without else Verdict.FALSE
    zero = f"with W = 0 the filter fails ({none.reason})" if without else "with W = 0 the filter finishes"
    return claim_on(
        study,
        "low noise",
        "low noise gives a singular covariance",
        verdict,
        f"with V = {pixels.settings.pixel_variance:g} I the printed covariance is not positive definite at "
        f"{plural(pixels.lost, 'frame')} ({study.recorded.lost} with {study.recorded.settings.pixel_variance:g} I); "
        f"with 1e-6 W at {plural(motion.lost, 'frame')}; {zero}",
        "rounding removes small eigenvalues of (I - K H) Sigma where V is small against H Sigma H^T, mostly near the "
        "camera plane; with W = 0 Sigma of the first pose stays zero and has no inverse",
    )


def _every_noise(study: Study) -> Claim:
    runs = [*study.swept, *study.held]
    failing = sum(run.breaks for run in runs)
    off = sum(not run.breaks and not run.apart_rmse < MAX_DISTANCE * study.road for run in runs)
    verdict = Verdict.HOLDS if failing == len(runs) else Verdict.IN_PART if failing else Verdict.FALSE
    repaired = study.swept_repaired
    return claim_on(
        study,
        "every noise",
        "singularity error for different numbers of features and every noise level",
        verdict,
        f"the printed equations fail in {failing} of {len(runs)} settings; in {off} more the trajectory is over "
        f"{limit_per_cent(MAX_DISTANCE)} of its length from dead reckoning",
        "landmarks cross the camera plane: " + causes(study, lambda s: s.outcome.apart_rmse, meters),
        f"they fail in {sum(run.breaks for run in repaired)} of {len(repaired)} settings" if repaired else "",
    )


def _correction(outcome: Outcome) -> str:
    return f"{meters(outcome.correction_m)} and {outcome.correction_deg:.2g}° (RMS)"


def _lost(outcome: Outcome) -> str:
    frames = plural(outcome.lost, "frame")
    return f"covariance not positive definite at {frames}" if outcome.lost else "all covariances positive definite"
