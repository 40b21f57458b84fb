"""Parsed trajectory file (TUM, EuRoC, KITTI, CSV, npz, bag topic): poses, and what the file leaves open.

Left open are the unit of the stamps, the order of the quaternion components, and the stamps of KITTI files.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from ...estimators.estimate import Landmarks
from ...observations import IntArray
from ...time_unit import TimeUnit
from ...trajectory import Trajectory
from ..stamps.file_stamps import Stamps, no_unit
from .columns import Order
from .pose_covariances import pose_covariances
from .quaternion_order import xyzw

STRAIGHT = 1e-3
"""share of the extent of a path: a path whose deviation from a straight line is smaller does not bend"""


@dataclass(frozen=True, eq=False, slots=True)
class ParsedTrajectory:
    """Content of a trajectory file with n poses, and what it leaves open."""

    name: str
    source: str
    """the file it came from"""
    position: FloatArray
    """(n, 3) m"""
    rotation: FloatArray | None
    """(n, 3, 3) `world_R_body`, quaternions read in the first of `orders`; None where there are positions only"""
    line: IntArray | None = None
    """(n,) line of the file that each pose is from"""
    quaternion: FloatArray | None = None
    """(n, 4) quaternion components in the order of the file"""
    orders: tuple[Order, ...] = ("xyzw",)
    """possible orders of the quaternion components, the usual one first; only one if the file defines it"""
    stamps: Stamps | None = None
    """time stamps of the poses; None for a file without"""
    units: tuple[TimeUnit, ...] = (TimeUnit.S,)
    """possible units of the stamps, the likeliest first; empty if their rate is no recorder's in any unit"""
    unit_known: bool = True
    """whether header or size of the stamps show their unit"""
    frame: IntArray | None = None
    """(n,) frame number of each pose, for a file with such numbers in place of stamps"""
    covariance_numbers: FloatArray | None = None
    """(n, 12), (n, 36) as written in text, or (n, 6, 6) of the right perturbation"""
    up: FloatArray | None = None
    """(3,) unit vector that points up in the world of the poses, if a comment or the format defines it"""
    up_stated: bool = False
    """whether a comment of the file states `up`"""
    landmarks: Landmarks | None = None
    """landmarks in the world of the poses, if the source has them"""
    remarks: tuple[str, ...] = ()
    """remarks on the detection: each completes a sentence that begins with the file name"""

    def trajectory(
        self,
        unit: TimeUnit | None = None,
        order: Order | None = None,
        times: Sequence[FloatArray] = (),
        *,
        oriented: bool = True,
    ) -> Trajectory:
        """Trajectory for a unit of the stamps and an order of the quaternion components, by default the likeliest.

        Poses without stamps take the first of `times` that has a stamp for each of them; without `times`, t is the
        frame number. `oriented` False leaves the orientations out. Raises InputError where no times fit.
        """
        t, stamped = self._seconds(unit or (self.units[0] if self.units else TimeUnit.S), times)
        rotation = self.rotation_in(order or self.orders[0]) if oriented else None
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, 3] = self.position
        if rotation is not None:
            poses[:, :3, :3] = rotation
        return Trajectory(t, poses, self.name, self.source, self.line, stamped, oriented=rotation is not None)

    def rotation_in(self, order: Order) -> FloatArray | None:
        """Rotations (n, 3, 3) for quaternion components in this order."""
        if order == self.orders[0] or self.quaternion is None or self.rotation is None:
            return self.rotation
        return so3.rotation_from_quaternion(xyzw(self.quaternion, order))

    def covariance(self, order: Order | None = None) -> FloatArray | None:
        """Covariances (n, 6, 6) of the right perturbation [v, w] of each pose, m and rad; None for a file without."""
        rotation = self.rotation_in(order or self.orders[0])
        if self.covariance_numbers is None or rotation is None:
            return None
        return pose_covariances(self.covariance_numbers, rotation)

    @property
    def orientation_is_constant(self) -> bool:
        """Whether all poses have the same orientation, as files of positions in a format for poses do."""
        R = self.rotation
        return R is not None and len(R) > 1 and bool(np.abs(R - R[0]).max() < 1e-12)

    @property
    def has_positions_only(self) -> bool:
        """Whether there are no orientations, or one throughout although the path bends."""
        return self.rotation is None or (self.orientation_is_constant and bends(self.position))

    def _seconds(self, unit: TimeUnit, times: Sequence[FloatArray]) -> tuple[FloatArray, bool]:
        if self.stamps is not None:
            return self.stamps.seconds(unit), True
        frame = np.arange(len(self.position)) if self.frame is None else self.frame
        if not len(times):
            return frame.astype(np.float64), False
        if self.frame is not None:
            fitting = [t for t in times if len(t) > frame[-1] and frame[0] >= 0]
        else:
            fitting = [t for t in times if len(t) == len(frame)]
        if not fitting:
            counts = " or ".join(f"{len(t):,}" for t in times)
            last = f" to {frame[-1]}" if self.frame is not None else ""
            raise InputError(
                f"{self.source}: it has {len(frame):,} poses{last} but there are {counts} time stamps, and without a "
                "number on each line pose k is that of frame k; give --times for each file, one stamp for each pose"
            )
        return fitting[0][frame], True


def bends(position: FloatArray) -> bool:
    """Whether a path (n, 3) leaves a straight line by more than STRAIGHT of its extent."""
    if len(position) < 3:
        return False
    extent = np.linalg.svd(position - position.mean(axis=0), compute_uv=False)
    return bool(extent[1] > STRAIGHT * extent[0])


def unit_and_order(file: ParsedTrajectory, unit: TimeUnit | None, order: Order | None) -> tuple[TimeUnit, Order]:
    """Unit and quaternion order of a file: its own, else the given ones, else the likeliest.

    Raises InputError where several units are possible, and seconds are not among them.
    """
    if unit is None and TimeUnit.S not in file.units and len(file.units) != 1:
        raise InputError(unit_ambiguity(file))
    chosen = file.units[0] if unit is None or file.unit_known else unit
    return chosen, (file.orders[0] if order is None or len(file.orders) == 1 else order)


def unit_ambiguity(file: ParsedTrajectory, units: Sequence[TimeUnit] | None = None) -> str:
    """Error message for stamps with several possible units, or none that fits a recorder."""
    assert file.stamps is not None
    possible = file.units if units is None else units
    if not possible:
        return f"{file.source}: {no_unit(file.stamps)}; write seconds"
    names = " or ".join(unit.noun for unit in possible)
    return (
        f"{file.source}: its time stamps, {file.stamps.interval:.3g} apart, may be in {names}; give --time-unit "
        f"{' or '.join(possible)}"
    )
