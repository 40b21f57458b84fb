"""The start of an inertial problem: attitude, velocity and biases at frame 0 with their covariance.

Estimators use the frames of the start again, so that they count twice. It is therefore from a short stretch, whose
weight is small beside that of the frames that follow.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem.inertial import ImuIntervals, InertialStart
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, so3, strapdown

from ..odometry.stereo_odometry import Odometry
from .least_squares import Solution, solve_least_squares
from .linear_alignment import aligned
from .states import RelativePoses, States
from .stationary import keyframes_of, standing_frames, stands
from .structureless_factors import keyframe_tracks

WINDOW = 0.5
"""s of a start in motion"""
MIN_INTERVALS = 5
MIN_KNOWN = 3
"""intervals of it whose motion the cameras show"""
NO_POSES = RelativePoses(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 4, 4)), np.zeros((0, 6, 6)))


class Start(NamedTuple):
    """Pose of frame 0 and the rest of its state."""

    pose: FloatArray
    """(4, 4) world_T_imu: z of the world points up"""
    state: InertialStart
    standing: float
    """s that the vehicle stands at the beginning, 0.0 for a start in motion"""


def inertial_start(sequence: Sequence, seen: Odometry, imu: ImuIntervals, pixel: float) -> Start | None:
    """The start, at `pixel` px of noise; None where the cameras show too little of the motion."""
    frames = standing_frames(sequence)
    standing = float(sequence.t[frames[-1]] - sequence.t[0]) if stands(sequence, frames) else 0.0
    keyframes = keyframes_of(frames) if standing else _window(sequence)
    if standing:
        initial = standing_states(imu, keyframes)
        source = f"standing start of {standing:.2f} s, in which the cameras see no motion"
    else:
        relative = neighbors(seen, keyframes)
        if len(relative.first) < MIN_KNOWN:
            return None
        initial = aligned(imu, keyframes, relative)
        span = float(sequence.t[keyframes[-1]] - sequence.t[0])
        source = f"tracks and inertial samples of the first {span:.2f} s, from linear alignment"
    tracks = keyframe_tracks(sequence, seen, keyframes, pixel)
    return start_of(solve_least_squares(initial, imu, keyframes, NO_POSES, tracks), source, standing)


def inflated(relative: RelativePoses, factor: float) -> RelativePoses:
    """The relative poses with deviations multiplied."""
    return replace(relative, covariance=relative.covariance * factor**2)


def neighbors(seen: Odometry, frames: IntArray) -> RelativePoses:
    """The odometry between consecutive frames as relative poses of keyframes; `frames` (n,) have no gaps."""
    known = np.flatnonzero(seen.known[frames[:-1]])
    at = frames[known]
    return RelativePoses(known, known + 1, seen.motion[at], seen.covariance[at])


def _window(sequence: Sequence) -> IntArray:
    last = int(np.searchsorted(sequence.t, sequence.t[0] + WINDOW, side="right"))
    return np.arange(min(max(last, MIN_INTERVALS + 1), sequence.n_frames), dtype=np.int64)


def standing_states(imu: ImuIntervals, frames: IntArray) -> States:
    """All keyframes at rest: up is the mean specific force, the bias of the gyroscope its mean."""
    n, at = len(frames), slice(int(imu.starts[frames[0]]), int(imu.starts[frames[-1]]))
    share = imu.dt[at] / imu.dt[at].sum()
    pose = np.tile(np.eye(4), (n, 1, 1))
    pose[:, :3, :3] = so3.rotation_to_z(share @ imu.specific_force[at])
    none = np.zeros((n, 3))
    return States(pose, none, np.tile(share @ imu.angular_velocity[at], (n, 1)), none)


def start_of(solution: Solution, source: str, standing: float) -> Start:
    """First state of a solution, in the world whose heading makes its rotation smallest and whose z axis points up."""
    first = solution.states.pose[0]
    turn = np.eye(4)
    turn[:3, :3] = so3.rotation_to_z(first[2, :3]) @ first[:3, :3].T
    states = solution.states.moved(turn)
    R = turn[:3, :3]
    state = InertialStart(
        states.velocity[0],
        states.gyroscope_bias[0],
        states.accelerometer_bias[0],
        strapdown.rotated_velocity(solution.covariance, R, R),
        source,
    )
    return Start(states.pose[0], state, standing)
