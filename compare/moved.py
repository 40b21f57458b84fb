"""Tracks whose residuals say that the point moved."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, StereoCamera, se3

from .chi_square import probability_beyond
from .whitened import judged

MIN_SIGHTS = 4
"""of a track: a point and a velocity are six numbers"""
SIGNIFICANCE = 0.01
"""probability that even one of all the tracks is called moving by chance"""
EXPLAINED = 0.5
"""share of the squared residuals that the motion must explain: it is not enough that they are large"""
ITERATIONS = 8
"""of Gauss-Newton; a step that raises a track's cost is refused and shortened"""
SETTLED, NEARLY = 1e-16, 1e-6
"""of a track's cost: once no more than that is to be gained it is left alone, the latter where it cannot have moved"""
OPEN = 1e-9
"""share of the largest eigenvalue of a track's scaled normal equations, below which a direction is left open"""


@dataclass(frozen=True, eq=False, slots=True)
class _Sights:
    """n sights of m points."""

    camera: StereoCamera
    cam_T_world: FloatArray
    """(n, 4, 4)"""
    row: IntArray
    """(n,) the point, 0 to m - 1"""
    pixel: FloatArray
    """(n, 4)"""
    seconds: FloatArray
    """(n,) since the middle of the track's sights"""
    variance: float

    def of(self, points: IntArray, m: int) -> "_Sights":
        """Those of some of the m points, which are numbered anew in their order."""
        number = np.full(m, -1)
        number[points] = np.arange(len(points))
        kept = np.flatnonzero(number[self.row] >= 0)
        return _Sights(
            self.camera,
            self.cam_T_world[kept],
            number[self.row[kept]],
            self.pixel[kept],
            self.seconds[kept],
            self.variance,
        )


def moved_points(problem: Problem, estimate: Estimate, table: pd.DataFrame) -> pd.DataFrame:
    """One row per `landmark` of a reprojection table with enough judged sights in front of the camera:

    `n`, `squared` (whitened squared residuals of the point that stands where it fits best), `gain`, by how much these
    shrink when the point may move in a straight line at constant speed, `speed` in m/s, and `moved`: the gain is beyond
    what chi-square with 3 degrees of freedom gives one of all the tracks by chance, and explains half of the residuals.
    A track that slides over its point, and a path that errs, look the same: what all paths call moving, moved.
    """
    rows = judged(problem, table)
    rows = rows[(rows["depth"] > 0) & np.isfinite(rows["error"])]
    rows = rows[rows.groupby("landmark")["frame"].transform("size") >= MIN_SIGHTS]
    landmark, row = np.unique(rows["landmark"].to_numpy(), return_inverse=True)
    n = len(landmark)
    sights = _sights(problem, estimate, rows, row)
    start = estimate.landmarks.position[np.searchsorted(estimate.landmarks.index, landmark)]
    standing, squared = _fitted(sights, start, np.full(n, SETTLED))
    settled = np.where(_significant(squared), SETTLED, NEARLY)  # no more can be gained than there is
    moving, left = _fitted(sights, np.concatenate([standing, np.zeros((n, 3))], axis=1), settled)
    gain = squared - left
    return pd.DataFrame(
        {
            "landmark": landmark,
            "n": np.bincount(row, minlength=n),
            "squared": squared,
            "gain": gain,
            "speed": np.linalg.norm(moving[:, 3:], axis=1),
            "moved": _significant(gain) & (gain > EXPLAINED * squared),
        }
    )


def _significant(gain: FloatArray) -> BoolArray:
    """(m,) whether a velocity gains more than it would give one of all m tracks by chance."""
    return np.asarray(probability_beyond(gain, 3.0) < SIGNIFICANCE / max(len(gain), 1))


def _sights(problem: Problem, estimate: Estimate, rows: pd.DataFrame, row: IntArray) -> _Sights:
    sequence, frame = problem.sequence, rows["frame"].to_numpy()
    count = np.maximum(np.bincount(row), 1)
    seconds = sequence.t[frame] - sequence.t[0]
    return _Sights(
        sequence.camera,
        se3.inverse((estimate.world_T_imu @ sequence.imu_T_cam)[frame]),
        row,
        sequence.observations.pixel[rows["observation"].to_numpy()],
        seconds - (np.bincount(row, weights=seconds) / count)[row],
        problem.pixel_variance,
    )


