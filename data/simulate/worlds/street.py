"""Street along the path of a car, with the positions of trackable points.

The street follows the path. Beyond a corner it also continues straight ahead, as at a crossing. Objects around the
corner are visible only near it.
"""

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from ...observations import BoolArray, IntArray
from ..simulated_path import Path
from .street_objects import StreetObjects

_LANE = 1.6
"""m, from the middle of the car's lane to the middle of the street, to the left"""
_AHEAD = 320
"""m of straight street beyond the end of the path"""
_CORNER = 0.02
"""1/m; what bends more is a corner"""
_TURN_OFF = 0.4
"""share of the points within 45 m round a corner that are on the car's way, not straight on"""


class Street:
    """The street a path follows; `rng` builds what stands along it."""

    def __init__(self, path: Path, imu_above_ground: float, highway: bool, rng: np.random.Generator) -> None:
        self._scenery = StreetObjects(8.0 if highway else 0.0, rng)
        forward = np.einsum("ni,ni->n", path.poses[:-1, :3, 0], np.diff(path.poses[:, :3, 3], axis=0))
        traveled = np.maximum.accumulate(np.concatenate([[0.0], np.cumsum(forward)]))
        rising = np.concatenate([[True], np.diff(np.maximum.accumulate(traveled)) > 1e-9])
        self._times, self._traveled = path.t[rising], traveled[rising]
        whole = np.arange(0.0, self._traveled[-1], 1.0)
        frames = path.at(np.interp(whole, self._traveled, self._times))
        beyond = np.repeat(path.at(path.t[-1:]), _AHEAD, axis=0)
        beyond[:, :3, 3] += beyond[:, :3, 0] * np.arange(_AHEAD)[:, None]
        self._frames = np.concatenate([frames, beyond])
        """(g, 4, 4) one a meter, on the ground"""
        self._frames[:, :3, 3] -= imu_above_ground * self._frames[:, :3, 2]
        turn = se3.relative(self._frames)
        self._curvature = np.concatenate([np.arctan2(turn[:, 1, 0], turn[:, 0, 0]), [0.0]])
        bend = np.abs(self._curvature) > _CORNER
        index = np.arange(len(bend))
        self._straight = _next(index, ~bend)
        """next meter, of each meter, that is not in a corner"""
        self._corner = _next(index, bend)
        """next meter, of each meter, that is in a corner"""

    def points(self, t: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One point (n, 3) in the path's world, m, for each time (n,): before the car of that time, not always seen."""
        n = len(t)
        here = np.interp(t, self._times, self._traveled).astype(np.int64)
        ahead = np.minimum(4.0 + rng.lognormal(np.log(23.0), 0.95, n), 280.0).astype(np.int64)
        last = len(self._frames) - 1
        driven = np.minimum(here + ahead, last)
        start = self._straight[np.minimum(here, last)]
        before_corner = self._corner[start] - 1
        beyond = driven - before_corner
        straight_on = (beyond > 0) & ((beyond >= 45) | (rng.random(n) > _TURN_OFF))
        base = np.where(straight_on, before_corner, driven)
        local, standing = self._scenery.points(driven, rng)
        local[:, 0] += driven - base
        local[:, 1] += _LANE
        # Nothing stands on the inner side of a corner, where the street's cross sections overlap.
        folded = ~straight_on & (self._curvature[base] * local[:, 1] > 0.5)
        points = se3.transform(self._frames[base], local)
        points[folded] = np.nan
        crossing = np.flatnonzero(standing & straight_on)
        points[crossing[self._in_the_way(points[crossing], driven[crossing])]] = np.nan
        return points

    def _in_the_way(self, points: FloatArray, driven: IntArray) -> BoolArray:
        """Mask (n,) of points less than 2.5 m from the path of the car, from 60 m before to 40 m after `driven`."""
        nearest = np.full(len(points), np.inf)
        ground = self._frames[:, :2, 3].copy()
        for step in range(-60, 41, 3):
            place = ground[np.clip(driven + step, 0, len(ground) - 1)]
            nearest = np.minimum(nearest, np.hypot(points[:, 0] - place[:, 0], points[:, 1] - place[:, 1]))
        within: BoolArray = nearest < 2.5
        return within


def _next(index: IntArray, wanted: BoolArray) -> IntArray:
    """For each index (g,) the first one from there on where `wanted`; beyond all there are, twice the last."""
    far = np.where(wanted, index, 2 * len(index))
    following: IntArray = np.minimum.accumulate(far[::-1])[::-1]
    return following
