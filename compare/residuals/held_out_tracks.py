"""Cross-validation of trajectories on held-out feature tracks, without ground truth.

Each piece of a held-out track is triangulated along a path from one half of its observations and predicted in the other
half, and vice versa. The error measures the path between the two halves: a track of 13 frames covers about one second
of motion, and drift over longer times does not show.

All paths share one mask. A piece is an inlier if its smallest RMSE over the paths is below a gate: `GATE` times the
median of these smallest errors, within 3 to 12 px. No path explains an outlier, so its exclusion favors none.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline.data import HeldOut, Sequence
from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FgbaselineError, FloatArray, HuberKernel, MeasurementModel, se3
from fgbaseline.geometry.triangulation import triangulate_tracks

from .reprojection import NEAR

GATE = 6.0
"""gate as a multiple of the median over the pieces of the smallest RMSE over the paths"""
GATE_RANGE = (3.0, 12.0)
"""px; bounds of the gate"""
BLOCK = 5.0
"""s; tracks that begin within one block share the errors of a path and are drawn together"""
RESAMPLES = 400
SEED = 20264


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class HeldOutErrors(Displayed):
    """Prediction errors of several paths on the same held-out observations."""

    table: pd.DataFrame
    """one row per inlier observation: `piece`, `landmark`, `frame` and `start`, s, the first stamp of the piece"""
    error: pd.DataFrame
    """a column per path, px: norm of the four pixel residuals; infinite behind the camera"""
    gate: float
    """px"""
    pieces: int
    """number of pieces for which every path has poses"""
    inliers: int
    """number of inlier pieces among these"""


def held_out_errors(
    sequence: Sequence, held: HeldOut, paths: Mapping[str, FloatArray], pixel_variance: float
) -> HeldOutErrors:
    """Prediction errors of paths (T, 4, 4) on the held-out pieces within the frames that all of them have.

    `sequence` holds stamps, camera and extrinsic as the estimators use them; `pixel_variance`, px^2, is that of the
    triangulation, which has the Huber kernel. Raises FgbaselineError without a path.
    """
    if not paths:
        raise FgbaselineError("held-out tracks: there is no trajectory to evaluate")
    everywhere = np.isfinite(np.stack(list(paths.values()))).all(axis=(0, 2, 3))
    chosen = _by_piece(held, np.asarray(everywhere, dtype=np.bool_))
    error = np.stack(
        [cross_prediction_errors(sequence, held, chosen, path, pixel_variance) for path in paths.values()], axis=1
    )
    piece = np.unique(held.piece[chosen], return_inverse=True)[1]
    n = int(piece.max(initial=-1)) + 1
    count = np.bincount(piece, minlength=n)
    squares = np.stack([np.bincount(piece, weights=column**2, minlength=n) for column in error.T], axis=1)
    best = np.sqrt(squares / count[:, None]).min(axis=1)
    finite = best[np.isfinite(best)]
    gate = float(np.clip(GATE * np.median(finite), *GATE_RANGE)) if len(finite) else GATE_RANGE[0]
    inlier = best < gate
    taken, o = inlier[piece], held.observations
    frame = o.frame[chosen]
    first = np.full(n, np.iinfo(np.int64).max)
    np.minimum.at(first, piece, frame)
    table = pd.DataFrame(
        {
            "piece": held.piece[chosen],
            "landmark": o.landmark[chosen],
            "frame": frame,
            "start": (sequence.t - sequence.t[0])[first[piece]],
        }
    )
    errors = pd.DataFrame(error, columns=list(paths))
    return HeldOutErrors(
        table[taken].reset_index(drop=True), errors[taken].reset_index(drop=True), gate, n, int(inlier.sum())
    )


def cross_prediction_errors(
    sequence: Sequence, held: HeldOut, chosen: IntArray, path: FloatArray, pixel_variance: float
) -> FloatArray:
    """Errors (n,), px, of the held-out observations `chosen` (n,), sorted by piece and frame, along one path.

    The first half of a piece is predicted from its second half, and the second from the first.
    """
    o = held.observations
    piece = np.unique(held.piece[chosen], return_inverse=True)[1].astype(np.int64)
    n = int(piece.max(initial=-1)) + 1
    count = np.bincount(piece, minlength=n)
    position = np.arange(len(piece)) - (np.cumsum(count) - count)[piece]
    late = position >= (count[piece] + 1) // 2
    world_T_cam, pixel = (path @ sequence.imu_T_cam)[o.frame[chosen]], o.pixel[chosen]
    error = np.full(len(piece), np.inf)
    measurement = MeasurementModel(sequence.camera, pixel_variance, HuberKernel())
    for seen in (~late, late):
        points = triangulate_tracks(measurement, world_T_cam[seen], piece[seen], pixel[seen], n)
        p_cam = se3.transform(se3.inverse(world_T_cam[~seen]), points.position[piece[~seen]])
        with np.errstate(divide="ignore", invalid="ignore"):
            norm = measurement.reprojection_error(pixel[~seen] - sequence.camera.project(p_cam))
        error[~seen] = np.where((p_cam[:, 2] > 0.0) & np.isfinite(norm), norm, np.inf)
    return error


def held_out_ranking(errors: HeldOutErrors) -> pd.DataFrame:
    """Paths ranked by median error: `median`, `p95` (px) and share `under_3px` over the common observations.

    `low` and `high` are the 95 % interval of the median, `behind` its difference from the best one with `behind_low`
    and `behind_high`; an interval that contains zero is a tie. Block bootstrap over `BLOCK` seconds, 400 draws. Empty
    without observations. Its `attrs` are `n` observations and `pieces`, those within the frames that all paths have.
    """
    values = errors.error.to_numpy()
    attrs: Mapping[Hashable | None, Any] = {"n": len(values), "pieces": errors.pieces}
    columns = ["median", "low", "high", "behind", "behind_low", "behind_high", "p95", "under_3px"]
    if len(values) == 0:
        empty = pd.DataFrame(columns=columns, index=pd.Index([], name="estimator"), dtype=np.float64)
        empty.attrs = attrs
        return empty
    median = np.median(values, axis=0)
    best = int(np.argmin(median))
    drawn = _drawn_medians(values, np.floor(errors.table["start"].to_numpy() / BLOCK).astype(np.int64))
    low, high = np.percentile(drawn, [2.5, 97.5], axis=0, method="nearest")
    with np.errstate(invalid="ignore"):
        behind = np.where(drawn == drawn[:, [best]], 0.0, drawn - drawn[:, [best]])  # two infinite medians are a tie
    behind_low, behind_high = np.percentile(behind, [2.5, 97.5], axis=0, method="nearest")
    table = pd.DataFrame(
        {
            "median": median,
            "low": low,
            "high": high,
            "behind": median - median[best],
            "behind_low": behind_low,
            "behind_high": behind_high,
            "p95": np.percentile(values, 95, axis=0, method="nearest"),
            "under_3px": np.mean(values < NEAR, axis=0),
        },
        index=pd.Index(errors.error.columns, name="estimator"),
    )
    table = table.sort_values("median", kind="stable")
    table.attrs = attrs
    return table


def _by_piece(held: HeldOut, everywhere: BoolArray) -> IntArray:
    """Held-out observations (n,) of pieces within the frames (T,) that all paths have, sorted by piece, then frame."""
    o, piece = held.observations, held.piece
    missing = np.zeros(held.n_pieces, dtype=np.bool_)
    missing[piece[(piece >= 0) & ~everywhere[o.frame]]] = True
    chosen = np.flatnonzero(piece >= 0)
    chosen = chosen[~missing[piece[chosen]]]
    return chosen[np.lexsort((o.frame[chosen], piece[chosen]))].astype(np.int64)


def _drawn_medians(values: FloatArray, block: IntArray) -> FloatArray:
    """Medians (RESAMPLES, m) of values (n, m) over blocks drawn with replacement."""
    random = np.random.default_rng(SEED)
    rows = [np.flatnonzero(block == b) for b in np.unique(block)]
    drawn = np.empty((RESAMPLES, values.shape[1]))
    for i in range(RESAMPLES):
        drawn[i] = np.median(
            values[np.concatenate([rows[j] for j in random.integers(0, len(rows), len(rows))])], axis=0
        )
    return drawn
