"""Recordings of a reproduction: the source paper's two, those given, simulated stand-ins for missing features, and each
recording repaired one fault at a time.
"""

from collections.abc import Mapping
from collections.abc import Sequence as Several
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fgbaseline.data import Excluded, Observations, Sequence, read
from fgbaseline.data.axis_conventions import IDENTITY, axes_matrix
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.simulate import Simulation, Velocities, simulate_with_labels
from fgbaseline.data.simulate.rig import rig_of
from fgbaseline.data.velocity_increments import Shift, zero_order_hold
from fgbaseline.data.wording import per_cent, plural
from fgbaseline.diagnosis import Diagnosis, repair
from fgbaseline.diagnosis.repairs.significance import significant_bias
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings
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
AS_RECORDED = "as recorded"
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
        same = next((before for before in every[:i] if _same(before, sequence)), None)
        if same is not None:
            raise InputError(f"{paths[i]}: this is the same recording as {same.source or same.name}; give each once")
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
    bias, frames = np.median(recorded.angular_velocity[still], axis=0), plural(int(still.sum()), "frame")
    return bias, f"with a gyroscope bias of {_vector(bias)} rad/s, measured in {frames} of standstill"


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


@dataclass(frozen=True, eq=False, slots=True)
class Stage:
    """The recording with all faults up to this stage repaired, to show the effect of each on the documented filter."""

    name: str
    cause: str
    """the fault that this stage repairs; empty for the recording as recorded"""
    sequence: Sequence


def diagnosed_stages(diagnosis: Diagnosis) -> list[Stage]:
    """Stages of a diagnosed recording: as recorded, then with one more fault repaired: axes, bias, interval, tracks."""
    stages = [Stage(AS_RECORDED, "", diagnosis.sequence)]
    if diagnosis.fit is None:
        return stages
    angular, linear, bias = diagnosis.angular, diagnosis.linear, significant_bias(diagnosis)
    if angular.changed or linear.changed:
        stages.append(_axes_repaired(stages[-1], angular.name, linear.name))
    if bias.any():
        stages.append(_bias_removed(stages[-1], bias, angular.name))
    if diagnosis.shift != Shift.AFTER:
        cause = f"velocities assigned to the wrong interval (by {-diagnosis.shift:g} intervals)"
        stages.append(Stage("right interval", cause, _restamped(stages[-1].sequence, diagnosis.shift)))
    repaired = repair(diagnosis, MaskSettings())
    good = repaired.excluded == Excluded.NO
    if not good.all():
        tracked = replace(
            stages[-1].sequence,
            imu_T_cam=repaired.sequence.imu_T_cam,
            observations=repaired.sequence.observations.select(good),
            n_landmarks=repaired.sequence.n_landmarks,
            truth=repaired.sequence.truth,
        )
        copied = ", copied frames" if (repaired.excluded == Excluded.COPIED).any() else ""
        cause = f"wrong matches{copied} and other unusable observations ({per_cent(float(np.mean(~good)))} of all)"
        stages.append(Stage("right matches", cause, tracked))
    return stages


def simulated_stages(simulated: StandIn) -> list[Stage]:
    """The stages of a simulated recording, whose faults are known."""
    stages = [Stage(AS_RECORDED, "", simulated.sequence)]
    stages.append(_axes_repaired(stages[-1], simulated.angular_axes, IDENTITY))
    if simulated.gyro_bias.any():
        stages.append(_bias_removed(stages[-1], simulated.gyro_bias, simulated.angular_axes))
    if simulated.wrong.any():
        now = stages[-1].sequence
        cause = f"wrong matches ({per_cent(float(simulated.wrong.mean()))} of the observations)"
        right = replace(now, observations=now.observations.select(~simulated.wrong))
        stages.append(Stage("right matches", cause, right))
    return stages


def _axes_repaired(stage: Stage, angular: str, linear: str) -> Stage:
    every = (("angular", angular), ("linear", linear))
    wrong = [f"{what} velocity, {name}" for what, name in every if name != IDENTITY]
    turned = replace(
        stage.sequence,
        angular_velocity=stage.sequence.angular_velocity @ axes_matrix(angular).T,
        linear_velocity=stage.sequence.linear_velocity @ axes_matrix(linear).T,
    )
    return Stage("axes agree", f"inconsistent axes of the {' and of the '.join(wrong)}", turned)


def _bias_removed(stage: Stage, bias: FloatArray, angular: str) -> Stage:
    """The stage without a bias (3,) in recorded axes, whose rates are in the axes that `angular` gives them."""
    rates = stage.sequence.angular_velocity - bias @ axes_matrix(angular).T
    cause = f"gyroscope bias of {_vector(bias)} rad/s"
    return Stage("without bias", cause, replace(stage.sequence, angular_velocity=rates))


def _restamped(sequence: Sequence, shift: float) -> Sequence:
    """The recording in which velocity k moves frame k to k + 1."""
    twist = zero_order_hold(sequence, shift)
    twist = np.concatenate([twist, twist[-1:]])
    return replace(sequence, linear_velocity=twist[:, :3], angular_velocity=twist[:, 3:])


def _vector(values: FloatArray) -> str:
    return f"({', '.join(f'{value:.4f}' for value in values)})"
