"""Correction of the joint state, and the transform B of its covariance in the invariant EKF."""

import numpy as np

from fgbaseline.geometry import FloatArray, se3, so3

from ..motion_model import POSE
from .monocular.unknown_depths import UnknownDepths
from .settings import Linearization
from .state import JointState
from .unobservable_directions import transform_columns


def correct(state: JointState, delta: FloatArray, linearization: Linearization, depths: UnknownDepths | None) -> None:
    """Apply the correction delta (size,) to the state, and for `Linearization.INVARIANT` P <- B P B^T.

    B = I + (N+ - N-) A (`unobservable_directions`), with N- before and N+ after the correction, and A = Ad(T-) on the
    pose's columns. The rows of a landmark in N are its `motion_jacobian`. While the depth of a landmark is unknown, its
    rows have the translation of its anchor in place of the pose's (`unknown_depths`).
    """
    before, anchored = state.body, None if depths is None else depths.anchored(state)
    state.body = before.corrected(delta[: state.n_body])
    by = delta[state.n_body :].reshape(-1, 3)
    if linearization is not Linearization.INVARIANT:
        state.xi[:] += by
        return
    change = state.correct_landmarks(by)
    columns = change @ se3.adjoint(before.pose)
    if anchored is not None:  # a rigid motion [v, w] moves an anchor at p by v + w x p
        own = change[anchored.slot]
        by_turn = own[:, :, 3:] + own[:, :, :3] @ so3.hat3(anchored.position)
        columns[anchored.slot] = np.concatenate([np.zeros_like(by_turn), by_turn @ before.pose[:3, :3]], axis=2)
        state.transform_by_points(anchored.slot, anchored.anchor, own[:, :, :3])
    body = transform_columns(before, state.body, delta[: state.n_body])
    state.transform_covariance(np.concatenate([body, columns.reshape(-1, POSE)]))
