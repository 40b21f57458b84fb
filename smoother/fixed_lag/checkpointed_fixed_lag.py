"""A fixed-lag smoother that can go back: after an exception GTSAM leaves it destroyed, and it cannot be copied."""

from collections.abc import Collection, Mapping
from typing import NamedTuple, SupportsFloat, SupportsIndex, SupportsInt

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray

from ..errors import GivenUpError, IndeterminateSystemError, named_variable
from ..graph.gauss_newton import compact
from ..graph.keys import landmark_of
from ..graph.marginal_covariances import covariances
from ..isam2.settings import ISAM2Settings

LOOSE = 2e3
"""baselines; keeps a landmark determined that marginals still speak of, but no observation"""


CAREFUL_UPDATES = 30
"""by QR after a failure, before Cholesky is tried again: it is three times faster"""


class Snapshot(NamedTuple):
    """All that a smoother knows: one that is built from it is equal to it, to rounding."""

    factors: gtsam.NonlinearFactorGraph
    """marginals among them: linear, at the linearisation point, which GTSAM keeps fixed for them; with empty slots"""
    linearization_point: gtsam.Values
    times: dict[int, float]

    def covariances(self, keys: Collection[int]) -> dict[int, FloatArray]:
        """The covariance of some variables, by their keys: all others are eliminated first."""
        if len(keys) == len(self.times):
            return covariances(self.factors, self.linearization_point)
        marginal = self.factors.linearize(self.linearization_point).marginal(list(keys))
        ordering, widths = gtsam.Ordering(), []
        for key in keys:
            ordering.push_back(key)
            widths.append(6 if landmark_of(key) is None else 3)
        joint: FloatArray = np.linalg.inv(marginal.hessian(ordering)[0]).astype(np.float64)
        ends = np.cumsum(widths)
        return {key: joint[end - w : end, end - w : end] for key, end, w in zip(keys, ends, widths, strict=True)}


class RestorableLag:
    """`gtsam.IncrementalFixedLagSmoother` with updates that either succeed or change nothing.

    GTSAM's Cholesky takes pivots of very unequal size for a failure, as they come about where pixels are sharp and the
    path is long. QR does not; after an update by QR it is kept for some frames.
    """

    def __init__(self, lag: float, settings: ISAM2Settings, baseline: float) -> None:
        self._lag, self._settings, self._baseline = lag, settings, baseline
        self._careful_updates = 0
        """still to be made by QR"""
        self.smoother = self._new(careful=False)
        self.snapshot = self._taken()
        """as the last update left it"""

    def update(
        self,
        factors: gtsam.NonlinearFactorGraph,
        values: gtsam.Values,
        times: Mapping[int, float],
        forgotten: Collection[int] = (),
        *,
        careful: bool = False,
    ) -> None:
        """One update, first taking out the factors of the landmarks `forgotten` (keys).

        What has left the window since with such a landmark stays in the marginals. A `careful` update is by QR, which
        does not notice a landmark that nothing determines. Raises IndeterminateSystemError, nothing being changed,
        where GTSAM fails.
        """
        try:
            if careful:
                self._careful_updates = CAREFUL_UPDATES
            if careful or forgotten:
                snapshot = self._without(self.snapshot, forgotten) if forgotten else self.snapshot
                self.smoother = self._built(snapshot, careful=self._careful_updates > 0)
            self.smoother.update(factors, values, _plain(times))
        except (RuntimeError, IndexError) as error:
            self._restore()
            raise IndeterminateSystemError(named_variable(str(error)), str(error)) from error
        self.snapshot = self._taken()
        self._relax()

    def _restore(self) -> None:
        """Back to the snapshot, the more carefully the less it can be done."""
        held = self._loosely_held(self.snapshot, {key for key in self.snapshot.times if landmark_of(key) is not None})
        for snapshot, careful in ((self.snapshot, self._careful_updates > 0), (self.snapshot, True), (held, True)):
            try:
                self.smoother = self._built(snapshot, careful=careful)
            except RuntimeError:
                continue
            self._careful_updates = CAREFUL_UPDATES if careful else 0
            return
        raise GivenUpError("what the window knew cannot be restored after a failure")

    def _relax(self) -> None:
        """Back to Cholesky, once QR has done its updates."""
        if self._careful_updates == 1:
            self._careful_updates = 0
            self._restore()
        elif self._careful_updates > 1:
            self._careful_updates -= 1

    def _taken(self) -> Snapshot:
        # GTSAM gives references, which the next update changes.
        s = self.smoother
        return Snapshot(
            gtsam.NonlinearFactorGraph(s.getFactors()), gtsam.Values(s.getLinearizationPoint()), s.timestamps()
        )

    def _new(self, *, careful: bool) -> gtsam.IncrementalFixedLagSmoother:
        params = self._settings.params(self._baseline)
        params.findUnusedFactorSlots = True
        params.relinearizeSkip = 1  # what leaves the window has no later chance, and most of the time goes elsewhere
        if careful:
            params.setFactorization("QR")
        return gtsam.IncrementalFixedLagSmoother(self._lag, params)

    def _built(self, snapshot: Snapshot, *, careful: bool) -> gtsam.IncrementalFixedLagSmoother:
        graph, factors = gtsam.NonlinearFactorGraph(), compact(snapshot.factors)
        for i in range(factors.size()):
            factor = factors.at(i)
            if isinstance(factor, gtsam.LinearContainerFactor):
                # Nothing keeps the point fixed in the new one: the marginal must know it.
                point = snapshot.linearization_point
                factor = gtsam.LinearContainerFactor(factor.linearize(point), point)
            graph.push_back(factor)
        smoother = self._new(careful=careful)
        if snapshot.times:
            smoother.update(graph, snapshot.linearization_point, _plain(snapshot.times))
        return smoother

    def _without(self, snapshot: Snapshot, forgotten: Collection[int]) -> Snapshot:
        graph, factors, in_marginals = gtsam.NonlinearFactorGraph(), compact(snapshot.factors), set[int]()
        for i in range(factors.size()):
            factor = factors.at(i)
            if isinstance(factor, gtsam.LinearContainerFactor):
                in_marginals |= {key for key in factor.keys() if key in forgotten}  # noqa: SIM118
            elif any(key in forgotten for key in factor.keys()):  # noqa: SIM118
                continue
            graph.push_back(factor)
        times = {key: time for key, time in snapshot.times.items() if key not in forgotten or key in in_marginals}
        values = gtsam.Values()
        for key in times:
            if landmark_of(key) is None:
                values.insert(key, snapshot.linearization_point.atPose3(key))
            else:
                values.insert(key, snapshot.linearization_point.atPoint3(key))
        return self._loosely_held(Snapshot(graph, values, times), in_marginals)

    def _loosely_held(self, snapshot: Snapshot, landmarks: Collection[int]) -> Snapshot:
        graph, point = compact(snapshot.factors), snapshot.linearization_point
        loose = gtsam.noiseModel.Isotropic.Sigma(3, LOOSE * self._baseline)
        for key in landmarks:
            graph.push_back(gtsam.PriorFactorPoint3(key, point.atPoint3(key), loose))
        return snapshot._replace(factors=graph)


def _plain(times: Mapping[int, float]) -> Mapping[SupportsInt | SupportsIndex, SupportsFloat | SupportsIndex]:
    # The stubs of GTSAM ask for exactly that type.
    return {key: time for key, time in times.items()}  # noqa: C416
