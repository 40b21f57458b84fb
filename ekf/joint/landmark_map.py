"""Map of the joint filter: latest observation and estimate of every landmark.

The filter is causal: a landmark without an observation for some frames is marginalized. If observed again, it is
initialized as a new landmark, because the pose already contains the information of its first estimate.
"""

import numpy as np

from fgbaseline.data.estimators.estimate import Event, EventKind, Landmarks
from fgbaseline.data.observations import BoolArray, IntArray

from .landmark_representation import WorldPoints

AT_INFINITY = "its estimate was at infinity or beyond"
FULL = "the state was full while it was observed"
NOT_INITIALIZED = "no accepted frame observed it"


class LandmarkMap:
    """Bookkeeping and marginalized estimates of m landmarks."""

    def __init__(self, m: int) -> None:
        self.last_seen: IntArray = np.full(m, -1, dtype=np.int64)
        """(m,) frame of the latest observation; -1 before the first"""
        self.initialized: BoolArray = np.zeros(m, dtype=np.bool_)
        """(m,) mask of landmarks that have been in the state"""
        self.deferred: BoolArray = np.zeros(m, dtype=np.bool_)
        """(m,) mask of landmarks with observations that were not used because the state was full"""
        self._position = np.full((m, 3), np.nan)
        self._covariance = np.full((m, 3, 3), np.nan)
        self._variance = np.full(m, np.inf)
        """(m,) m^2, the trace of the covariance"""

    def store(self, row: IntArray, points: WorldPoints) -> None:
        """Store landmarks `row` (n,) as they are marginalized.

        Of a landmark initialized several times, the estimate with the smallest position variance is reported. Its
        estimates are correlated and are not fused.
        """
        variance = np.einsum("nii->n", points.covariance)
        finite = points.in_front & np.isfinite(points.position).all(axis=1) & np.isfinite(variance)
        better = finite & (variance < self._variance[row])
        at = row[better]
        self._position[at], self._covariance[at] = points.position[better], points.covariance[better]
        self._variance[at] = variance[better]

    def landmarks(self, features: IntArray) -> Landmarks:
        """Landmarks with a finite position, indexed by the problem's `features` (m,)."""
        known = np.isfinite(self._position).all(axis=1)
        return Landmarks(features[known], self._position[known], self._covariance[known])

    def undetermined_events(self, features: IntArray) -> list[Event]:
        """Events for the observed landmarks without a position, ordered by the frame of their last observation."""
        row = np.flatnonzero((self.last_seen >= 0) & ~np.isfinite(self._position).all(axis=1))
        row = row[np.argsort(self.last_seen[row], kind="stable")]
        why = np.select([self.initialized[row], self.deferred[row]], [AT_INFINITY, FULL], NOT_INITIALIZED)
        frames = self.last_seen[row].tolist()
        return [
            Event(k, EventKind.LANDMARK_NEVER_DETERMINED, str(reason), j)
            for k, reason, j in zip(frames, why, features[row].tolist(), strict=True)
        ]
