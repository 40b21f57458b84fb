"""Trajectory from any source: time stamps and poses of one body in one world."""

from collections.abc import Callable, Mapping
from dataclasses import InitVar, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3
from fgbaseline.geometry.path_length import path_length

from .dataframes import plot_path, pose_columns, table
from .display import Displayed
from .observations import BoolArray, IntArray

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

ROTATION_TOLERANCE = 1e-6
"""largest orthogonality error of a rotation matrix in a file"""
FARTHEST = 1e12
"""m; largest distance from the origin at which positions still resolve a millimeter"""
EXACT = 1e-12
"""orthogonality error within rounding: such rotations are not changed"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Trajectory(Displayed):
    """T >= 1 poses of a body, sorted by time.

    Its arrays are read-only copies. Rotations that are not exact are replaced by the nearest rotation.

    Raises InputError, naming the pose (and its line, if known), for stamps that do not increase, poses that are not
    finite or farther than FARTHEST from the origin, and matrices that are no rotations (beyond ROTATION_TOLERANCE).
    """

    t: FloatArray
    """(T,) s, strictly increasing; the frame number if `stamped` is False"""
    world_T_body: FloatArray
    """(T, 4, 4)"""
    name: str = "trajectory"
    """name in tables and figures"""
    source: str = ""
    """file name, for error messages"""
    line: IntArray | None = None
    """(T,) line or row of each pose in `source`, for error messages"""
    stamped: bool = True
    """False if the source has no time stamps: quantities per second are then undefined"""
    oriented: bool = True
    """False if the source has positions only: the rotations are then the identity, without meaning"""
    proven: InitVar[bool] = False
    """True skips the checks, for data from a checked trajectory"""

    def __post_init__(self, proven: bool) -> None:
        for field in ("t", "world_T_body"):
            object.__setattr__(self, field, np.array(getattr(self, field), dtype=np.float64))
        if not proven:
            _make_exact(self.world_T_body, check_trajectory(self))
        self.t.flags.writeable = self.world_T_body.flags.writeable = False

    @staticmethod
    def of_frames(t: FloatArray, world_T_body: FloatArray, name: str, source: str = "") -> "Trajectory":
        """Trajectory of the frames of t (n,) that have a pose; all-NaN poses of `world_T_body` (n, 4, 4) are left out.

        Estimates that failed midway and ground truth with gaps mark missing poses by NaN.
        """
        known = ~np.isnan(np.asarray(world_T_body)).all(axis=(1, 2))
        return Trajectory(np.asarray(t)[known], np.asarray(world_T_body)[known], name, source)

    def __len__(self) -> int:
        return len(self.t)

    def _heading(self) -> str:
        return f"Trajectory {self.name}" + (f" ({self.source})" if self.source else "")

    def _facts(self) -> Mapping[str, str]:
        span = f" from {self.t[0]:.10g} to {self.t[-1]:.10g} s" if self.stamped else ", without stamps"
        return {
            "poses": f"{len(self):,}{span}" + ("" if self.oriented else ", positions only"),
            "path": f"{path_length(self.position):.1f} m",
        }

    def to_frame(self) -> "pd.DataFrame":
        """Table of t (s), x, y, z (m), qx, qy, qz, qw, with a row for each pose."""
        return table({"t": self.t, **pose_columns(self.world_T_body)}, "pose")

    def plot(self, axes: "Axes | None" = None) -> "Axes":
        """Draws the path in the two world axes along which it extends farthest, or in those of `axes`."""
        return plot_path(self.position, self.name, axes)

    @property
    def position(self) -> FloatArray:
        """Positions (T, 3) in the world, m."""
        return self.world_T_body[:, :3, 3]

    @property
    def rotation(self) -> FloatArray:
        """Rotations (T, 3, 3) `world_R_body`."""
        return self.world_T_body[:, :3, :3]

    def at(self, index: IntArray) -> "Trajectory":
        """Trajectory of the poses with these strictly increasing indices (n,)."""
        if len(index) == len(self):
            return self
        line = None if self.line is None else self.line[index]
        return replace(self, t=self.t[index], world_T_body=self.world_T_body[index], line=line, proven=len(index) > 0)

    def with_poses(self, world_T_body: FloatArray) -> "Trajectory":
        """Trajectory with the same stamps and other poses (T, 4, 4)."""
        return replace(self, world_T_body=world_T_body)

    def later(self, seconds: float) -> "Trajectory":
        """Trajectory with all stamps shifted by `seconds`."""
        return replace(self, t=self.t + seconds)


def check_trajectory(path: Trajectory) -> FloatArray:
    """Orthogonality errors (T,) of the poses, at most ROTATION_TOLERANCE.

    Raises InputError, naming pose and line, where a trajectory is not comparable.
    """
    t, poses = path.t, path.world_T_body
    name = path.source or path.name
    if t.ndim != 1 or poses.shape != (len(t), 4, 4):
        raise InputError(f"{name}: expected stamps (T,) and poses (T, 4, 4), got {t.shape} and {poses.shape}")
    if len(t) == 0:
        raise InputError(f"{name}: a trajectory needs at least one pose, this one has none")
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
        lambda i: f"its position {poses[i, :3, 3].tolist()} is beyond {FARTHEST:g} m; write positions in m",
    )
    with np.errstate(over="ignore", invalid="ignore"):
        last_row = [np.abs(poses[:, 3, i] - float(i == 3)) for i in range(4)]
        defect = np.maximum.reduce([so3.orthogonality_error(poses[:, :3, :3]), *last_row])
    _require(
        defect <= ROTATION_TOLERANCE,
        path,
        lambda i: (
            f"its upper left 3x3 is not a rotation, or its last row not 0 0 0 1 (off by {defect[i]:.3g}, allowed "
            f"{ROTATION_TOLERANCE:g}); write rigid motions"
        ),
    )
    return np.asarray(defect)


def _make_exact(poses: FloatArray, defect: FloatArray) -> None:
    """Replaces poses (T, 4, 4) by the nearest rigid motions where their `defect` (T,) exceeds rounding."""
    off = np.flatnonzero(defect > EXACT)
    R = poses[off, :3, :3]
    for _ in range(2):  # Newton's method for the polar factor converges quadratically
        R = 0.5 * R @ (3.0 * np.eye(3) - np.swapaxes(R, 1, 2) @ R)
    poses[off, :3, :3], poses[off, 3] = R, [0.0, 0.0, 0.0, 1.0]


def _require(good: BoolArray, path: Trajectory, complaint: Callable[[int], str]) -> None:
    if not good.all():
        i = int(np.argmin(good))
        raise InputError(f"{path.source or path.name}: {_place(path, i)}: {complaint(i)}")


def _place(path: Trajectory, i: int) -> str:
    return f"pose {i}" if path.line is None else f"line {path.line[i]}"
