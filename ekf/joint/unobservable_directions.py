"""Unobservable directions of the body state, and the columns of the invariant transform that belong to them.

A rigid motion g = [v, w] of the world takes a pose T to exp(g) T, which is its right perturbation Ad(T^-1) g. It turns
a velocity in world axes by w x velocity and leaves biases as they are. So the body has the rows

    N = [Ad(T^-1); (0, -hat(velocity)); 0],

and landmarks have `motion_jacobian`. With body velocities all six columns are unobservable. Raw inertial samples sense
gravity: the translations and the rotation about the world's z axis are unobservable (Hesch et al., IEEE T-RO 2014).

The invariant transform takes N before an update to N after it. With A = Ad(T-) on the pose's columns, A N- = I, and
B = I + (N+ - N-) A differs from the identity in the pose's columns only; its pose block is Ad(T+^-1) Ad(T-) =
Ad(exp(-delta)). With inertial samples B has all six columns as well: four would do for the unobservable directions, but
with six P has its meaning in the coordinates of the right-invariant filter, whose prediction and observations of
landmarks do not depend on the estimate but for the biases (Barrau and Bonnabel, 2015).
"""

import numpy as np

from fgbaseline.geometry import FloatArray, se3, so3, strapdown

from ..motion_model import POSE, BodyState


def transform_columns(before: BodyState, after: BodyState, delta: FloatArray) -> FloatArray:
    """Columns (n, 6) of the pose in B, in the rows of the body; `delta` (n,) takes `before` to `after`."""
    columns = np.zeros((POSE + len(before.additive), POSE))
    columns[:POSE] = se3.adjoint(se3.inverse(se3.exp_one(delta[:POSE])))
    return _with_velocity(columns, before, after)


def first_estimate_transition(
    transition: FloatArray, predicted: BodyState, updated: BodyState, after: BodyState
) -> FloatArray:
    """Transition F (n, n) that takes N at one prediction to N at the next, `after`, for first-estimate Jacobians.

    `transition` takes N at the `updated` state to N at `after`, in the directions that are unobservable. B takes N at
    the prediction of that frame, `predicted`, to N at the `updated` state. F is their product.
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
    """The pose's columns of B, with the rows of the velocity where the body has one."""
    if len(columns) == strapdown.STATE:
        turned = so3.hat3(before.additive[:3] - after.additive[:3])
        columns[strapdown.VELOCITY, 3:] = turned @ before.pose[:3, :3]
    return columns
