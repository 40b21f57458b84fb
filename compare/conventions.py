"""Whether the orientations of an estimate follow another convention than the reference's: order, body, inverse."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.formats.quaternion_order import CLEARLY, STEP, fits_clearly_better
from fgbaseline.geometry import FloatArray, se3, so3

from .alignment import Align, align
from .association import Matched

LEAST_ROTATION = 5.0
"""deg; two bodies that differ by less are taken for one"""
ROUNDS = 20
FEWEST = 10
"""pairs of poses, below which nothing is recognized"""


@dataclass(frozen=True, eq=False, slots=True)
class BodyRotation:
    """The constant rotation from the reference's body to the estimate's."""

    rotation: FloatArray
    """(3, 3) `estimate_R_reference`"""
    residual_deg: float
    """deg; the median angle that the paired orientations differ by besides it"""

    @property
    def angle_deg(self) -> float:
        """The angle, deg."""
        return float(np.rad2deg(so3.rotation_angle(self.rotation)))

    @property
    def axis(self) -> FloatArray:
        """(3,) the unit axis, the same in both bodies."""
        w = so3.log_so3(self.rotation)
        return np.asarray(w / max(float(np.linalg.norm(w)), np.finfo(np.float64).tiny))


def world_rotation(matched: Matched) -> FloatArray | None:
    """(3, 3) `reference_R_estimate` of the worlds by the paired positions; None where they leave it open.

    They do where the path hardly leaves a line: by less than CLEARLY times what the aligned positions differ by.
    """
    if len(matched) < FEWEST:
        return None
    estimate, reference = matched.estimate.world_T_body, matched.reference.world_T_body
    motion = align(estimate, reference, Align.SIM3)
    rmse = _rms(motion.apply(estimate)[:, :3, 3] - reference[:, :3, 3])
    spread = np.linalg.svd(reference[:, :3, 3] - reference[:, :3, 3].mean(axis=0), compute_uv=False)
    return None if motion.free or spread[1] / np.sqrt(len(matched)) < CLEARLY * rmse else motion.rotation


def turning_rotation(reference: FloatArray, estimate: FloatArray) -> FloatArray:
    """(3, 3) `reference_R_estimate` of the worlds by what paired rotations (n, 3, 3) turn about over STEP poses."""
    k = min(STEP, len(reference) - 1)
    turned = [so3.log_so3(R[k:] @ np.swapaxes(R[:-k], 1, 2)) for R in (reference, estimate)]
    return _nearest(turned[0].T @ turned[1])


def turning_misfit(reference: FloatArray, estimate: FloatArray, world: FloatArray) -> float:
    """The median angle, deg, by which rotations (n, 3, 3) over STEP poses differ, each about axes in the world.

    `world` (3, 3) is `reference_R_estimate`. A constant rotation between the bodies does not count.
    """
    k = min(STEP, len(reference) - 1)
    turned = [R[k:] @ np.swapaxes(R[:-k], 1, 2) for R in (reference, world @ estimate)]
    return float(np.rad2deg(np.median(so3.rotation_angle(np.swapaxes(turned[0], 1, 2) @ turned[1]))))


def travel_misfit(position: FloatArray, rotation: FloatArray) -> float:
    """The median angle, deg, by which a path (n, 3) travels in another direction of its body (n, 3, 3) than usual."""
    steps = np.einsum("tji,tj->ti", rotation[:-1], np.diff(position, axis=0))
    length = np.linalg.norm(steps, axis=1)
    moving = length > 0.1 * np.percentile(length, 90)
    if moving.sum() < FEWEST:
        return float("nan")
    direction = steps[moving] / length[moving, None]
    usual = np.median(direction, axis=0)
    usual = usual / max(float(np.linalg.norm(usual)), np.finfo(np.float64).tiny)
    return float(np.rad2deg(np.median(np.arccos(np.clip(direction @ usual, -1.0, 1.0)))))


def body_rotation(matched: Matched) -> BodyRotation | None:
    """The constant rotation between the bodies, by hand-eye calibration over the paired orientations.

    Minimizes the sum of |W R_est B - R_ref|^2 over rotations W of the world, from where the positions have it, and B of
    the body, each in closed form in turn. None where the positions leave W open.
    """
    world = world_rotation(matched)
    if world is None:
        return None
    return _hand_eye(matched.reference.rotation, matched.estimate.rotation, world)


def is_constant(found: BodyRotation) -> bool:
    """Whether a rotation between the bodies is large, and explains the orientations."""
    return found.angle_deg > LEAST_ROTATION and CLEARLY * found.residual_deg <= found.angle_deg


def are_conjugated(matched: Matched) -> bool:
    """Whether the transposed orientations of the estimate fit clearly better: JPL's quaternions read as Hamilton's."""
    world = world_rotation(matched)
    if world is None:
        return False
    R_ref, R = matched.reference.rotation, matched.estimate.rotation
    return fits_clearly_better(turning_misfit(R_ref, np.swapaxes(R, 1, 2), world), turning_misfit(R_ref, R, world))


def rmse_of_inverses(matched: Matched) -> tuple[float, float]:
    """RMSE of the positions, m, after SE(3) alignment: of the estimate, and of its inverted poses."""
    reference = matched.reference.world_T_body

    def rmse(poses: FloatArray) -> float:
        return _rms(align(poses, reference, Align.SE3).apply(poses)[:, :3, 3] - reference[:, :3, 3])

    poses = matched.estimate.world_T_body
    return rmse(poses), rmse(se3.inverse(poses))


def _rms(apart: FloatArray) -> float:
    """The root mean square length of vectors (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def _hand_eye(reference: FloatArray, estimate: FloatArray, world: FloatArray) -> BodyRotation:
    W, B = world, np.eye(3)
    for _ in range(ROUNDS):
        B = _nearest(np.einsum("tji,jk,tkl->il", estimate, W.T, reference))
        W = _nearest(np.einsum("tij,jk,tlk->il", reference, B.T, estimate))
    left = np.swapaxes(reference, 1, 2) @ (W @ estimate @ B)
    return BodyRotation(B, float(np.rad2deg(np.median(so3.rotation_angle(left)))))


def _nearest(matrix: FloatArray) -> FloatArray:
    """The rotation (3, 3) nearest to a matrix (3, 3)."""
    U, _, Vt = np.linalg.svd(matrix)
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)
