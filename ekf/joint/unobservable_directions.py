"""Unobservable directions N of the body state, and the body's rows of the transform B of the invariant EKF.

A small rigid motion g = [v, w] of the world moves a pose T to exp(g) T, a right perturbation of T by Ad(T^-1) g. It
changes a velocity in world axes by w x velocity, and leaves biases unchanged. In the rows of the body therefore

    N = [Ad(T^-1); (0, -hat(velocity)); 0]    (n, 6),

and in those of a landmark N is `motion_jacobian` (`landmark_representation`). With body velocities all six columns are
unobservable. With raw inertial samples, which sense gravity, four directions are: the translations and the rotation
about the world's z axis (Hesch et al., IEEE T-RO 2014).

B maps N- before a correction delta to N+ after it. With A = [Ad(T-), 0], which acts on the pose's errors, A N- = I and
B = I + (N+ - N-) A. B differs from the identity in the pose's columns only; its pose block is Ad(T+^-1) Ad(T-) =
Ad(exp(-delta)). B uses all six columns with inertial samples as well. Four would cover the unobservable directions;
with six, P is that of the right-invariant EKF in the coordinates of this filter. Prediction and landmark observations
of the right-invariant EKF depend on the estimate through the biases only (Barrau and Bonnabel, 2015).
"""

import numpy as np

from fgbaseline.geometry import FloatArray, se3, so3, strapdown

from ..motion_model import POSE, BodyState


def transform_columns(before: BodyState, after: BodyState, delta: FloatArray) -> FloatArray:
    """The pose's columns of B in the rows of the body (n, 6); the correction `delta` (n,) takes `before` to `after`."""
    columns = np.zeros((POSE + len(before.additive), POSE))
    columns[:POSE] = se3.adjoint(se3.inverse(se3.exp_one(delta[:POSE])))
    return _with_velocity(columns, before, after)


def first_estimate_transition(
    transition: FloatArray, predicted: BodyState, updated: BodyState, after: BodyState
) -> FloatArray:
    """Transition F (n, n) for first-estimate Jacobians: it maps N at the prediction of a frame to N at the next one.

    `predicted` and `updated` are the states of the frame before and after its update, and `after` is the prediction of
    the next frame. B maps N at `predicted` to N at `updated`. `transition` (n, n), linearized at `updated`, maps that N
    to N at `after` in the unobservable directions. F is the product of the two.
    """
    if len(updated.additive) + POSE < strapdown.STATE:
        F = transition.copy()
        F[:POSE, :POSE] = se3.adjoint(se3.inverse(after.pose) @ predicted.pose)
        return F
    B = np.eye(strapdown.STATE)
    B[:POSE, :POSE] = se3.adjoint(se3.inverse(updated.pose) @ predicted.pose)
    _with_velocity(B[:, :POSE], predicted, updated)
    return np.asarray(transition @ B)


def _with_velocity(columns: FloatArray, before: BodyState, after: BodyState) -> FloatArray:
    """Fill in the velocity rows of the pose's columns (n, 6) of B if the body has a velocity; return the columns."""
    if len(columns) == strapdown.STATE:
        turned = so3.hat3(before.additive[:3] - after.additive[:3])
        columns[strapdown.VELOCITY, 3:] = turned @ before.pose[:3, :3]
    return columns
