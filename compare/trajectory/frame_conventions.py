"""Frame conventions of orientations: quaternion order, JPL or Hamilton, body frame, inverse poses."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.formats.trajectories.quaternion_order import CLEARLY, NOTICED, STEP, fits_clearly_better
from fgbaseline.geometry import FloatArray, se3, so3

from ..statistics.descriptive import rms_norm
from .alignment import Align, align
from .association import MatchedTrajectories

LEAST_ROTATION = 5.0
"""deg; smaller rotations between bodies are ignored"""
ITERATIONS = 20
LENGTH_UNITS = {1e3: "mm", 1e2: "cm"}
"""number per meter -> unit of length that positions may be in by mistake"""
SAME_SCALE = 0.05
"""largest relative difference between a scale and that of a unit, which drift may cause"""
MIN_PAIRS = 10
"""smallest number of pose pairs for the detection of a convention"""


@dataclass(frozen=True, eq=False, slots=True)
class BodyRotation:
    """Constant rotation between the body frames of reference and estimate."""

    rotation: FloatArray
    """(3, 3) `estimate_R_reference`"""
    residual_deg: float
    """median angle of the remaining orientation differences, deg"""

    @property
    def angle_deg(self) -> float:
        """Angle of the rotation, deg."""
        return float(np.rad2deg(so3.rotation_angle(self.rotation)))

    @property
    def axis(self) -> FloatArray:
        """Unit axis (3,) of the rotation, equal in both bodies."""
        w = so3.log_so3(self.rotation)
        return np.asarray(w / max(float(np.linalg.norm(w)), np.finfo(np.float64).tiny))

    @property
    def is_significant(self) -> bool:
        """Whether the rotation exceeds LEAST_ROTATION and is CLEARLY above its residual."""
        return self.angle_deg > LEAST_ROTATION and CLEARLY * self.residual_deg <= self.angle_deg


def world_rotation_from_positions(matched: MatchedTrajectories) -> FloatArray | None:
    """Rotation of the worlds `reference_R_estimate` (3, 3) from paired positions; None where it is undetermined.

    It is undetermined for a nearly straight path, whose second extent is below CLEARLY times the RMSE of the aligned
    positions, and for fewer than MIN_PAIRS pairs.
    """
    return _world_rotation(matched.estimate.world_T_body, matched.reference.world_T_body)


def _world_rotation(estimate: FloatArray, reference: FloatArray) -> FloatArray | None:
    if len(reference) < MIN_PAIRS:
        return None
    motion = align(estimate, reference, Align.SIM3)
    rmse = rms_norm(motion.apply(estimate)[:, :3, 3] - reference[:, :3, 3])
    spread = np.linalg.svd(reference[:, :3, 3] - reference[:, :3, 3].mean(axis=0), compute_uv=False)
    return None if motion.free or spread[1] / np.sqrt(len(reference)) < CLEARLY * rmse else motion.rotation


def world_rotation_from_orientations(reference: FloatArray, estimate: FloatArray) -> FloatArray:
    """Rotation of the worlds `reference_R_estimate` (3, 3) from the relative rotations of (n, 3, 3) over STEP poses."""
    k = min(STEP, len(reference) - 1)
    turned = [so3.log_so3(R[k:] @ np.swapaxes(R[:-k], 1, 2)) for R in (reference, estimate)]
    return so3.nearest_rotations(turned[0].T @ turned[1])


def rotation_misfit(reference: FloatArray, estimate: FloatArray, world: FloatArray) -> float:
    """Median angle, deg, between the relative rotations of (n, 3, 3) over STEP poses, expressed in the world.

    `world` (3, 3) is `reference_R_estimate`. Invariant to a constant rotation between the bodies.
    """
    k = min(STEP, len(reference) - 1)
    turned = [R[k:] @ np.swapaxes(R[:-k], 1, 2) for R in (reference, world @ estimate)]
    return float(np.rad2deg(np.median(so3.rotation_angle(np.swapaxes(turned[0], 1, 2) @ turned[1]))))


def least_rotation_misfit(matched: MatchedTrajectories) -> float:
    """Least `rotation_misfit`, deg, of the estimate as it is, of its inverse poses, and of its transposed orientations.

    If the estimate fits as it is, the others are not tried. The worlds are aligned by the positions. Where these do not
    determine the rotation, inverse or transposed poses are not tried, and the estimate is aligned by its orientations.
    """
    R_ref, poses = matched.reference.rotation, matched.estimate.world_T_body
    R = poses[:, :3, :3]
    world = world_rotation_from_positions(matched)
    misfit = rotation_misfit(R_ref, R, world_rotation_from_orientations(R_ref, R) if world is None else world)
    if misfit <= NOTICED:
        return misfit
    inverse = se3.inverse(poses)
    others = (
        (np.swapaxes(R, 1, 2), world),
        (inverse[:, :3, :3], _world_rotation(inverse, matched.reference.world_T_body)),
    )
    return min([misfit, *(rotation_misfit(R_ref, other, W) for other, W in others if W is not None)])


def travel_direction_misfit(position: FloatArray, rotation: FloatArray) -> float:
    """Median angle, deg, between the direction of travel in the body frame and its median direction along the path.

    `position` is (n, 3), m, and `rotation` world_R_body (n, 3, 3). NaN with fewer than MIN_PAIRS moving steps.
    """
    steps = np.einsum("tji,tj->ti", rotation[:-1], np.diff(position, axis=0))
    length = np.linalg.norm(steps, axis=1)
    if len(length) < MIN_PAIRS:
        return float("nan")
    moving = length > 0.1 * np.percentile(length, 90)
    if moving.sum() < MIN_PAIRS:
        return float("nan")
    direction = steps[moving] / length[moving, None]
    usual = np.median(direction, axis=0)
    usual = usual / max(float(np.linalg.norm(usual)), np.finfo(np.float64).tiny)
    return float(np.rad2deg(np.median(np.arccos(np.clip(direction @ usual, -1.0, 1.0)))))


def body_rotation(matched: MatchedTrajectories) -> BodyRotation | None:
    """Constant rotation between the bodies, by hand-eye calibration over the paired orientations.

    Minimizes the sum of |W R_est B - R_ref|^2 over rotations W of the world, initialized from the positions, and B of
    the body, alternately in closed form. None where the positions do not determine W.
    """
    world = world_rotation_from_positions(matched)
    if world is None:
        return None
    return _hand_eye(matched.reference.rotation, matched.estimate.rotation, world)


def has_conjugated_orientations(matched: MatchedTrajectories) -> bool:
    """Whether the transposed orientations of the estimate fit clearly better: JPL's quaternions read as Hamilton's."""
    world = world_rotation_from_positions(matched)
    if world is None:
        return False
    R_ref, R = matched.reference.rotation, matched.estimate.rotation
    return fits_clearly_better(rotation_misfit(R_ref, np.swapaxes(R, 1, 2), world), rotation_misfit(R_ref, R, world))


def rmse_of_inverse_poses(matched: MatchedTrajectories) -> tuple[float, float]:
    """RMSE of positions, m, of the estimate and of its inverse poses, each after SE(3) alignment."""
    reference = matched.reference.world_T_body

    def rmse(poses: FloatArray) -> float:
        return rms_norm(align(poses, reference, Align.SE3).apply(poses)[:, :3, 3] - reference[:, :3, 3])

    poses = matched.estimate.world_T_body
    return rmse(poses), rmse(se3.inverse(poses))


def length_unit(matched: MatchedTrajectories) -> tuple[str, float] | None:
    """Unit of the positions of one trajectory while the other is in meters, and the ratio of estimate to reference.

    The ratio is above 1 where the estimate has the larger numbers. None where it is not that of a unit, as for most
    monocular estimates.
    """
    if len(matched) < MIN_PAIRS:
        return None
    found = align(matched.estimate.world_T_body, matched.reference.world_T_body, Align.SIM3)
    if not found.scale > 0.0:
        return None
    for per_meter, name in LENGTH_UNITS.items():
        for scale in (per_meter, 1.0 / per_meter):
            if abs(found.scale * scale - 1.0) < SAME_SCALE:
                return name, 1.0 / found.scale
    return None


def _hand_eye(reference: FloatArray, estimate: FloatArray, world: FloatArray) -> BodyRotation:
    n = len(estimate)
    moments = (estimate.reshape(n, 9).T @ reference.reshape(n, 9)).reshape(3, 3, 3, 3)  # all sums over the poses
    W, B = world, np.eye(3)
    for _ in range(ITERATIONS):
        B = so3.nearest_rotations(np.einsum("jikl,kj->il", moments, W))
        W = so3.nearest_rotations(np.einsum("lkij,kj->il", moments, B))
    left = np.swapaxes(reference, 1, 2) @ (W @ estimate @ B)
    return BodyRotation(B, float(np.rad2deg(np.median(so3.rotation_angle(left)))))
