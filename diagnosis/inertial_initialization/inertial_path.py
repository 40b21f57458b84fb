"""The path of a whole recording by stereo odometry and inertial samples, and the size of the odometry's errors."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, se3, strapdown

from ..odometry.stereo_odometry import Odometry
from ..robust_constants import CHI_SQUARE_MEDIAN
from .initial_state import Start, inflated, neighbors
from .least_squares import Solution, solve_least_squares
from .states import RelativePoses, States, motions_between

WINDOW = 1.0
"""s, over which errors of the odometry add up"""
MIN_WINDOWS = 5
"""windows of `WINDOW` s from which on time-correlated errors are estimated"""
ROUNDS = 2
"""alternations of path and inflation"""


@dataclass(frozen=True, eq=False, slots=True)
class InertialPath:
    """States of all T frames."""

    states: States
    inflation: float
    """factor (at least 1) on the odometry's sigmas, by the inertial samples from frame to frame or over `WINDOW` s"""
    whitened: FloatArray
    """(m,) squared whitened residuals of the m known intervals of the odometry"""

    def twist(self, sequence: Sequence) -> FloatArray:
        """Mean body velocities [v, w] (T-1, 6) of the intervals, m/s and rad/s."""
        return np.asarray(se3.log(se3.relative(self.states.pose)) / sequence.dt[:, None], dtype=np.float64)


def inertial_path(sequence: Sequence, seen: Odometry, imu: ImuIntervals, start: Start) -> InertialPath:
    """The path from an initial start; what the cameras do not show is from the inertial samples alone."""
    frames = np.arange(sequence.n_frames, dtype=np.int64)
    relative, inflation = neighbors(seen, frames), 1.0
    states = _initial(imu, frames, relative, start)
    solution: Solution | None = None
    for _ in range(ROUNDS):
        solution = solve_least_squares(states, imu, frames, inflated(relative, inflation))
        states = solution.states
        inflation = max(1.0, _factor(states, relative, 1), _factor(states, relative, _intervals(sequence)))
    assert solution is not None
    return InertialPath(states, inflation, solution.whitened)


def _intervals(sequence: Sequence) -> int:
    return max(1, round(WINDOW / float(np.median(sequence.dt))))


def _initial(imu: ImuIntervals, frames: IntArray, relative: RelativePoses, start: Start) -> States:
    """States that follow the odometry where it is known, and the inertial samples elsewhere."""
    n, known = len(frames), {int(i): motion for i, motion in zip(relative.first, relative.motion, strict=True)}
    pose, velocity = np.tile(start.pose, (n, 1, 1)), np.tile(start.state.velocity, (n, 1))
    biases = (np.tile(start.state.gyroscope_bias, (n, 1)), np.tile(start.state.accelerometer_bias, (n, 1)))
    motions = motions_between(imu, frames, np.concatenate(biases, axis=1)[:-1])
    for i in range(n - 1):
        motion = motions.between(i)
        pose[i + 1], velocity[i + 1] = strapdown.predict(pose[i], velocity[i], motion, imu.gravity_vector)
        if i in known:  # rotations of the gyroscope drift less, positions of the cameras
            gained = velocity[i + 1] - velocity[i]
            pose[i + 1, :3, 3] = (pose[i] @ known[i])[:3, 3]
            velocity[i + 1] = (pose[i + 1, :3, 3] - pose[i, :3, 3]) / motion.dt + 0.5 * gained
    return States(pose, velocity, *biases)


def _factor(states: States, relative: RelativePoses, length: int) -> float:
    """The factor on the odometry's deviations that makes the median error over `length` intervals chi-square."""
    cuts = np.flatnonzero(np.diff(relative.first) != 1) + 1
    runs = [run.tolist() for run in np.split(np.arange(len(relative.first)), cuts) if len(run)]
    place = np.array([k for run in runs for k in range(run[0], run[-1] + 2 - length, length)], dtype=np.int64)
    if len(place) < MIN_WINDOWS:
        return 1.0
    motion, covariance = np.tile(np.eye(4), (len(place), 1, 1)), np.zeros((len(place), 6, 6))
    for k in range(length):
        step = relative.motion[place + k]
        A = se3.adjoint(se3.inverse(step))
        motion = motion @ step
        covariance = A @ covariance @ np.swapaxes(A, 1, 2) + relative.covariance[place + k]
    first = relative.first[place]
    moved = se3.inverse(states.pose[first]) @ states.pose[first + length]
    error = se3.log(se3.inverse(motion) @ moved)
    squared = np.einsum("ni,ni->n", error, np.linalg.solve(covariance, error[:, :, None])[:, :, 0])
    return float(np.sqrt(np.median(squared) / CHI_SQUARE_MEDIAN[6]))
