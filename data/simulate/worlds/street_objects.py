"""Objects along a street: house fronts, trees, parked cars, poles, road surface and skyline.

Coordinates are local to the street: x along it from a station, y to the left of its middle, z up from the ground, m.
Objects at a place are fixed (a house keeps its setback); points on them are random.
"""

from collections.abc import Callable

import numpy as np

from fgbaseline.geometry import FloatArray

from ...observations import BoolArray, IntArray

_Points = tuple[FloatArray, FloatArray, FloatArray]


class StreetObjects:
    """Objects of one town; `margin` adds m between the middle of the street and the objects."""

    def __init__(self, margin: float, rng: np.random.Generator) -> None:
        self._margin = margin
        self._table = rng.random(4096)
        self._kinds: tuple[tuple[float, Callable[[IntArray, FloatArray, np.random.Generator], _Points]], ...] = (
            (0.44, self._house_fronts),
            (0.14, self._trees),
            (0.12, self._parked_cars),
            (0.08, self._poles),
            (0.12, self._skyline),
            (0.10, self._road),
        )

    def points(self, station: IntArray, rng: np.random.Generator) -> tuple[FloatArray, BoolArray]:
        """One point (n, 3) about each station (n,) in whole meters, NaN where nothing stands; and which stand up."""
        kind = rng.choice(len(self._kinds), len(station), p=[share for share, _ in self._kinds])
        side = rng.choice([-1.0, 1.0], len(station))
        local = np.empty((len(station), 3))
        for number, (_, draw) in enumerate(self._kinds):
            chosen = kind == number
            local[chosen] = np.stack(draw(station[chosen], side[chosen], rng), axis=1)
        standing: BoolArray = kind < len(self._kinds) - 1
        local[:, 1] = side * (local[:, 1] + self._margin * standing)
        return local, standing

    def _house_fronts(self, station: IntArray, side: FloatArray, rng: np.random.Generator) -> _Points:
        house = station // 16
        setback = 8.0 + 6.0 * self._fixed(house, side, 0)
        y = setback + 0.25 * rng.standard_normal(len(station))
        height = 4.0 + 11.0 * self._fixed(house, side, 1)
        z = 0.4 + height * (rng.integers(0, 12, len(station)) / 12.0) ** 1.2
        return rng.random(len(station)), self._where(self._fixed(house, side, 2) > 0.12, y), z

    def _trees(self, station: IntArray, side: FloatArray, rng: np.random.Generator) -> _Points:
        tree = station // 14
        x, y, z = 1.4 * rng.standard_normal((3, len(station)))
        x += tree * 14.0 - station + 9.0 * self._fixed(tree, side, 3)
        return x, self._where(self._fixed(tree, side, 4) > 0.4, 6.5 + y), 4.5 + z

    def _parked_cars(self, station: IntArray, side: FloatArray, rng: np.random.Generator) -> _Points:
        car = station // 7
        x = car * 7.0 - station + rng.uniform(0.0, 4.4, len(station))
        y = rng.choice([4.1, 5.7], len(station))
        return x, self._where(self._fixed(car, side, 5) > 0.45, y), rng.uniform(0.2, 1.45, len(station))

    def _poles(self, station: IntArray, side: FloatArray, rng: np.random.Generator) -> _Points:
        pole = station // 28
        x = pole * 28.0 - station + 20.0 * self._fixed(pole, side, 6)
        return x, np.full(len(station), 6.1), rng.uniform(0.3, 6.5, len(station))

    def _skyline(self, station: IntArray, _side: FloatArray, rng: np.random.Generator) -> _Points:
        n = len(station)
        return rng.uniform(20.0, 90.0, n), rng.uniform(12.0, 60.0, n), rng.uniform(4.0, 28.0, n)

    def _road(self, station: IntArray, _side: FloatArray, rng: np.random.Generator) -> _Points:
        n = len(station)
        return rng.random(n), rng.uniform(0.0, 6.0, n), 0.02 * rng.standard_normal(n)

    @staticmethod
    def _where(there: BoolArray, y: FloatArray) -> FloatArray:
        return np.where(there, y, np.nan)

    def _fixed(self, place: IntArray, side: FloatArray, what: int) -> FloatArray:
        """Numbers (n,) in [0, 1) that belong to a place, its side of the street and what is asked of it."""
        key = place * 97 + side.astype(np.int64) * 1013 + what * 523
        numbers: FloatArray = self._table[key % len(self._table)]
        return numbers
