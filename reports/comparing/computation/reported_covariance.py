"""Whether the covariances that came with an estimate tell the truth about its errors."""

from dataclasses import dataclass

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import Align, Association, CovarianceState, Matched
from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, InputError

from .entry import Entry

SINCE_FIRST = "both since the first pose"
ALIGNED = "the alignment takes out a part of the errors"


@dataclass(frozen=True, eq=False, slots=True)
class Claimed:
    """The errors of n poses beside the covariances that came with them."""

    error: FloatArray
    """(n, 6) see `compare.body_error`"""
    covariance: FloatArray
    """(n, 6, 6)"""
    nees: FloatArray
    """(n,) see `compare.nees`; NaN where the covariance is held at zero, or is none"""
    not_positive_definite: int
    """how many of them are no covariances"""
    remark: str = ""
    """what an alignment means for errors and covariances"""


def claimed_by(reference: Entry, entry: Entry, matched: Matched) -> Claimed:
    """What each pair says against a reference that is taken for the truth.

    Without an alignment both are as they came. With one, errors and covariances are those of the motion since the
    first pose, where the covariances are of that kind (see `compare.since_first`): then it does not matter which
    alignment it is. Other covariances are taken as they are beside the aligned errors. An alignment with a scale
    scales the covariances.

    Raises InputError, saying why, where it would not mean anything: without covariances, between interpolated poses,
    and against a run's reference, which shares its data.
    """
    if entry.covariance is None:
        raise InputError("no covariances came with it")
    if matched.association is not Association.NEAREST:
        raise InputError("poses were interpolated, covariances cannot be; ask for --association nearest")
    if reference.trust is not None:
        raise InputError("the reference shares its data with the estimate: compare with the truth for this")
    chosen = np.searchsorted((entry.trajectory.t + matched.offset), matched.estimate.t)
    poses, truth = matched.estimate.world_T_body, matched.reference.world_T_body
    covariance, remark = compare.scaled(entry.covariance[chosen], matched.alignment.scale), ""
    if matched.alignment.kind is not Align.NONE:
        motions, remark = compare.since_first(poses, covariance), ALIGNED
        if motions is not None:
            poses = compare.align(poses, truth, Align.FIRST_POSE).apply(poses)
            covariance, remark = motions, SINCE_FIRST
        if matched.alignment.kind is Align.SIM3:
            remark += f"; both scaled by {matched.alignment.scale:.6g}"
    estimate = Estimate(entry.name, poses, used=np.empty(0, dtype=np.bool_), covariance=covariance)
    true_path = Truth(truth, source=reference.trajectory.source)
    state = compare.covariance_state(estimate)
    return Claimed(
        error=compare.body_error(estimate, true_path),
        covariance=covariance,
        nees=compare.nees(estimate, true_path),
        not_positive_definite=int(np.sum(state == CovarianceState.NOT_POSITIVE_DEFINITE)),
        remark=remark,
    )
