"""Dynamic landmarks: tracks that a point of constant velocity fits significantly better than a static one."""

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, MeasurementModel, se3

from ..residuals.whitening import evaluated_rows
from ..statistics.chi_square import p_value

MIN_OBSERVATIONS = 4
"""observations of a track: point and velocity have six degrees of freedom"""
SIGNIFICANCE = 0.01
"""family-wise probability of a false positive over all tracks (Bonferroni)"""
EXPLAINED = 0.5
"""share of the squared residuals that the velocity must explain"""
ITERATIONS = 8
"""iterations of Gauss-Newton; a step that increases a track's cost is rejected and shortened"""
CONVERGED = 1e-16
"""predicted decrease of a track's cost at convergence, relative to 1 + cost"""
CONVERGED_STATIC = 1e-6
"""as `CONVERGED`, for the velocity of tracks that a static point fits"""
UNOBSERVABLE = 1e-9
"""share of the largest eigenvalue of a track's scaled normal equations, below which a direction is unobservable"""
SYMMETRIC, PULL = [0, 1, 2, 4, 5, 7], [3, 6, 8]
"""indices of the upper triangle (3, 3), row by row, and of the gradient, where each row ends with its gradient"""
SQUARE = np.array([[0, 1, 2], [1, 4, 5], [2, 5, 7]])
OF_SYMMETRIC = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
"""indices of the full symmetric matrix, in those rows and in the upper triangle alone"""


class _Observations(NamedTuple):
    """Observations (n) of m points, at least one each, sorted by point.

    Coordinates are separate arrays, several times as fast as stacks of small matrices.
    """

    measurement: MeasurementModel
    turn: FloatArray
    """rotation of cam_T_world (3, 3, n)"""
    shift: FloatArray
    """translation of cam_T_world (3, n), m"""
    row: IntArray
    """point of each observation (n,), 0 to m - 1, rising"""
    measured: FloatArray
    """uL, uR and v (3, n), px"""
    seconds: FloatArray
    """time since the mean stamp of the track (n,), s"""

    def of(self, points: IntArray, m: int) -> "_Observations":
        """Observations of a rising subset of the m points, renumbered."""
        number = np.full(m, -1)
        number[points] = np.arange(len(points))
        row = number[self.row]
        kept = np.flatnonzero(row >= 0)
        return _Observations(
            self.measurement,
            self.turn[:, :, kept],
            self.shift[:, kept],
            row[kept],
            self.measured[:, kept],
            self.seconds[kept],
        )


def dynamic_landmarks(problem: Problem, estimate: Estimate, table: pd.DataFrame) -> pd.DataFrame:
    """Test of each landmark with at least MIN_OBSERVATIONS `evaluated_rows` in front of the camera, one row each.

    Columns: `landmark`; `n` observations; `squared`, the whitened squared residuals of the best static point; `gain`,
    their decrease for a point of constant velocity; `speed`, m/s; and `moved`, whether the gain is significant
    (chi-square with 3 degrees of freedom, Bonferroni over all tracks) and more than half of the residuals. A sliding
    track and an error of the poses have the same effect; only a landmark that moves for every estimate is dynamic.
    """
    rows = evaluated_rows(problem, table)
    rows = rows[(rows["depth"] > 0) & np.isfinite(rows["error"])]
    rows = rows[rows.groupby("landmark")["frame"].transform("size") >= MIN_OBSERVATIONS]
    landmark, row = np.unique(rows["landmark"].to_numpy(), return_inverse=True)
    n = len(landmark)
    observations = _observations_of(problem, estimate, rows, row)
    start = estimate.landmarks.position[np.searchsorted(estimate.landmarks.index, landmark)]
    standing, squared = _fitted(observations, start, np.full(n, CONVERGED))
    # The gain is at most the cost, so it is not significant where the cost is not.
    converged = np.where(_significant(squared), CONVERGED, CONVERGED_STATIC)
    moving, left = _fitted(observations, np.concatenate([standing, np.zeros((n, 3))], axis=1), converged)
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
    """Whether (m,) a gain (m,) is significant at `SIGNIFICANCE` over all m tracks."""
    return np.asarray(p_value(gain, 3.0) < SIGNIFICANCE / max(len(gain), 1))


