"""Transformation of an estimate to the body frame of the reference: lever arm, extrinsic, constant rotation."""

from dataclasses import replace

import numpy as np

from fgbaseline import compare
from fgbaseline.compare.trajectory_comparison.conventions import paired
from fgbaseline.compare.trajectory_comparison.inputs import Entry
from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data import Trajectory
from fgbaseline.data.formats.trajectories.quaternion_order import fits_clearly_better
from fgbaseline.geometry import FloatArray, InputError

LEAST_MISFIT = 1e-3
"""misfit as a share of the reference's extent, up to which inverse poses are not tested"""


def moved_body(entry: Entry, body_T_other: FloatArray) -> Entry:
    """Poses of another frame of the same rigid body: world_T_body @ body_T_other (4, 4).

    Covariances are transformed by the adjoint. Raises InputError for positions without orientations.
    """
    path = entry.trajectory
    if not path.oriented:
        raise InputError(
            f"{path.source or path.name}: it has no orientations, which the change of the body frame needs; leave out "
            "the body, or swap the two files"
        )
    covariance = entry.covariance
    if covariance is not None:
        covariance = compare.covariance_of_body(covariance, body_T_other)
    return replace(entry, trajectory=path.with_poses(path.world_T_body @ body_T_other), covariance=covariance)


def with_lever_arm(entry: Entry, arm: FloatArray) -> Entry:
    """Poses of the point at `arm` (3,), m, in the body frame of an estimate."""
    body_T_point = np.eye(4)
    body_T_point[:3, 3] = arm
    shown = ", ".join(f"{x:g}" for x in arm)
    moved = moved_body(entry, body_T_point)
    return moved.remarked(f"its positions are moved by the lever arm ({shown}) m in its body frame")


def with_length_unit_recognized(reference: Trajectory, entry: Entry, settings: Settings) -> Entry:
    """Estimate, with a remark if the positions of one of the two files are not in meters."""
    if settings.align == compare.Align.SIM3:
        return entry
    matched = paired(reference, entry.trajectory, settings, oriented=False)
    found = None if matched is None else compare.length_unit(matched)
    if found is None:
        return entry
    unit, scale = found
    larger, smaller = ("its positions", f"those of {reference.name}")[:: 1 if scale > 1.0 else -1]
    return entry.remarked(
        f"{larger} are {max(scale, 1.0 / scale):,.0f} times as large as {smaller}, as in {unit} and not m: write them "
        "in m, or give --align sim3"
    )


def with_body_recognized(reference: Trajectory, entry: Entry, settings: Settings) -> Entry:
    """Estimate, with a remark on inverse poses, conjugated quaternions or a constant rotation between the bodies.

    With `align_body` the rotation is removed.
    """
    matched = paired(reference, entry.trajectory, settings)
    if matched is None or len(matched) < 2:
        return entry
    rmse, inverted = compare.rmse_of_inverse_poses(matched)
    if fits_clearly_better(inverted, rmse, least=0.0) and rmse > LEAST_MISFIT * _extent(matched.reference):
        return entry.remarked(
            f"the inverses of its poses fit {reference.name} to {inverted:.3g} m after SE(3) alignment, and they "
            f"themselves to {rmse:.3g} m: it has body_T_world (camera) poses; write their inverses",
        )
    if compare.has_conjugated_orientations(matched):
        return entry.remarked(
            "its orientations fit once transposed: its quaternions are conjugated, as in JPL's convention and in "
            "ORB-SLAM3's keyframe files; write Hamilton's, with the signs of x, y and z changed",
        )
    found = compare.body_rotation(matched)
    if found is None or not (found.is_significant or settings.align_body):
        return entry
    axis = ", ".join(f"{x:.3f}" for x in found.axis)
    rotation = (
        f"its body is turned by a constant {found.angle_deg:.1f}° about ({axis}) against that of {reference.name} "
        f"(median deviation {found.residual_deg:.3g}° over {len(matched):,} poses)"
    )
    if not settings.align_body:
        return entry.remarked(
            f"{rotation}; relative errors, drift and rotation errors include it; --align-body removes it"
        )
    estimate_T_reference = np.eye(4)
    estimate_T_reference[:3, :3] = found.rotation
    return moved_body(entry, estimate_T_reference).remarked(f"{rotation}, which is removed")


def _extent(path: Trajectory) -> float:
    return float(np.linalg.norm(np.ptp(path.position, axis=0)))
