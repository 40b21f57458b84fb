"""Fixed-lag smoother with checkpoints: an exception of GTSAM leaves it destroyed, and it cannot be copied."""

from collections.abc import Collection, Mapping
from typing import NamedTuple, SupportsFloat, SupportsIndex, SupportsInt

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray

from ..errors import IndeterminateSystemError, UnrecoverableError, named_variable
from ..graph.gauss_newton import compact_graph
from ..graph.keys import landmark_of, width
from ..graph.marginal_covariances import marginal_covariances
from ..isam2.settings import ISAM2Settings

LOOSE_SIGMA = 2e3
"""baselines, sigma of the prior of a landmark that is in marginals only, which keeps the system determinate"""
QR_UPDATES = 30
"""number of updates with QR after a failure, before Cholesky, which is three times faster, is tried again"""


class Checkpoint(NamedTuple):
    """State from which an equivalent smoother, up to rounding, is rebuilt."""

    factors: gtsam.NonlinearFactorGraph
    """factors including marginals, which are linear at linearization points that GTSAM keeps fixed; with empty slots"""
    linearization_point: gtsam.Values
    times: dict[int, float]

    def covariances(self, together: Collection[list[int]]) -> dict[int, FloatArray]:
        """Joint covariances of lists of variables by their first keys: all others are eliminated first."""
        keys = [key for each in together for key in each]
        if len(keys) == len(self.times):
            return marginal_covariances(self.factors, self.linearization_point, together)
        marginal = self.factors.linearize(self.linearization_point).marginal(keys)
        ordering = gtsam.Ordering()
        for key in keys:
            ordering.push_back(key)
        joint: FloatArray = np.linalg.inv(marginal.hessian(ordering)[0]).astype(np.float64)
        ends = np.cumsum([sum(map(width, each)) for each in together]).tolist()
        starts = [0, *ends]
        return {each[0]: joint[a:b, a:b] for each, a, b in zip(together, starts, ends, strict=False)}


class CheckpointedFixedLag:
    """`gtsam.IncrementalFixedLagSmoother` with atomic updates.

    GTSAM's Cholesky fails on pivots of very unequal size, which occur with precise pixels on a long path. QR does not
    fail; after an update with QR it is kept for some frames.
    """

    def __init__(self, lag: float, settings: ISAM2Settings, baseline: float) -> None:
        self._lag, self._settings, self._baseline = lag, settings, baseline
        self._qr_updates = 0
        """remaining updates with QR"""
        self.smoother = self._new(qr=False)
        self.checkpoint = self._current()
        """state after the last update"""

    def update(
        self,
        factors: gtsam.NonlinearFactorGraph,
        values: gtsam.Values,
        times: Mapping[int, float],
        forgotten: Collection[int] = (),
        *,
        qr: bool = False,
    ) -> None:
        """Update the window after removing the factors of the landmarks `forgotten` (keys).

        Observations of such landmarks that were marginalized stay in the marginals. With `qr`, undetermined landmarks
        are not detected. Raises IndeterminateSystemError, with the window unchanged, where GTSAM fails.
        """
        try:
            if qr:
                self._qr_updates = QR_UPDATES
            if qr or forgotten:
                checkpoint = self._without(self.checkpoint, forgotten) if forgotten else self.checkpoint
                self.smoother = self._rebuild(checkpoint, qr=self._qr_updates > 0)
            self.smoother.update(factors, values, _plain(times))
        except (RuntimeError, IndexError) as error:
            self._restore()
            raise IndeterminateSystemError(named_variable(str(error)), str(error)) from error
        self.checkpoint = self._current()
        self._return_to_cholesky()

    def _restore(self) -> None:
        """Rebuild the smoother from the checkpoint: unchanged, if that fails with QR, and at last with loose priors."""
        held = self._with_loose_priors(
            self.checkpoint, {key for key in self.checkpoint.times if landmark_of(key) is not None}
        )
        for checkpoint, qr in ((self.checkpoint, self._qr_updates > 0), (self.checkpoint, True), (held, True)):
            try:
                self.smoother = self._rebuild(checkpoint, qr=qr)
            except RuntimeError:
                continue
            self._qr_updates = QR_UPDATES if qr else 0
            return
        raise UnrecoverableError("the window cannot be rebuilt after GTSAM failed")

    def _return_to_cholesky(self) -> None:
        """Return to Cholesky after `QR_UPDATES` updates with QR."""
        if self._qr_updates == 1:
            self._qr_updates = 0
            self._restore()
        elif self._qr_updates > 1:
            self._qr_updates -= 1

    def _current(self) -> Checkpoint:
        # GTSAM returns references, which the next update changes.
        s = self.smoother
        return Checkpoint(
            gtsam.NonlinearFactorGraph(s.getFactors()), gtsam.Values(s.getLinearizationPoint()), s.timestamps()
        )

    def _new(self, *, qr: bool) -> gtsam.IncrementalFixedLagSmoother:
        params = self._settings.params(self._baseline)
        params.findUnusedFactorSlots = True
        params.enableRelinearization = True
        params.relinearizeSkip = 1  # marginalized variables cannot be relinearized later, and it is cheap
        if qr:
            params.setFactorization("QR")
        return gtsam.IncrementalFixedLagSmoother(self._lag, params)

    def _rebuild(self, checkpoint: Checkpoint, *, qr: bool) -> gtsam.IncrementalFixedLagSmoother:
        graph, factors = gtsam.NonlinearFactorGraph(), compact_graph(checkpoint.factors)
        for i in range(factors.size()):
            factor = factors.at(i)
            if isinstance(factor, gtsam.LinearContainerFactor):
                # The rebuilt smoother may relinearize its variables, so the marginal needs its linearization point.
                point = checkpoint.linearization_point
                factor = gtsam.LinearContainerFactor(factor.linearize(point), point)
            graph.add(factor)
        smoother = self._new(qr=qr)
        if checkpoint.times:
            smoother.update(graph, checkpoint.linearization_point, _plain(checkpoint.times))
        return smoother

    def _without(self, checkpoint: Checkpoint, forgotten: Collection[int]) -> Checkpoint:
        graph, factors, in_marginals = gtsam.NonlinearFactorGraph(), compact_graph(checkpoint.factors), set[int]()
        for i in range(factors.size()):
            factor = factors.at(i)
            if isinstance(factor, gtsam.LinearContainerFactor):
                in_marginals |= {key for key in factor.keys() if key in forgotten}  # noqa: SIM118
            elif any(key in forgotten for key in factor.keys()):  # noqa: SIM118
                continue
            graph.add(factor)
        times = {key: time for key, time in checkpoint.times.items() if key not in forgotten or key in in_marginals}
        values = gtsam.Values(checkpoint.linearization_point)
        for key in checkpoint.times.keys() - times.keys():
            values.erase(key)
        return self._with_loose_priors(Checkpoint(graph, values, times), in_marginals)

    def _with_loose_priors(self, checkpoint: Checkpoint, landmarks: Collection[int]) -> Checkpoint:
        graph, point = compact_graph(checkpoint.factors), checkpoint.linearization_point
        loose = gtsam.noiseModel.Isotropic.Sigma(3, LOOSE_SIGMA * self._baseline)
        for key in landmarks:
            graph.add(gtsam.PriorFactorPoint3(key, point.atPoint3(key), loose))
        return checkpoint._replace(factors=graph)


def _plain(times: Mapping[int, float]) -> Mapping[SupportsInt | SupportsIndex, SupportsFloat | SupportsIndex]:
    # The stubs of GTSAM ask for exactly that type.
    return {key: time for key, time in times.items()}  # noqa: C416
