"""Tracks whose residuals say that the point moved."""

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, StereoMeasurement, se3
from fgbaseline.geometry.measurement import measured_rows

from ..residuals.whitening import judged
from ..statistics.chi_square import probability_beyond

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
SYMMETRIC, PULL = [0, 1, 2, 4, 5, 7], [3, 6, 8]
"""where the upper triangle (3, 3), row by row, and the gradient stand among rows that each end with their gradient"""
SQUARE = np.array([[0, 1, 2], [1, 4, 5], [2, 5, 7]])
OF_SYMMETRIC = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
"""and the whole of the symmetric matrix, in that and in the upper triangle alone"""


class _Sights(NamedTuple):
    """n sights of m points, sorted by point; every point has one. Each coordinate is in an array of its own: stacks of
    small matrices take several times as long."""

    measurement: StereoMeasurement
    turn: FloatArray
    """(3, 3, n) the rotation of cam_T_world"""
    shift: FloatArray
    """(3, n) m, its translation"""
    row: IntArray
    """(n,) the point, 0 to m - 1, rising"""
    measured: FloatArray
    """(3, n) uL, uR and v, px"""
    seconds: FloatArray
    """(n,) since the middle of the track's sights"""

    def of(self, points: IntArray, m: int) -> "_Sights":
        """Those of some of the m points, given in rising order, which are numbered anew."""
        number = np.full(m, -1)
        number[points] = np.arange(len(points))
        row = number[self.row]
        kept = np.flatnonzero(row >= 0)
        return _Sights(
            self.measurement,
            self.turn[:, :, kept],
            self.shift[:, kept],
            row[kept],
            self.measured[:, kept],
            self.seconds[kept],
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
    sequence, order = problem.sequence, np.argsort(row, kind="stable")
    row, frame = row[order], rows["frame"].to_numpy()[order]
    count = np.maximum(np.bincount(row), 1)
    seconds = sequence.t[frame] - sequence.t[0]
    cam_T_world = np.moveaxis(se3.inverse(estimate.world_T_imu @ sequence.imu_T_cam)[:, :3], 0, 2)
    return _Sights(
        problem.measurement,
        np.take(cam_T_world[:, :3], frame, axis=2),
        np.take(cam_T_world[:, 3], frame, axis=1),
        row,
        np.ascontiguousarray(measured_rows(sequence.observations.pixel[rows["observation"].to_numpy()[order]]).T),
        seconds - (np.bincount(row, weights=seconds) / count)[row],
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
    model, R, s, moves = sights.measurement, sights.turn, sights.seconds, state.shape[1] > 3
    points = np.take(state[:, :3].T, sights.row, axis=1)
    if moves:
        points = points + s * np.take(state[:, 3:].T, sights.row, axis=1)
    p_cam = (R * points).sum(axis=1) + sights.shift
    front = p_cam[2] > 0.0
    p_cam[:, ~front] = [[0.0], [0.0], [1.0]]
    seen, white = model.camera.rows(p_cam), model.white_scale[:, None]
    A = np.empty((3, 4, len(s)))  # columns are d/dp, then the residual
    A[:, :3] = model.camera.rows_along(seen, R) * white[:, None]
    A[:, 3] = (sights.measured - seen.pixel) * white
    squared = np.where(front, (A[:, 3] * A[:, 3]).sum(axis=0), np.inf)
    products = np.concatenate([(A[:, i : i + 1] * A[:, i:]).sum(axis=0) for i in range(3)])
    weighted = [squared[None], products, *((s * products, s * s * products[SYMMETRIC]) if moves else ())]
    starts = np.flatnonzero(np.diff(sights.row, prepend=-1))
    sums = np.add.reduceat(np.concatenate(weighted), starts, axis=1).T
    cost, information, pull = sums[:, 0], sums[:, 1:10], sums[:, 1:10][:, PULL]
    normal = information[:, SQUARE]
    if not moves:
        return cost, normal, pull
    mixed, velocity = sums[:, 10:19][:, SQUARE], sums[:, 19:][:, OF_SYMMETRIC]
    gradient = np.concatenate([pull, sums[:, 10:19][:, PULL]], axis=1)
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
