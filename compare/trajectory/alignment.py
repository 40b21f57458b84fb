"""Alignment of an estimate to a reference in closed form: first pose, yaw, SE(3), Sim(3) (Umeyama, 1991)."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.data.display import Displayed
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FgbaselineError, FloatArray, InputError

from .wahba import solve_wahba, solve_wahba_about_axis


class Align(StrEnum):
    """Group of transformations by which an estimate is aligned."""

    NONE = "none"
    FIRST_POSE = "first-pose"
    """the transformation that maps the first pose of the estimate to that of the reference"""
    YAW = "yaw"
    """rotation about the vertical and translation, the unobservable directions of visual-inertial estimation"""
    SE3 = "se3"
    SIM3 = "sim3"
    """scale as well, for a monocular camera"""


_CAPTIONS = {
    Align.NONE: "not aligned",
    Align.FIRST_POSE: "aligned at the first pose",
    Align.YAW: "yaw and position aligned",
    Align.SE3: "SE(3)-aligned",
    Align.SIM3: "Sim(3)-aligned",
}
EVERY_ROTATION = "every rotation"
SCALE = "scale"
YAW = "yaw"


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Alignment(Displayed):
    """Transformation p -> scale * rotation @ p + translation, and the pairs that determine it."""

    kind: Align = Align.NONE
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """(3, 3) `reference_R_estimate`"""
    translation: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,) m"""
    scale: float = 1.0
    """length of the reference over that of the estimate; 1 unless `kind` is SIM3"""
    n: int = 0
    """number of pose pairs used"""
    available: int = 0
    """number of pose pairs available"""
    free: tuple[str, ...] = ()
    """parameters that the positions do not determine: then the rotation is from the orientations, and the scale is 1"""

    @property
    def matrix(self) -> FloatArray:
        """Transformation (4, 4) `reference_T_estimate`; its upper left block is scale * rotation."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.scale * self.rotation, self.translation
        return T

    def apply(self, poses: FloatArray) -> FloatArray:
        """Transformed copies of poses (n, 4, 4): positions scaled, rotated and translated, orientations rotated."""
        if self.kind is Align.NONE:
            return poses.copy()
        moved = np.empty_like(poses)
        moved[:, 3] = poses[:, 3]
        moved[:, :3, :3] = self.rotation @ poses[:, :3, :3]
        moved[:, :3, 3] = self.scale * (poses[:, :3, 3] @ self.rotation.T) + self.translation
        return moved

    @property
    def method(self) -> str:
        """Kind of the alignment in words: 'SE(3)-aligned'."""
        return _CAPTIONS[self.kind]

    @property
    def caption(self) -> str:
        """Alignment for a table's caption: 'SE(3)-aligned over all 120 poses'."""
        text = self.method
        if self.kind in (Align.YAW, Align.SE3, Align.SIM3):
            poses = plural(self.n, "pose")
            first = "the first pose" if self.n == 1 else f"the first {poses}"
            text += f" over {f'all {poses}' if self.n == self.available else first}"
        if self.kind is Align.SIM3:
            text += f" (scale {self.scale:.6g})"
        if self.free:
            text += f"; not determined by the positions: {' and '.join(self.free)}"
        return text


