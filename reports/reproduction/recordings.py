"""Recordings of a reproduction: the source paper's two, those given, and simulated stand-ins for missing features."""

from collections.abc import Mapping
from collections.abc import Sequence as Several
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fgbaseline.data import Observations, Sequence, read
from fgbaseline.data.axis_conventions import axes_matrix
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.simulate import Simulation, Velocities, simulate_with_labels
from fgbaseline.data.simulate.rig import rig_of
from fgbaseline.data.wording import per_cent, plural
from fgbaseline.geometry import FloatArray, InputError

MAPPED = (700, 1000)
"""numbers of features of figures 5 to 8"""
TRACKS_PER_FRAME = 13_289 / 3_026
"""new tracks per frame of 10.npz, and of its stand-in"""
ANGULAR_AXES = "x,-y,-z"
"""axes of the recorded rates, as diagnosed in 03.npz, which has the same car and course"""
STANDSTILL = 0.2
"""m/s, speed below which the mean rate is the bias of the gyroscope"""
LEAST_STANDSTILL = 20
"""fewest frames for an estimate of the bias"""
FIRST_TRY, MORE, TRIES = 14.0, 1.3, 6
"""features in view per new track of a frame; factor of the next try; number of tries"""


@dataclass(frozen=True, eq=False, slots=True)
class StandIn:
    """A recording simulated in place of one without features, along its real velocities."""

    sequence: Sequence
    angular_axes: str
    gyro_bias: FloatArray
    """(3,) rad/s in recorded axes"""
    wrong: BoolArray
    """(n,) mask of the observations that are simulated as wrong matches"""
    remark: str


@dataclass(frozen=True, slots=True)
class PaperRecording:
    """A recording of the source paper: its size, and the numbers of the figures that show it."""

    name: str
    frames: int
    tracks: int
    path: int
    """number of the figure with the predicted path"""
    arrows: int
    """number of the figure with the orientations too"""
    mapped: Mapping[int, int] = field(default_factory=dict)
    """number of features -> number of the figure after landmark mapping"""
    slam: int | None = None
    """number of the figure after SLAM; None where the filter failed and there is none"""


PAPER_RECORDINGS = (
    PaperRecording("03.npz", 1010, 5105, path=1, arrows=4, mapped={700: 7, 1000: 8}, slam=9),
    PaperRecording("10.npz", 3026, 13_289, path=2, arrows=3, mapped={700: 5, 1000: 6}),
)


def paper_recording(frames: int) -> PaperRecording | None:
    """The recording of the source paper with this number of frames, by which files are recognized; else None."""
    return next((recording for recording in PAPER_RECORDINGS if recording.frames == frames), None)


@dataclass(frozen=True, eq=False, slots=True)
class Subject:
    """A recording under study, with what the filter runs on."""

    recorded: Sequence
    paper: PaperRecording | None
    """None for a recording that is not the source paper's"""
    stand_in: StandIn | None = None
    """simulated, where the recording has no features"""

    @property
    def name(self) -> str:
        """Name in tables and figures."""
        return self.recorded.name if self.paper is None else self.paper.name

    @property
    def studied(self) -> Sequence:
        """The recording whose features the filter uses."""
        return self.recorded if self.stand_in is None else self.stand_in.sequence

    @property
    def label(self) -> str:
        """Name of what the filter runs on."""
        return self.name if self.stand_in is None else f"{self.name}, simulated features"


def read_subjects(paths: Several[Path]) -> list[Subject]:
    """Reads the recordings, in the source paper's order; those without features get a stand-in.

    Raises InputError for an invalid file, and for a recording that is given twice.
    """
    every = [read(path) for path in paths]
    for i, sequence in enumerate(every):
        for before in every[:i]:
            if _same(before, sequence):
                raise InputError(
                    f"{paths[i]}: this is the same recording as {before.source or before.name}; give each once"
                )
    _require_different_names(paths, every)
    subjects = [Subject(s, paper_recording(s.n_frames), None if len(s.observations) else stand_in(s)) for s in every]
    return sorted(subjects, key=lambda subject: "~" if subject.paper is None else subject.paper.name)


