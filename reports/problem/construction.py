"""The recording and the problem of a run, by its settings."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fgbaseline.data import (
    HeldOut,
    Problem,
    Sequence,
    Truth,
    attach_truth,
    documented,
    read,
)
from fgbaseline.data.finding import OF_THE_FILE
from fgbaseline.data.formats import ParsedTrajectory
from fgbaseline.data.problem.documented import DEFAULT_FEATURES
from fgbaseline.data.tracking import ImageOptions, Pictures, has_images
from fgbaseline.diagnosis import (
    AsRecordedSettings,
    calibrated,
    hold_out,
    known_units,
    read_repairs,
    unit_findings,
    unusable,
)
from fgbaseline.diagnosis.conventions.units import evidence
from fgbaseline.geometry import InputError

from .settings import BESIDE, IMAGES, POSED, RunSettings

MIN_TRUTH_SHARE = 0.5
"""smallest share of frames with ground truth that is not remarked on"""
TRACKS = "tracks.npz"
"""file of the tracks in the folder of a run on images"""


def read_sequence(settings: RunSettings, pictures: Pictures | None = None) -> Sequence:
    """Reads or simulates the recording with its ground truth; `pictures` gets its images. Raises InputError."""
    sequence = _read(settings, pictures)
    if settings.truth_up is None:
        return sequence
    length = float(np.linalg.norm(settings.truth_up))
    if sequence.truth is None or not (np.isfinite(length) and length > 0.0):
        given = ",".join(f"{x:g}" for x in settings.truth_up)
        why = (
            "is not a direction" if sequence.truth is not None else "is given without a ground truth; add --truth FILE"
        )
        raise InputError(f"truth-up: {given} {why}")
    return replace(sequence, truth=replace(sequence.truth, up=np.array(settings.truth_up) / length))


def _read(settings: RunSettings, pictures: Pictures | None) -> Sequence:
    if settings.sequence is None:
        if settings.time_unit is not None:
            raise InputError("time-unit: the simulated drive has stamps in seconds; give a RECORDING with --time-unit")
        if settings.truth is not None or settings.truth_frame is not None:
            raise InputError("truth: the simulated drive has its own truth; give a RECORDING with --truth")
        _require_none(settings, (*BESIDE, *IMAGES), "give a RECORDING with it")
        if settings.imu is not None or settings.imu_calibration is not None:
            raise InputError("imu: the simulated drive has its own motion; give a RECORDING with --imu")
        from fgbaseline.data.simulate import Simulation, simulate

        return simulate(Simulation(seed=settings.seed))
    _require_truth_frame(settings)
    if not isinstance(settings.sequence, Path):
        sequence = _in_memory(settings.sequence, settings)
    elif has_images(settings.sequence):
        sequence = _of_images(settings, pictures)
        if isinstance(settings.truth, Path):
            return sequence  # with this truth in place of its own
    else:
        _require_none(settings, IMAGES, "it belongs to a recording of images; leave it out")
        sequence = read(
            settings.sequence,
            None,
            None,
            settings.time_unit,
            settings.imu,
            settings.imu_calibration,
            settings.velocities,
            settings.extrinsic,
        )
    truth = settings.truth
    if truth is None:
        return sequence
    if isinstance(truth, Truth):
        return sequence.with_truth(truth)
    if isinstance(truth, ParsedTrajectory):
        truth = truth.trajectory(times=[sequence.t])
    return attach_truth(sequence, truth, settings.truth_frame)


def _require_truth_frame(settings: RunSettings) -> None:
    """Raises InputError where the body of the true poses is missing, or stated of nothing."""
    truth, frame = settings.truth, settings.truth_frame
    if frame is not None and (truth is None or isinstance(truth, Truth)):
        why = "without a ground truth; add --truth FILE" if truth is None else "with a Truth, whose body is the imu"
        raise InputError(f"truth-frame: '{frame}' is given {why}")
    if frame is None and not (truth is None or isinstance(truth, Truth)):
        name = truth if isinstance(truth, Path) else truth.name
        raise InputError(f"truth: the body of the poses in {name} is unknown; add --truth-frame camera or imu")


def _in_memory(given: Sequence | Problem, settings: RunSettings) -> Sequence:
    """Recording given in memory, or that of a given problem. Raises InputError for settings that do not apply to it."""
    for name in ("time_unit", "imu", "imu_calibration", *BESIDE, *IMAGES):
        if getattr(settings, name) is not None:
            raise InputError(f"{name.replace('_', '-')}: it is for a recording in a file; leave it out")
    if isinstance(given, Sequence):
        return given
    for name, usual in POSED.items():
        if getattr(settings, name) != usual:
            raise InputError(f"{name.replace('_', '-')}: the problem is posed already; leave it out")
    return given.sequence


def _of_images(settings: RunSettings, pictures: Pictures | None) -> Sequence:
    from fgbaseline.data.tracking.sources.image_recording import TruthFile

    from .images import tracked  # OpenCV is imported where there are images

    if settings.time_unit is not None:
        raise InputError("time-unit: the form of these images states the unit of their stamps; leave it out")
    assert isinstance(settings.sequence, Path)
    names = ("cameras", "right", "calibration", "times", "topics", "imu", "imu_calibration", "velocities", "extrinsic")
    options = ImageOptions(**{name: getattr(settings, name) for name in names})
    truth, body = settings.truth, settings.truth_frame
    given = TruthFile(truth, body) if isinstance(truth, Path) and body is not None else None
    found = tracked(settings.sequence, options, settings.tracker, motion=True, truth=given, pictures=pictures)
    return found.sequence(given)


def _require_none(settings: RunSettings, names: tuple[str, ...], advice: str) -> None:
    """Raises InputError for the first of these settings that is given."""
    for name in names:
        if getattr(settings, name) is not None:
            raise InputError(f"{name}: {getattr(settings, name)} is given without need; {advice}")


def hold_out_tracks(sequence: Sequence, settings: RunSettings) -> tuple[Sequence, HeldOut | None]:
    """Splits a recording into what diagnosis and estimators use, and the held-out tracks. Raises InputError."""
    return hold_out(sequence, settings.held_out, settings.seed) if settings.held_out != 0.0 else (sequence, None)


def build_problem(sequence: Sequence, settings: RunSettings, processes: int = 1) -> Problem:
    """Builds the problem of a preset, with `processes` for its diagnosis; one that is given is left as it is.

    Raises InputError.
    """
    if isinstance(settings.sequence, Problem):
        return settings.sequence
    if settings.repairs is not None and (settings.as_recorded or settings.preset == "documented"):
        why = "--as-recorded" if settings.as_recorded else "the documented preset"
        raise InputError(f"repairs: {why} uses no repairs; leave out one of the two")
    if len(sequence.observations) and (reason := unusable(sequence)):
        raise InputError(f"{sequence.source}: {reason}")
    if sequence.imu is None and (settings.as_recorded or settings.preset == "documented"):
        _require_units(sequence)
    repairs = None if settings.repairs is None else read_repairs(settings.repairs)
    features = None if settings.features == "all" else settings.features
    if settings.preset == "documented":
        if settings.features is None:
            features = DEFAULT_FEATURES
        return documented(sequence, features, settings.landmarks)
    assumed = AsRecordedSettings() if settings.as_recorded else None
    return calibrated(sequence, features, settings=assumed, repairs=repairs, processes=processes)


def preliminary_remarks(problem: Problem) -> list[str]:
    """Sentences that a run prints first: faults of the file, an offset that stays, and ground truth for few frames."""
    left = [f for f in problem.findings if f.code == "time_offset" and f.after == f.before]
    sentences = [finding.sentence for finding in problem.findings if finding.code in OF_THE_FILE]
    sentences += [finding.sentence for finding in left]
    truth = problem.sequence.truth
    if truth is not None and truth.known.mean() < MIN_TRUTH_SHARE:
        sentences += [remark for remark in problem.sequence.remarks if "ground truth" in remark.lower()]
    return sentences


def _require_units(sequence: Sequence) -> None:
    """Raises InputError for a recording in units other than SI, for a preset without repairs."""
    units = known_units(sequence)
    if units.doubt:
        raise InputError(f"{sequence.source}: {units.doubt}")
    wrong = [finding.sentence.rstrip(".").split("; multiplied")[0] for finding in unit_findings(units, sequence)]
    if wrong:
        raise InputError(
            f"{sequence.source}: {'. '.join(wrong)} ({evidence(units)}). Without repairs this is a different motion; "
            "convert the file, or repair it with --preset calibrated and without --as-recorded"
        )
