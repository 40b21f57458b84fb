"""Exclusion of landmarks that are dynamic, or whose position the observations do not determine."""

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.observations import BoolArray, IntArray, Observations
from fgbaseline.data.problem import Excluded
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, se3
from fgbaseline.geometry.measurement_model import three_rows
from fgbaseline.geometry.triangulation import triangulate_tracks

PIECE = 8
"""observations of a track tested together: few enough that odometry has little drift"""
MOVING = 6.0
"""error of a dynamic piece, in median errors of the pieces"""
MOVING_LEAST = 2.0
"""px"""
UNDETERMINED = 2.0
"""relative standard deviation of the distance at which a point may be behind the camera"""


def exclude_landmarks(
    sequence: Sequence, world_T_imu: FloatArray, excluded: NDArray[np.uint8], sigma: float
) -> NDArray[np.uint8]:
    """The mask `excluded` (n,) with observations of dynamic and of undetermined landmarks excluded too.

    Landmarks are triangulated along a locally accurate path (T, 4, 4). A landmark is dynamic where most pieces of its
    track do not fit a static point, compared with the errors of all pieces. It is undetermined where `sigma` (px)
    leaves its distance open, or where it violates cheirality.
    """
    chosen = np.flatnonzero(excluded == Excluded.NO)
    if len(chosen) == 0:
        return excluded
    o = sequence.observations.select(chosen)
    world_T_cam = (world_T_imu @ sequence.imu_T_cam)[o.frame]
    _, row = np.unique(o.landmark, return_inverse=True)
    row = row.astype(np.int64)
    result, model = excluded.copy(), MeasurementModel(sequence.camera, sigma**2, HuberKernel())
    result[chosen[_moving(model, world_T_cam, row, o)[row]]] = Excluded.MOVING
    result[chosen[_undetermined(model, world_T_cam, row, o)[row]]] = Excluded.GEOMETRY
    return result


def _moving(model: MeasurementModel, world_T_cam: FloatArray, row: IntArray, o: Observations) -> BoolArray:
    """Mask (m,) of dynamic landmarks."""
    piece, n_pieces = _pieces(row, o.frame)
    position = triangulate_tracks(model, world_T_cam, piece, o.pixel, n_pieces).position
    residual = o.pixel - model.camera.project(se3.transform(se3.inverse(world_T_cam), position[piece]))
    squared = np.nan_to_num((three_rows(residual) ** 2).sum(axis=1))
    error = np.sqrt(np.bincount(piece, squared) / np.bincount(piece))
    misfit = error > max(MOVING * float(np.median(error)), MOVING_LEAST)
    return np.asarray(np.bincount(row, misfit[piece]) > 0.5 * np.bincount(row), dtype=np.bool_)


def _pieces(row: IntArray, frame: IntArray) -> tuple[IntArray, int]:
    """Piece (n,) of each observation of landmarks `row` (n,), and the number of pieces.

    A piece has `PIECE` to twice as many consecutive observations, or those of a short track.
    """
    order = np.lexsort((frame, row))
    length = np.bincount(row)
    start = np.cumsum(length) - length
    place = np.empty(len(row), dtype=np.int64)
    place[order] = np.arange(len(row)) - start[row[order]]
    count = np.maximum(1, length // PIECE)
    first = np.cumsum(count) - count
    return first[row] + np.minimum(place * count[row] // length[row], count[row] - 1), int(count.sum())


def _undetermined(model: MeasurementModel, world_T_cam: FloatArray, row: IntArray, o: Observations) -> BoolArray:
    """Mask (m,) of landmarks with an undetermined distance, or behind a camera."""
    position, information = triangulate_tracks(model, world_T_cam, row, o.pixel, int(row.max()) + 1)
    depth = se3.transform(se3.inverse(world_T_cam), position[row])[:, 2]
    behind = np.bincount(row, ~(depth > 0.0)) > 0
    distance = np.bincount(row, np.abs(depth)) / np.bincount(row)
    weakest = np.linalg.eigvalsh(np.nan_to_num(information))[:, 0]
    return np.asarray(behind | (weakest * (UNDETERMINED * distance) ** 2 < 1.0), dtype=np.bool_)