def _require_different_names(paths: Several[Path], every: Several[Sequence]) -> None:
    taken: dict[str, Path] = {}
    for path, sequence in zip(paths, every, strict=True):
        known = paper_recording(sequence.n_frames)
        name = sequence.name if known is None else known.name
        if name in taken:
            what = f"the name {name}" if known is None else f"the {known.frames} frames of the source paper's {name}"
            raise InputError(f"{path}: it has {what}, as {taken[name]} does; give one of them at a time")
        taken[name] = path


def _same(one: Sequence, other: Sequence) -> bool:
    """Whether both are of the same drive, such as 10.npz and its velocities alone."""
    if one.n_frames != other.n_frames:
        return False
    return bool((one.t == other.t).all() and (one.linear_velocity == other.linear_velocity).all())


def stand_in(recorded: Sequence, seed: int = 0) -> StandIn:
    """Simulates a drive along the recorded velocities with as many tracks per frame as 10.npz and the faults of 03.npz.

    The rates are in other axes than imu_T_cam and have the gyroscope bias that is measured at standstill; a few matches
    are wrong. The recorded velocities with these faults repaired are the true motion.
    """
    bias, remark = _bias(recorded)
    axes = axes_matrix(ANGULAR_AXES)
    simulation = Simulation(
        path="along",
        along=Velocities(recorded.t, recorded.linear_velocity, (recorded.angular_velocity - bias) @ axes.T),
        rig=rig_of(recorded),
        angular_axes=ANGULAR_AXES,
        gyro_bias=(float(bias[0]), float(bias[1]), float(bias[2])),
        seed=seed,
    )
    wanted = round(TRACKS_PER_FRAME * recorded.n_frames)
    sequence, wrong = _of_size(simulation, wanted, seed)
    text = (
        f"Simulated: {recorded.name} has no features here, so "
        f"{plural(sequence.n_landmarks, 'track was', 'tracks were')} simulated "
        f"along its real velocities, the rates recorded in other axes ({ANGULAR_AXES}, as found in 03.npz), {remark}, "
        f"{per_cent(float(wrong.mean()))} of the matches wrong."
    )
    return StandIn(replace(sequence, name=f"{recorded.name} (simulated)"), ANGULAR_AXES, bias, wrong, text)


def _bias(recorded: Sequence) -> tuple[FloatArray, str]:
    still = np.linalg.norm(recorded.linear_velocity, axis=1) < STANDSTILL
    if still.sum() < LEAST_STANDSTILL:
        return np.zeros(3), "without a bias, since there is no standstill to measure it at"
    bias = np.median(recorded.angular_velocity[still], axis=0)
    read = ", ".join(f"{rate:.4f}" for rate in bias)
    return (
        bias,
        f"with a gyroscope bias of ({read}) rad/s, measured in {plural(int(still.sum()), 'frame')} of standstill",
    )


def _of_size(simulation: Simulation, wanted: int, seed: int) -> tuple[Sequence, BoolArray]:
    """The recording with `wanted` tracks, or with all where fewer are visible."""
    features = FIRST_TRY * TRACKS_PER_FRAME
    for _ in range(TRIES):
        sequence, labels = simulate_with_labels(replace(simulation, features_per_frame=features))
        if sequence.n_landmarks >= wanted:
            break
        features *= MORE
    keep = np.zeros(sequence.n_landmarks, dtype=np.bool_)
    keep[np.random.default_rng(seed).permutation(sequence.n_landmarks)[:wanted]] = True
    return _thinned(sequence, keep), labels.wrong[keep[sequence.observations.landmark]]


def _thinned(sequence: Sequence, keep: BoolArray) -> Sequence:
    o, truth = sequence.observations, sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    kept = o.select(keep[o.landmark])
    number = np.cumsum(keep) - 1
    return replace(
        sequence,
        observations=Observations(kept.frame, number[kept.landmark], kept.pixel),
        n_landmarks=int(keep.sum()),
        truth=replace(truth, landmarks=truth.landmarks[keep]),
    )
