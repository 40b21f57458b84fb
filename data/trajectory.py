"""A path through time, from anywhere: stamps and the poses of one body in one world."""

from collections.abc import Callable
from dataclasses import InitVar, dataclass, replace

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from .observations import BoolArray, IntArray

ROTATION_TOLERANCE = 1e-6
"""how far from a rotation the nine numbers of a pose may be"""
FARTHEST = 1e12
"""m; positions beyond it have fewer digits than a millimetre needs"""
EXACT = 1e-12
"""up to here it is rounding, and they stay as they are"""


@dataclass(frozen=True, eq=False, slots=True)
class Trajectory:
    """T >= 1 poses of a body, sorted by time. Its arrays are copies of what it was given, and cannot be written to;
    rotations that are not exact are replaced by the nearest that is.

    Raises InputError, naming the pose (and the line it came from, where that is known), for stamps that do not rise or
    repeat, for poses that are not finite or farther than FARTHEST from the origin, and for rotations that are none
    (beyond ROTATION_TOLERANCE).
    """

    t: FloatArray
    """(T,) s, strictly rising; the number of the frame where `stamped` is False"""
    world_T_body: FloatArray
    """(T, 4, 4)"""
    name: str = "trajectory"
    """what tables and figures call it"""
    source: str = ""
    """the file it came from; what errors speak of"""
    line: IntArray | None = None
    """(T,) the line or row of `source` that each pose stands in, for errors"""
    stamped: bool = True
    """False where the source has no time: then nothing can be said per second"""
    oriented: bool = True
    """False where the source has positions only: then the rotations are the identity and mean nothing"""
    proven: InitVar[bool] = False
    """True leaves out the checks: for what was made of a checked trajectory"""

    def __post_init__(self, proven: bool) -> None:
        for field in ("t", "world_T_body"):
            object.__setattr__(self, field, np.array(getattr(self, field), dtype=np.float64))
        if not proven:
            _make_exact(self.world_T_body, check_trajectory(self))
        self.t.flags.writeable = self.world_T_body.flags.writeable = False

    @staticmethod
    def of_frames(t: FloatArray, world_T_body: FloatArray, name: str, source: str = "") -> "Trajectory":
        """The frames of t (n,) that have a pose: those of `world_T_body` (n, 4, 4) that are all NaN are left out.

        That is how estimates that failed on the way, and truths with gaps, mark frames without one.
        """
        known = ~np.isnan(np.asarray(world_T_body)).all(axis=(1, 2))
        return Trajectory(np.asarray(t)[known], np.asarray(world_T_body)[known], name, source)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def position(self) -> FloatArray:
        """(T, 3) m in the world."""
        return self.world_T_body[:, :3, 3]

    @property
    def rotation(self) -> FloatArray:
        """(T, 3, 3) `world_R_body`."""
        return self.world_T_body[:, :3, :3]

    def at(self, index: IntArray) -> "Trajectory":
        """The poses of these strictly rising indices (n,)."""
        if len(index) == len(self):
            return self
        line = None if self.line is None else self.line[index]
        return replace(self, t=self.t[index], world_T_body=self.world_T_body[index], line=line, proven=len(index) > 0)

    def with_poses(self, world_T_body: FloatArray) -> "Trajectory":
        """The same stamps with other poses (T, 4, 4)."""
        return replace(self, world_T_body=world_T_body)

    def later(self, seconds: float) -> "Trajectory":
        """The same poses, every stamp `seconds` later."""
        return replace(self, t=self.t + seconds)


def check_trajectory(path: Trajectory) -> FloatArray:
    """(T,) how far each pose is from a rigid motion, at most ROTATION_TOLERANCE.

    Raises InputError, naming pose and line, where a trajectory is not one that can be compared.
    """
    t, poses = path.t, path.world_T_body
    who = path.source or path.name
    if t.ndim != 1 or poses.shape != (len(t), 4, 4):
        raise InputError(f"{who}: expected stamps (T,) and poses (T, 4, 4), got {t.shape} and {poses.shape}")
    if len(t) == 0:
        raise InputError(f"{who}: a trajectory needs at least one pose, this one has none")
    _require(np.isfinite(t), path, lambda i: f"its time stamp is {float(t[i])!r}; remove it or give it a time")
    rising = np.concatenate([[True], np.diff(t) > 0])
    _require(
        rising,
        path,
        lambda i: (
            f"its time stamp {float(t[i])!r} "
            + ("repeats that of" if t[i] == t[i - 1] else f"is before {float(t[i - 1])!r} of")
            + f" {_place(path, i - 1)}; sort the poses by time and remove repeated ones"
        ),
    )
    finite = np.asarray(np.isfinite(poses).all(axis=(1, 2)), dtype=np.bool_)
    _require(finite, path, lambda _: "it is not finite; leave out what is not known")
    _require(
        np.asarray((np.abs(poses[:, :3, 3]) <= FARTHEST).all(axis=1), dtype=np.bool_),
        path,
        lambda i: (
            f"its position {poses[i, :3, 3].tolist()} is beyond {FARTHEST:g} m; give metres, of a path that holds"
        ),
    )
    with np.errstate(over="ignore", invalid="ignore"):
        last_row = [np.abs(poses[:, 3, i] - float(i == 3)) for i in range(4)]
        defect = np.maximum.reduce([so3.orthogonality_error(poses[:, :3, :3]), *last_row])
    _require(
        defect <= ROTATION_TOLERANCE,
        path,
        lambda i: (
            f"its upper left 3x3 is no rotation, or its last row not 0 0 0 1 (off by {defect[i]:.3g}, allowed "
            f"{ROTATION_TOLERANCE:g}); write rigid motions"
        ),
    )
    return np.asarray(defect)


def _make_exact(poses: FloatArray, defect: FloatArray) -> None:
    """Writes the nearest rigid motions over poses (T, 4, 4) that are off by more than rounding, by `defect` (T,)."""
    off = np.flatnonzero(defect > EXACT)
    R = poses[off, :3, :3]
    for _ in range(2):  # Newton's method for the polar factor: each step squares what is left
        R = 0.5 * R @ (3.0 * np.eye(3) - np.swapaxes(R, 1, 2) @ R)
    poses[off, :3, :3], poses[off, 3] = R, [0.0, 0.0, 0.0, 1.0]


def _require(good: BoolArray, path: Trajectory, complaint: Callable[[int], str]) -> None:
    if not good.all():
        i = int(np.argmin(good))
        raise InputError(f"{path.source or path.name}: {_place(path, i)}: {complaint(i)}")


def _place(path: Trajectory, i: int) -> str:
    return f"pose {i}" if path.line is None else f"line {path.line[i]}"
