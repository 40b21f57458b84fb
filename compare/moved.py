"""Tracks whose residuals say that the point moved."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.observations import IntArray
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
    standing, squared = _fitted(sights, start)
    moving, left = _fitted(sights, np.concatenate([standing, np.zeros((n, 3))], axis=1))
    gain = squared - left
    return pd.DataFrame(
        {
            "landmark": landmark,
            "n": np.bincount(row, minlength=n),
            "squared": squared,
            "gain": gain,
            "speed": np.linalg.norm(moving[:, 3:], axis=1),
            "moved": (probability_beyond(gain, 3.0) < SIGNIFICANCE / max(n, 1)) & (gain > EXPLAINED * squared),
        }
    )


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


def _fitted(sights: _Sights, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (m, 3), or positions and velocities (m, 6), that fit best, and the whitened squared residuals (m,)."""
    state, scale = start.copy(), np.ones(len(start))
    cost, normal, gradient = _linearised(sights, state)
    for _ in range(ITERATIONS):
        trial = state + scale[:, None] * _step(normal, gradient)
        new_cost, new_normal, new_gradient = _linearised(sights, trial)
        better = new_cost <= cost
        state[better], cost[better] = trial[better], new_cost[better]
        normal[better], gradient[better] = new_normal[better], new_gradient[better]
        scale = np.where(better, 1.0, 0.25 * scale)
    return state, cost


def _linearised(sights: _Sights, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cost (m,), infinite behind a camera, and normal equations (m, d, d), (m, d)."""
    row, moves = sights.row, state.shape[1] > 3
    points = state[row, :3] + (sights.seconds[:, None] * state[row, 3:] if moves else 0.0)
    p_cam = se3.transform(sights.cam_T_world, points)
    front = p_cam[:, 2] > 0.0
    p_cam[~front] = [0.0, 0.0, 1.0]
    residual = sights.pixel - sights.camera.project(p_cam)
    H = sights.camera.jacobian(p_cam) @ sights.cam_T_world[:, :3, :3]
    if moves:
        H = np.concatenate([H, sights.seconds[:, None, None] * H], axis=2)
    Ht = np.swapaxes(H, 1, 2) / sights.variance
    squared = np.where(front, np.sum(residual**2, axis=1) / sights.variance, np.inf)
    cost = _summed(squared, row, len(state))
    return cost, _summed(Ht @ H, row, len(state)), _summed((Ht @ residual[:, :, None])[:, :, 0], row, len(state))


def _step(normal: FloatArray, gradient: FloatArray) -> FloatArray:
    """(m, d) that solves the normal equations, scaled to a unit diagonal; not along what the sights leave open."""
    scale = np.sqrt(np.maximum(np.einsum("mii->mi", normal), np.finfo(np.float64).tiny))
    inverse = np.linalg.pinv(normal / (scale[:, :, None] * scale[:, None, :]), rcond=1e-9, hermitian=True)
    return np.asarray((inverse @ (gradient / scale)[:, :, None])[:, :, 0] / scale)


def _summed(values: FloatArray, row: IntArray, n: int) -> FloatArray:
    sums = np.zeros((n, *values.shape[1:]))
    np.add.at(sums, row, values)
    return sums
