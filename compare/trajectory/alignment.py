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
    """rotation about up and translation, the unobservable directions of visual-inertial estimation"""
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
    n: int = 0
    """number of pose pairs used"""
    of: int = 0
    """number of pose pairs available"""
    free: tuple[str, ...] = ()
    """undetermined parameters of the positions alone: orientations determine such a rotation; such a scale is 1"""

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
            text += f" over {'all' if self.n == self.of else 'the first'} {plural(self.n, 'pose')}"
        if self.kind is Align.SIM3:
            text += f" (scale {self.scale:.6g})"
        if self.free:
            text += f"; their positions leave {' and '.join(self.free)} open"
        return text


def align(
    estimate: FloatArray,
    reference: FloatArray,
    kind: Align | str,
    *,
    first: int | None = None,
    up: ArrayLike = (0.0, 0.0, 1.0),
) -> Alignment:
    """Transformation of this kind that aligns paired positions of poses (n, 4, 4) to the reference's (n, 4, 4).

    Least squares in closed form (Umeyama, 1991; for yaw Zhang and Scaramuzza, 2018), never a reflection, over the
    `first` pairs or all; m. `up` (3,) points up in the reference's world, for yaw.

    Positions on a line, in one point or in a plane may leave a rotation undetermined. Of the equally good ones, that
    whose orientations are nearest to the reference's is taken, in whatever frame the trajectories are given.

    Raises InputError for an unknown kind or a `first` that is not between 1 and n, and FgbaselineError without pairs.
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
        raise InputError(f"alignment: there are {n} pairs of poses, the first {first} cannot be taken")
    if kind is Align.NONE:
        return Alignment(n=0, of=n)
    used = 1 if kind is Align.FIRST_POSE else (first or n)
    source, target = estimate[:used], reference[:used]

    def orientation_moment() -> FloatArray:
        return _side_by_side(target) @ _side_by_side(source).T

    if kind is Align.FIRST_POSE:
        R = orientation_moment()
        return Alignment(kind, R, target[0, :3, 3] - R @ source[0, :3, 3], 1.0, 1, n)
    return _fitted(source[:, :3, 3], target[:, :3, 3], orientation_moment, kind, np.asarray(up, dtype=np.float64), n)


def _side_by_side(poses: FloatArray) -> FloatArray:
    """Rotations of poses (n, 4, 4) side by side (3, 3n): for two of these, A @ B.T is the sum of R_a R_b^T."""
    return poses[:, :3, :3].transpose(1, 0, 2).reshape(3, -1)


def _fitted(
    source: FloatArray,
    target: FloatArray,
    orientation_moment: Callable[[], FloatArray],
    kind: Align,
    up: FloatArray,
    n: int,
) -> Alignment:
    """Least-squares alignment of positions `source` (m, 3) to `target` (m, 3), of n available pairs.

    `orientation_moment` gives the sum of R_target R_source^T, which decides where positions do not.
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

    As `align`, but without orientations: undetermined directions take the smallest of the equally good rotations.
    Raises FgbaselineError for no pairs or NaN.
    """
    if len(positions) == 0 or positions.shape != reference.shape:
        raise FgbaselineError(f"alignment needs paired positions, got {positions.shape} and {reference.shape}")
    if not (np.isfinite(positions).all() and np.isfinite(reference).all()):
        raise FgbaselineError("alignment needs finite positions")
    up = np.array([0.0, 0.0, 1.0])
    return _fitted(positions, reference, lambda: np.eye(3), Align.SE3, up, len(positions)).matrix
