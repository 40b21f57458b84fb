"""Whether the covariances that came with an estimate tell the truth about its errors."""

from dataclasses import dataclass

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import Align, Association, CovarianceState, Matched
from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, InputError

from .entry import Entry


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


def claimed_by(reference: Entry, entry: Entry, matched: Matched) -> Claimed:
    """What each pair says against a reference that is taken for the truth.

    Raises InputError, saying why, where it would not mean anything: without covariances, after an alignment (which
    would hide errors), between interpolated poses, and against a run's reference, which shares its data.
    """
    if entry.covariance is None:
        raise InputError("no covariances came with it")
    if matched.alignment.kind is not Align.NONE:
        raise InputError(f"it was {matched.alignment.caption}, which hides errors; ask for --align none")
    if matched.association is not Association.NEAREST:
        raise InputError("poses were interpolated, covariances cannot be; ask for --association nearest")
    if reference.trust is not None:
        raise InputError("the reference shares its data with the estimate: compare with the truth for this")
    chosen = np.searchsorted((entry.trajectory.t + matched.offset), matched.estimate.t)
    estimate = Estimate(
        name=entry.name,
        world_T_imu=matched.estimate.world_T_body,
        used=np.empty(0, dtype=np.bool_),
        covariance=entry.covariance[chosen],
    )
    truth = Truth(matched.reference.world_T_body, source=reference.trajectory.source)
    state = compare.covariance_state(estimate)
    return Claimed(
        error=compare.body_error(estimate, truth),
        covariance=entry.covariance[chosen],
        nees=compare.nees(estimate, truth),
        not_positive_definite=int(np.sum(state == CovarianceState.NOT_POSITIVE_DEFINITE)),
    )
