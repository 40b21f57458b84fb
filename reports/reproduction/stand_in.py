"""A recording simulated in the place of one whose features are not at hand, along its real velocities."""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data import Observations, Sequence
from fgbaseline.data.axis_conventions import axes_matrix
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.plural import plural
from fgbaseline.data.simulate import Simulation, Velocities, simulate_with_labels
from fgbaseline.data.simulate.rig import rig_of
from fgbaseline.geometry import FloatArray

TRACKS_PER_FRAME = 13_289 / 3_026
"""new tracks a frame of 10.npz, which a recording simulated in its place has too"""
ANGULAR_AXES = "x,-y,-z"
"""in which the rates are recorded: what the diagnosis finds in 03.npz, which came from the same car and course"""
STANDSTILL = 0.2
"""m/s, below which what the gyroscope reads is its bias"""
LEAST_STANDSTILL = 20
"""frames, from which on that is believed"""
FIRST_TRY, MORE, TRIES = 14.0, 1.3, 6
"""features in view for each new track a frame, by how much more the next try asks for, and how often"""


@dataclass(frozen=True, eq=False, slots=True)
class StandIn:
    """The simulated recording, its faults, and a sentence about them."""

    sequence: Sequence
    angular_axes: str
    gyro_bias: FloatArray
    """(3,) rad/s in recorded axes"""
    wrong: BoolArray
    """(n,) which of its observations are wrong matches"""
    remark: str


def stand_in(recorded: Sequence, seed: int = 0) -> StandIn:
    """A drive along the recorded velocities that sees as many tracks a frame as 10.npz, with the faults of 03.npz.

    The rates are recorded in other axes than those of imu_T_cam, with the bias that the gyroscope shows where the car
    stands still, and a few matches are wrong. The recorded velocities, so repaired, are its true motion.
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
    remark_on_all = (
        f"Simulated: {recorded.name} has no features here, so "
        f"{plural(sequence.n_landmarks, 'track was', 'tracks were')} simulated "
        f"along its real velocities, the rates recorded in other axes ({ANGULAR_AXES}, as found in 03.npz), {remark}, "
        f"{wrong.mean():.0%} of the matches wrong."
    )
    return StandIn(replace(sequence, name=f"{recorded.name} (simulated)"), ANGULAR_AXES, bias, wrong, remark_on_all)


def _bias(recorded: Sequence) -> tuple[FloatArray, str]:
    still = np.linalg.norm(recorded.linear_velocity, axis=1) < STANDSTILL
    if still.sum() < LEAST_STANDSTILL:
        return np.zeros(3), "without a bias, since the car never stands still to show it"
    bias = np.median(recorded.angular_velocity[still], axis=0)
    read = ", ".join(f"{rate:.4f}" for rate in bias)
    return (
        bias,
        f"with the bias of ({read}) rad/s that the gyroscope reads in "
        f"{plural(int(still.sum()), 'frame')} of standstill",
    )


def _of_size(simulation: Simulation, wanted: int, seed: int) -> tuple[Sequence, BoolArray]:
    """The recording with exactly so many tracks, or with all there are where there is too little to be seen."""
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
