"""One trajectory of a comparison, and what came with it."""

from dataclasses import dataclass

from fgbaseline.compare import Trust
from fgbaseline.data import Landmarks, Trajectory
from fgbaseline.geometry import FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Entry:
    """A trajectory, and what came with it."""

    trajectory: Trajectory
    landmarks: Landmarks | None = None
    """in the trajectory's own world"""
    covariance: FloatArray | None = None
    """(n, 6, 6) of the right perturbation of each pose"""
    up: FloatArray | None = None
    """(3,) what points up in its world, where the format of its file defines it"""
    remarks: tuple[str, ...] = ()
    """what was recognized in its file: each completes a sentence that begins with its name"""
    trust: Trust | None = None
    """in a run's reference; a file says nothing of it"""
    by_product: bool = False
    """whether the reference's own run gave it along: near to it by nature"""

    @property
    def name(self) -> str:
        """What tables and figures call it."""
        return self.trajectory.name
