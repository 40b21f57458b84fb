"""Observations of active landmarks, linearized at the joint state."""

from typing import NamedTuple, Self

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import Camera, FloatArray
from fgbaseline.geometry.linearization import predict

from .landmark_representation import homogeneous
from .settings import Linearization
from .state import JointState
from .update import StackedJacobian


class LinearizedObservations(NamedTuple):
    """Linearized observations of n active landmarks."""

    observed: IntArray
    """(n,) indices into the problem's observations"""
    H: StackedJacobian
    residual: FloatArray
    """(n, r) innovations in the rows of the measurement model, px"""
    cosine: FloatArray
    """(n,) cosines of the angle between optical axis and ray"""

    def select(self, chosen: BoolArray) -> Self:
        """Those of the mask `chosen` (n,)."""
        return type(self)(self.observed[chosen], self.H.select(chosen), self.residual[chosen], self.cosine[chosen])


def linearize(
    state: JointState,
    camera: Camera,
    cam_T_imu: FloatArray,
    linearization: Linearization,
    slot: IntArray,
    observed: IntArray,
    measured: FloatArray,
) -> LinearizedObservations:
    """Linearize observations `observed` (n,), rows `measured` (n, r), px, of the landmarks in `slot` (n,).

    Residuals are at the latest estimate; Jacobians are at the first one for `Linearization.FIRST_ESTIMATE`.
    """
    charts = state.charts[slot]
    linearized = latest = predict(camera, cam_T_imu, state.pose, homogeneous(charts, state.xi[slot]))
    if linearization is Linearization.FIRST_ESTIMATE:
        first = homogeneous(charts, state.first_estimate[slot])
        linearized = predict(camera, cam_T_imu, state.predicted.pose, first)
    H_point = linearized.point_jacobian() @ charts[:, :, :3]
    H = StackedJacobian(slot, linearized.pose_jacobian(), H_point, state.n_body)
    cosine = np.minimum(latest.cosine, linearized.cosine)
    return LinearizedObservations(observed, H, measured - latest.pixel, cosine)