def align(
    estimate: FloatArray,
    reference: FloatArray,
    kind: Align | str,
    *,
    first: int | None = None,
    up: ArrayLike = (0.0, 0.0, 1.0),
) -> Alignment:
    """Alignment of poses `estimate` (n, 4, 4) to the paired poses `reference` (n, 4, 4), in m, by a group `kind`.

    It minimizes the squared position differences over the `first` pairs (default: all) in closed form, without
    reflections (Umeyama, 1991; for yaw Zhang and Scaramuzza, 2018). `up` (3,) points up in the reference's world; only
    yaw uses it.

    Positions in one point, on a line or in a plane may not determine the rotation. Of the rotations with equal cost,
    the one that brings the orientations nearest to the reference's is taken, whatever the world frames are.

    Raises InputError for an unknown kind or a `first` outside 1 to n, and FgbaselineError without pairs.
    """
    try:
        kind = Align(kind)
    except ValueError as error:
        known = ", ".join(Align)
        raise InputError(f"alignment: {str(kind)!r} is not a kind of alignment; choose one of {known}") from error
    if len(estimate) == 0 or estimate.shape != reference.shape:
        raise FgbaselineError(f"alignment needs paired poses, got {estimate.shape} and {reference.shape}")
    n = len(estimate)
    if first is not None and not 1 <= first <= n:
        raise InputError(f"alignment over the first {first} pose pairs: expected a number from 1 to {n}")
    if kind is Align.NONE:
        return Alignment(n=0, available=n)
    used = 1 if kind is Align.FIRST_POSE else (first or n)
    source, target = estimate[:used], reference[:used]

    def orientation_moment() -> FloatArray:
        return _side_by_side(target) @ _side_by_side(source).T

    if kind is Align.FIRST_POSE:
        R = orientation_moment()
        return Alignment(kind, R, target[0, :3, 3] - R @ source[0, :3, 3], 1.0, 1, n)
    return _fitted(source[:, :3, 3], target[:, :3, 3], orientation_moment, kind, np.asarray(up, dtype=np.float64), n)


def _side_by_side(poses: FloatArray) -> FloatArray:
    """Rotations of poses (n, 4, 4) side by side (3, 3n), so that A @ B.T is the sum of R_a R_b^T."""
    return poses[:, :3, :3].transpose(1, 0, 2).reshape(3, -1)


def _fitted(
    source: FloatArray,
    target: FloatArray,
    orientation_moment: Callable[[], FloatArray],
    kind: Align,
    up: FloatArray,
    n: int,
) -> Alignment:
    """Least-squares alignment of positions `source` (m, 3) to `target` (m, 3), m of n available pairs.

    `orientation_moment` gives the sum of R_target R_source^T, for a rotation that the positions do not determine.
    """
    source, target = np.ascontiguousarray(source), np.ascontiguousarray(target)
    center, goal = source.mean(axis=0), target.mean(axis=0)
    x, y = source - center, target - goal
    M = y.T @ x
    # Bound of the rounding error of M: positions far from the origin keep fewer digits.
    rounding = 8 * np.finfo(np.float64).eps * (np.abs(source).max() + np.abs(target).max()) * len(x)
    floor = rounding * max(float(np.abs(x).max()), float(np.abs(y).max())) + np.finfo(np.float64).tiny
    free: tuple[str, ...]
    if kind is Align.YAW:
        R, yaw_is_free = solve_wahba_about_axis(up / np.linalg.norm(up), M, orientation_moment, floor)
        free = (YAW,) if yaw_is_free else ()
    else:
        R, axis = solve_wahba(M, orientation_moment, floor)
        free = _free_rotation(axis)
    scale, along, spread = 1.0, float(np.sum(R * M)), float(np.sum(x**2))
    if kind is Align.SIM3 and min(along, spread) > floor:
        scale = along / spread
    elif kind is Align.SIM3:
        free = (*free, SCALE)
    return Alignment(kind, R, goal - scale * R @ center, scale, len(x), n, free)


def _free_rotation(axis: FloatArray | None) -> tuple[str, ...]:
    if axis is None:
        return ()
    if not axis.any():
        return (EVERY_ROTATION,)
    return (f"the rotation about ({axis[0]:.3f}, {axis[1]:.3f}, {axis[2]:.3f})",)


def align_se3(positions: FloatArray, reference: FloatArray) -> FloatArray:
    """SE(3) alignment `reference_T_estimate` (4, 4) of paired positions (n, 3), m, in the least-squares sense.

    Without orientations, the smallest of the rotations with equal cost is taken where the positions do not determine
    it. Raises FgbaselineError without pairs and for positions that are not finite.
    """
    if len(positions) == 0 or positions.shape != reference.shape:
        raise FgbaselineError(f"alignment needs paired positions, got {positions.shape} and {reference.shape}")
    if not (np.isfinite(positions).all() and np.isfinite(reference).all()):
        raise FgbaselineError("alignment needs finite positions")
    up = np.array([0.0, 0.0, 1.0])
    return _fitted(positions, reference, lambda: np.eye(3), Align.SE3, up, len(positions)).matrix
