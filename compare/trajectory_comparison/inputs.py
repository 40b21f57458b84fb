"""Inputs of a comparison: trajectories with landmarks, covariances and remarks, and the recording."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from fgbaseline.data import Trajectory
from fgbaseline.data.display import Displayed
from fgbaseline.geometry import FloatArray

if TYPE_CHECKING:
    from fgbaseline.compare import Trust
    from fgbaseline.data import HeldOut, Landmarks, Problem


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Entry(Displayed):
    """A trajectory with its landmarks, covariances and trust."""

    trajectory: Trajectory
    landmarks: "Landmarks | None" = None
    """landmarks in the world of the trajectory"""
    covariance: FloatArray | None = None
    """(n, 6, 6) of the right perturbation of each pose"""
    up: FloatArray | None = None
    """(3,) unit vector that points up in the world of the poses; None if neither file nor format defines it"""
    up_stated: bool = False
    """whether the file itself states `up`"""
    remarks: tuple[str, ...] = ()
    """remarks on the file; each completes a sentence that begins with the trajectory's name"""
    trust: "Trust | None" = None
    """trust in a run's reference; None for files"""
    by_product: bool = False
    """whether it is a by-product of the reference (isam2-online) and close to it by construction"""

    @property
    def name(self) -> str:
        """Name in tables and figures."""
        return self.trajectory.name

    def remarked(self, remark: str) -> "Entry":
        """The entry with one more remark."""
        return replace(self, remarks=(*self.remarks, remark))


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Entries(Displayed):
    """All inputs, in one body frame."""

    reference: Entry
    estimates: tuple[Entry, ...]
    problem: "Problem | None"
    """recording or problem whose observations are reprojected; None without"""
    held: "HeldOut | None"
    """held-out tracks, by which all paths are ranked"""
    up: FloatArray | None
    """(3,) up in the reference's world if that is the world of a run"""
    one_world: bool
    """whether reference and estimates share the world of a run"""