def _fitted(sights: _Sights, start: FloatArray, settled: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (m, 3), or positions and velocities (m, 6), that fit best, and the whitened squared residuals (m,).

    `settled` (m,) is the share of a track's cost that is too little to go on for.
    """
    m = len(start)
    state, scale, unsettled = start.copy(), np.ones(m), np.arange(m)
    cost, normal, gradient = _linearised(sights, state)
    for _ in range(ITERATIONS):
        step = _step(normal[unsettled], gradient[unsettled])
        promised = np.einsum("md,md->m", gradient[unsettled], step)
        going = np.isinf(cost[unsettled]) | (promised > settled[unsettled] * (1.0 + cost[unsettled]))
        unsettled, step = unsettled[going], step[going]
        if len(unsettled) == 0:
            break
        trial = state[unsettled] + scale[unsettled, None] * step
        new_cost, new_normal, new_gradient = _linearised(sights.of(unsettled, m), trial)
        better = new_cost <= cost[unsettled]
        at = unsettled[better]
        state[at], cost[at] = trial[better], new_cost[better]
        normal[at], gradient[at] = new_normal[better], new_gradient[better]
        scale[unsettled] = np.where(better, 1.0, 0.25 * scale[unsettled])
    return state, cost


def _linearised(sights: _Sights, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cost (m,), infinite behind a camera, and normal equations (m, d, d), (m, d)."""
    row, s, n, moves = sights.row, sights.seconds, len(state), state.shape[1] > 3
    points = state[row, :3] + (s[:, None] * state[row, 3:] if moves else 0.0)
    p_cam = se3.transform(sights.cam_T_world, points)
    front = p_cam[:, 2] > 0.0
    p_cam[~front] = [0.0, 0.0, 1.0]
    residual = sights.pixel - sights.camera.project(p_cam)
    H = sights.camera.jacobian(p_cam) @ sights.cam_T_world[:, :3, :3]
    Ht = np.swapaxes(H, 1, 2) / sights.variance
    squared = np.where(front, np.sum(residual**2, axis=1) / sights.variance, np.inf)
    information, pull = Ht @ H, (Ht @ residual[:, :, None])[:, :, 0]
    cost, normal, gradient = (_summed(values, row, n) for values in (squared, information, pull))
    if not moves:
        return cost, normal, gradient
    mixed, velocity = (_summed(s[:, None, None] ** power * information, row, n) for power in (1, 2))
    gradient = np.concatenate([gradient, _summed(s[:, None] * pull, row, n)], axis=1)
    return cost, np.block([[normal, mixed], [mixed, velocity]]), gradient


def _step(normal: FloatArray, gradient: FloatArray) -> FloatArray:
    """(m, d) that solves the normal equations, scaled to a unit diagonal; not along what the sights leave open."""
    scale = np.sqrt(np.maximum(np.einsum("mii->mi", normal), np.finfo(np.float64).tiny))
    unit, right = normal / (scale[:, :, None] * scale[:, None, :]), gradient / scale
    d = right.shape[1]
    # Eigenvalues with the sum d: if the others are as large as they can be, the smallest is the determinant over e.
    regular = np.linalg.det(unit) > math.e * d * OPEN
    step = np.empty_like(right)
    step[regular] = np.linalg.solve(unit[regular], right[regular][:, :, None])[:, :, 0]
    inverse = np.linalg.pinv(unit[~regular], rcond=OPEN, hermitian=True)
    step[~regular] = (inverse @ right[~regular][:, :, None])[:, :, 0]
    return np.asarray(step / scale)


def _summed(values: FloatArray, row: IntArray, n: int) -> FloatArray:
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    sums = np.empty((n, flat.shape[1]))
    for i, column in enumerate(flat.T):
        sums[:, i] = np.bincount(row, weights=column, minlength=n)
    return sums.reshape(n, *values.shape[1:])