def _observations_of(problem: Problem, estimate: Estimate, rows: pd.DataFrame, row: IntArray) -> _Observations:
    sequence, order = problem.sequence, np.argsort(row, kind="stable")
    row, frame = row[order], rows["frame"].to_numpy()[order]
    count, pixel = np.maximum(np.bincount(row), 1), sequence.observations.pixel[rows["observation"].to_numpy()[order]]
    seconds = sequence.t[frame] - sequence.t[0]
    cam_T_world = np.moveaxis(se3.inverse(estimate.world_T_imu @ sequence.imu_T_cam)[:, :3], 0, 2)
    return _Observations(
        problem.measurement,
        np.take(cam_T_world[:, :3], frame, axis=2),
        np.take(cam_T_world[:, 3], frame, axis=1),
        row,
        np.ascontiguousarray(problem.measurement.rows_of(pixel).T),
        seconds - (np.bincount(row, weights=seconds) / count)[row],
    )


def _fitted(observations: _Observations, start: FloatArray, converged: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least-squares positions (m, 3), or positions and velocities (m, 6), and whitened squared residuals (m,).

    `converged` (m,) is the predicted decrease, as a share of a track's cost, at which its iteration ends.
    """
    m = len(start)
    state, scale, active = start.copy(), np.ones(m), np.arange(m)
    cost, normal, gradient = _linearized(observations, state)
    for _ in range(ITERATIONS):
        step = _step(normal[active], gradient[active])
        promised = np.einsum("md,md->m", gradient[active], step)
        going = np.isinf(cost[active]) | (promised > converged[active] * (1.0 + cost[active]))
        active, step = active[going], step[going]
        if len(active) == 0:
            break
        trial = state[active] + scale[active, None] * step
        new_cost, new_normal, new_gradient = _linearized(observations.of(active, m), trial)
        better = new_cost <= cost[active]
        at = active[better]
        state[at], cost[at] = trial[better], new_cost[better]
        normal[at], gradient[at] = new_normal[better], new_gradient[better]
        scale[active] = np.where(better, 1.0, 0.25 * scale[active])
    return state, cost


def _linearized(observations: _Observations, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cost (m,), infinite behind a camera, and normal equations (m, d, d), (m, d)."""
    model, R, s, moves = observations.measurement, observations.turn, observations.seconds, state.shape[1] > 3
    points = np.take(state[:, :3].T, observations.row, axis=1)
    if moves:
        points = points + s * np.take(state[:, 3:].T, observations.row, axis=1)
    p_cam = (R * points).sum(axis=1) + observations.shift
    front = p_cam[2] > 0.0
    p_cam[:, ~front] = [[0.0], [0.0], [1.0]]
    seen, white = model.camera.rows(p_cam), model.whitening_scale[:, None]
    A = np.empty((model.n_rows, 4, len(s)))  # columns are d/dp, then the residual
    A[:, :3] = model.camera.row_derivatives(seen, R) * white[:, None]
    A[:, 3] = (observations.measured - seen.pixel) * white
    squared = np.where(front, (A[:, 3] * A[:, 3]).sum(axis=0), np.inf)
    products = np.concatenate([(A[:, i : i + 1] * A[:, i:]).sum(axis=0) for i in range(3)])
    weighted = [squared[None], products, *((s * products, s * s * products[SYMMETRIC]) if moves else ())]
    starts = np.flatnonzero(np.diff(observations.row, prepend=-1))
    sums = np.add.reduceat(np.concatenate(weighted), starts, axis=1).T
    cost, information, pull = sums[:, 0], sums[:, 1:10], sums[:, 1:10][:, PULL]
    normal = information[:, SQUARE]
    if not moves:
        return cost, normal, pull
    mixed, velocity = sums[:, 10:19][:, SQUARE], sums[:, 19:][:, OF_SYMMETRIC]
    gradient = np.concatenate([pull, sums[:, 10:19][:, PULL]], axis=1)
    return cost, np.block([[normal, mixed], [mixed, velocity]]), gradient


def _step(normal: FloatArray, gradient: FloatArray) -> FloatArray:
    """Solution (m, d) of the normal equations, scaled to a unit diagonal, without unobservable directions."""
    scale = np.sqrt(np.maximum(np.einsum("mii->mi", normal), np.finfo(np.float64).tiny))
    unit, right = normal / (scale[:, :, None] * scale[:, None, :]), gradient / scale
    d = right.shape[1]
    # Eigenvalues with the sum d: if the others are as large as they can be, the smallest is the determinant over e.
    regular = np.linalg.det(unit) > math.e * d * UNOBSERVABLE
    step = np.empty_like(right)
    step[regular] = np.linalg.solve(unit[regular], right[regular][:, :, None])[:, :, 0]
    inverse = np.linalg.pinv(unit[~regular], rcond=UNOBSERVABLE, hermitian=True)
    step[~regular] = (inverse @ right[~regular][:, :, None])[:, :, 0]
    return np.asarray(step / scale)
