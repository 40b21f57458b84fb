"""Consistency of the covariances that an estimate reports: its errors against the truth, and their NEES."""

from dataclasses import dataclass

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import Align, Association, CovarianceState, MatchedTrajectories
from fgbaseline.compare.overconfidence import overconfidence_bound
from fgbaseline.compare.statistics.descriptive import without_nan
from fgbaseline.compare.trajectory_comparison.inputs import Entry
from fgbaseline.data import Estimate, Truth
from fgbaseline.data.display import Displayed
from fgbaseline.geometry import FloatArray, InputError

SINCE_FIRST = "both since the first pose"
ALIGNED = "the alignment removes a part of the errors"


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ReportedCovariance(Displayed):
    """Errors of n poses and the covariances that the estimate reports for them."""

    error: FloatArray
    """(n, 6) see `compare.body_error`"""
    covariance: FloatArray
    """(n, 6, 6)"""
    nees: FloatArray
    """(n,) see `compare.nees`; NaN where the covariance is held at zero, or is not positive definite"""
    not_positive_definite: int
    """number of covariances that are not positive definite"""
    remark: str = ""
    """remark on changes of errors and covariances by the alignment"""

    @property
    def known(self) -> FloatArray:
        """NEES (m,) of the poses that have one."""
        return without_nan(self.nees)

    @property
    def is_overconfident(self) -> bool:
        """Whether the mean NEES exceeds the bound of a single pose; False where no pose has a NEES."""
        return len(self.known) > 0 and bool(np.mean(self.known) > overconfidence_bound())


def reported_covariance(reference: Entry, entry: Entry, matched: MatchedTrajectories) -> ReportedCovariance:
    """Errors and NEES of each pair of poses, with the reference as the truth.

    Without an alignment errors and covariances are used unchanged. With one, they are those of the motion since the
    first pose, where the covariances are of that kind (see `compare.covariance_since_first`): then the result does not
    depend on the alignment. Other covariances are used unchanged with the aligned errors. A scale applies to the
    covariances too.

    Raises InputError without covariances, for interpolated poses, and for a run's reference, which shares its data.
    """
    if entry.covariance is None:
        raise InputError("no covariances came with it")
    if matched.association is not Association.NEAREST:
        raise InputError("poses were interpolated, covariances cannot be; ask for --association nearest")
    if reference.trust is not None:
        raise InputError("the reference shares its data with the estimate: compare with the truth for this")
    chosen = np.searchsorted((entry.trajectory.t + matched.offset), matched.estimate.t)
    poses, truth = matched.estimate.world_T_body, matched.reference.world_T_body
    covariance, remark = compare.scaled_covariance(entry.covariance[chosen], matched.alignment.scale), ""
    if matched.alignment.kind is not Align.NONE:
        motions, remark = compare.covariance_since_first(poses, covariance), ALIGNED
        if motions is not None:
            poses = compare.align(poses, truth, Align.FIRST_POSE).apply(poses)
            covariance, remark = motions, SINCE_FIRST
        if matched.alignment.kind is Align.SIM3:
            remark += f"; both scaled by {matched.alignment.scale:.6g}"
    estimate = Estimate(entry.name, poses, used=np.empty(0, dtype=np.bool_), covariance=covariance)
    true_path = Truth(truth, source=reference.trajectory.source)
    state = compare.covariance_state(estimate)
    return ReportedCovariance(
        error=compare.body_error(estimate, true_path),
        covariance=covariance,
        nees=compare.nees(estimate, true_path),
        not_positive_definite=int(np.sum(state == CovarianceState.NOT_POSITIVE_DEFINITE)),
        remark=remark,
    )
