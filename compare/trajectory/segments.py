"""KITTI segment errors: relative motion error over 100, 200, ... 800 m, per meter (Geiger, Lenz and Urtasun, 2012)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import IntArray
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray, InputError
from fgbaseline.geometry.path_length import distance_traveled

from ..column_tables import Columns, to_frame
from ..statistics.block_bootstrap import Bounded, bootstrapped
from .association import MatchedTrajectories
from .ate_rpe import PoseRelation, relative_pose_error

if TYPE_CHECKING:
    import pandas as pd

OFFICIAL_LENGTHS = tuple(range(100, 900, 100))
OFFICIAL_STEP = 10
"""poses between the starts of segments: 1 s at KITTI's 10 Hz"""
ERRORS = ("translation_percent", "rotation_deg_per_m")
ROUND = np.array([1.0, 2.0, 2.5, 5.0])


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class SegmentErrors(Displayed):
    """Errors of segments, and the segment lengths."""

    columns: Columns
    """one row per segment: `start`, `end` (indices of poses), `length` (m, nominal), `translation_percent` (of it),
    `rotation_deg_per_m`, `speed` (m/s; NaN without stamps)"""
    lengths: tuple[float, ...]
    """m, as requested"""
    step: int
    official: bool
    """whether lengths and step are those of the KITTI devkit, as published results have them"""

    def __len__(self) -> int:
        return len(self.columns["start"])

    @property
    def table(self) -> "pd.DataFrame":
        """Table of the `columns`."""
        return to_frame(self.columns)

    @property
    def by_length(self) -> "pd.DataFrame":
        """Mean of each error and number of segments `n` by segment length."""
        return to_frame(self.means_by_length).set_index("length")

    @property
    def means_by_length(self) -> Columns:
        """Segment lengths `length`, m, rising, and for each the mean of each error and the number `n` of segments."""
        lengths, place, n = np.unique(self.columns["length"], return_inverse=True, return_counts=True)
        means = {name: np.bincount(place, self.columns[name]) / n for name in ERRORS}
        return {"length": lengths, **means, "n": n}

    @property
    def translation_percent(self) -> float:
        """Mean translation error over all segments, the ranking criterion of the KITTI benchmark, %."""
        return float(self.columns["translation_percent"].mean())

    @property
    def rotation_deg_per_m(self) -> float:
        """Mean rotation error over all segments, deg/m."""
        return float(self.columns["rotation_deg_per_m"].mean())

    def intervals(self, seed: int = 0) -> "pd.DataFrame":
        """Table of `means`: columns `value`, `low`, `high`."""
        import pandas as pd

        means = self.means(seed)
        return pd.DataFrame(list(means.values()), index=pd.Index(means), columns=list(Bounded._fields))

    def means(self, seed: int = 0) -> Mapping[str, Bounded]:
        """Mean of each error with its interval by `bootstrapped`, segments in order of their starts."""
        return {name: bootstrapped(self.columns[name], of=("mean",), seed=seed)["mean"] for name in ERRORS}

    @property
    def caption(self) -> str:
        """Number and lengths of the segments, for a table's caption."""
        whose = "KITTI's lengths" if self.official else "lengths fitted to the trajectory, not KITTI's"
        shortest, longest = min(self.lengths), max(self.lengths)
        every = "pose" if self.step == 1 else f"{self.step} poses"
        return f"{plural(len(self), 'segment')} of {shortest:g} to {longest:g} m ({whose}), one begun every {every}"


def segment_errors(
    matched: MatchedTrajectories, lengths: tuple[float, ...] | None = None, step: int | None = None
) -> SegmentErrors:
    """Segment errors as in KITTI's devkit: error of the motion from every `step`-th pose to the first one more than a
    length further along the reference's path, divided by that length.

    By default the official lengths and step; where the path is no longer than the shortest of them, eight lengths
    fitted to it, from every pose. Raises InputError where no segment of the requested lengths fits, or the reference
    does not move.
    """
    reference, estimate = matched.reference, matched.estimate
    traveled = distance_traveled(reference.position)
    fits = traveled[-1] > OFFICIAL_LENGTHS[0]
    if lengths is None:
        lengths = tuple(map(float, OFFICIAL_LENGTHS)) if fits else fitted_lengths(float(traveled[-1]))
        step = step or (OFFICIAL_STEP if fits else 1)
    step = step or OFFICIAL_STEP
    official = step == OFFICIAL_STEP and tuple(lengths) == OFFICIAL_LENGTHS
    pairs, length = _segments(traveled, np.asarray(lengths, dtype=np.float64), step)
    if len(pairs) == 0:
        raise InputError(
            f"{reference.source or reference.name}: no segment of {min(lengths):g} m or more fits into its path of "
            f"{traveled[-1]:.3g} m; give shorter lengths"
        )
    poses, truth = estimate.world_T_body, reference.world_T_body
    seconds = reference.t[pairs[:, 1]] - reference.t[pairs[:, 0]]
    columns = {
        "start": pairs[:, 0],
        "end": pairs[:, 1],
        "length": length,
        "translation_percent": 100.0 * relative_pose_error(poses, truth, pairs, PoseRelation.TRANSLATION) / length,
        "rotation_deg_per_m": relative_pose_error(poses, truth, pairs, PoseRelation.ROTATION_DEG) / length,
        "speed": length / seconds if reference.stamped else np.full(len(pairs), np.nan),
    }
    return SegmentErrors(columns, tuple(lengths), step, official)


def fitted_lengths(path: float) -> tuple[float, ...]:
    """Eight segment lengths, 1 to 8 times 1, 2, 2.5 or 5 times a power of ten, at most 0.9 of the path, m.

    Raises InputError for a path without length.
    """
    if not path > 0:
        raise InputError("the reference stands still: it has no segments")
    wanted = 0.9 * path / 8.0
    power = 10.0 ** np.floor(np.log10(wanted))
    unit = float(ROUND[wanted / power * (1 + 1e-12) >= ROUND][-1] * power)
    return tuple(unit * k for k in range(1, 9))


def _segments(traveled: FloatArray, lengths: FloatArray, step: int) -> tuple[IntArray, FloatArray]:
    """First and last pose (m, 2) of each segment, by start, then length, and its length (m,), m."""
    start = np.repeat(np.arange(0, len(traveled), step), len(lengths))
    length = np.tile(lengths, len(start) // len(lengths))
    end = np.searchsorted(traveled, traveled[start] + length, side="right")
    whole = end < len(traveled)
    return np.stack([start[whole], end[whole]], axis=1), length[whole]
