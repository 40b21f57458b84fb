"""What stands along a street: where points that a camera can track lie, relative to the way the car takes.

The street follows the path. Beyond a corner it also goes on straight ahead, as a crossing does, and what lies round the
corner is only seen from near it.
"""

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from ..observations import BoolArray, IntArray
from .path import Path

_LANE = 1.6
"""m, from the middle of the car's lane to the middle of the street, to the left"""
_AHEAD = 320
"""m of straight street beyond the end of the path"""
_CORNER = 0.02
"""1/m; what bends more is a corner"""
_SHARES = {"facade": 0.44, "tree": 0.14, "parked": 0.12, "pole": 0.08, "ground": 0.10, "skyline": 0.12}


class Street:
    """Scenery along a path, fixed by `rng`: house fronts, trees, parked cars, poles, the road and a skyline."""

    def __init__(self, path: Path, imu_above_ground: float, highway: bool, rng: np.random.Generator) -> None:
        self._margin = 8.0 if highway else 0.0
        self._table = rng.random(4096)
        forward = np.einsum("ni,ni->n", path.poses[:-1, :3, 0], np.diff(path.poses[:, :3, 3], axis=0))
        travelled = np.maximum.accumulate(np.concatenate([[0.0], np.cumsum(forward)]))
        rising = np.concatenate([[True], np.diff(np.maximum.accumulate(travelled)) > 1e-9])
        self._times, self._travelled = path.t[rising], travelled[rising]
        whole = np.arange(0.0, self._travelled[-1], 1.0)
        frames = path.at(np.interp(whole, self._travelled, self._times))
        beyond = np.repeat(path.at(path.t[-1:]), _AHEAD, axis=0)
        beyond[:, :3, 3] += beyond[:, :3, 0] * np.arange(_AHEAD)[:, None]
        self._frames = np.concatenate([frames, beyond])
        """(g, 4, 4) one a metre, on the ground"""
        self._frames[:, :3, 3] -= imu_above_ground * self._frames[:, :3, 2]
        turn = se3.relative(self._frames)
        self._curvature = np.concatenate([np.arctan2(turn[:, 1, 0], turn[:, 0, 0]), [0.0]])
        bend = np.abs(self._curvature) > _CORNER
        index = np.arange(len(bend))
        self._straight = _next(index, ~bend)
        """for each metre the next one that is not in a corner"""
        self._corner = _next(index, bend)
        """for each metre the next one in a corner"""

    def points(self, t: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One point (n, 3) in the path's world, m, for each time (n,): before the car of that time, not always seen."""
        n = len(t)
        here = np.interp(t, self._times, self._travelled).astype(np.int64)
        ahead = np.minimum(4.0 + rng.lognormal(np.log(23.0), 0.95, n), 280.0)
        last = len(self._frames) - 1
        driven = np.minimum(here + ahead.astype(np.int64), last)
        start = self._straight[np.minimum(here, last)]
        before_corner = self._corner[start] - 1
        straight_on = (before_corner < driven) & (rng.random(n) > 0.4 * (driven - before_corner < 45))
        base = np.where(straight_on, before_corner, driven)
        local, standing = self._scenery(base + np.where(straight_on, driven - base, 0), rng)
        local[:, 0] += np.where(straight_on, here + ahead - base, (here + ahead) % 1.0)
        # Nothing stands on the inner side of a corner, where the street's cross sections overlap.
        folded = ~straight_on & (self._curvature[base] * local[:, 1] > 0.5)
        points = se3.transform(self._frames[base], local)
        points[folded] = np.nan
        crossing = np.flatnonzero(standing & straight_on)
        points[crossing[self._in_the_way(points[crossing], driven[crossing])]] = np.nan
        return points

    def _scenery(self, station: IntArray, rng: np.random.Generator) -> tuple[FloatArray, BoolArray]:
        """Local points (n, 3) (x along, y left, z up, from the ground) by what stands there, and which stand up."""
        n = len(station)
        kind = rng.choice(len(_SHARES), n, p=list(_SHARES.values()))
        names = np.array(list(_SHARES))[kind]
        side = rng.choice([-1.0, 1.0], n)
        x, y, z = np.zeros(n), np.zeros(n), np.zeros(n)

        i = names == "facade"
        house = station[i] // 16
        setback = 8.0 + 6.0 * self._fixed(house, side[i], 0)
        windows = rng.integers(0, 12, int(i.sum())) / 12.0
        y[i] = setback + 0.25 * rng.standard_normal(int(i.sum()))
        z[i] = 0.4 + (4.0 + 11.0 * self._fixed(house, side[i], 1)) * windows**1.2
        y[i] = np.where(self._fixed(house, side[i], 2) < 0.12, np.nan, y[i])

        i = names == "tree"
        m = int(i.sum())
        trunk = (station[i] // 14) * 14.0 + 9.0 * self._fixed(station[i] // 14, side[i], 3)
        x[i] = trunk - station[i] + 1.2 * rng.standard_normal(m)
        y[i] = 6.5 + 1.2 * rng.standard_normal(m)
        z[i] = 4.5 + 1.5 * rng.standard_normal(m)
        y[i] = np.where(self._fixed(station[i] // 14, side[i], 4) < 0.4, np.nan, y[i])

        i = names == "parked"
        m = int(i.sum())
        x[i] = (station[i] // 7) * 7.0 - station[i] + rng.uniform(0.0, 4.4, m)
        y[i] = rng.choice([4.1, 5.7], m)
        z[i] = rng.uniform(0.2, 1.45, m)
        y[i] = np.where(self._fixed(station[i] // 7, side[i], 5) < 0.45, np.nan, y[i])

        i = names == "pole"
        x[i] = (station[i] // 28) * 28.0 - station[i] + 20.0 * self._fixed(station[i] // 28, side[i], 6)
        y[i] = 6.1
        z[i] = rng.uniform(0.3, 6.5, int(i.sum()))

        i = names == "ground"
        y[i] = rng.uniform(0.0, 6.0, int(i.sum()))
        z[i] = 0.02 * rng.standard_normal(int(i.sum()))

        i = names == "skyline"
        m = int(i.sum())
        x[i] = rng.uniform(20.0, 90.0, m)
        y[i] = rng.uniform(12.0, 60.0, m)
        z[i] = rng.uniform(4.0, 28.0, m)

        standing = names != "ground"
        y = side * (y + self._margin * standing) + _LANE
        return np.stack([x, y, z], axis=1), standing

    def _fixed(self, place: IntArray, side: FloatArray, what: int) -> FloatArray:
        """Numbers in [0, 1) that belong to a place, its side of the street and what is asked of it."""
        key = place * 97 + side.astype(np.int64) * 1013 + what * 523
        numbers: FloatArray = self._table[key % len(self._table)]
        return numbers

    def _in_the_way(self, points: FloatArray, driven: IntArray) -> BoolArray:
        """Which points (n,) stand within 2.5 m of where the car drives, up to 60 m before or 40 m after `driven`."""
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
