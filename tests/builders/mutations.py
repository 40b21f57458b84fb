"""What goes wrong with the numbers of a recording or a trajectory: units, lost digits, stray stamps, order, gaps.

A mutation changes a copy of the good arrays. `unit` ones change the physical meaning of every value, so that no command
may pass them as they are; of the others nothing is asked but an end in time, and no number that differs silently.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

EPOCH = 1.3e9
"""s, where the stamps of recorders begin"""
POWERS = (-9, -6, -3, 3, 6, 9)
Arrays = dict[str, Any]
Rows = list[list[str]]


@dataclass(frozen=True)
class Mutation:
    """One kind of change."""

    name: str
    change: Callable[[Any, np.random.Generator], Any]
    """of a copy, which it may change in place; gives what is written"""
    unit: bool = False


def _scaled(key: str, factor: float) -> Callable[[Arrays, np.random.Generator], Arrays]:
    def change(arrays: Arrays, _: np.random.Generator) -> Arrays:
        return arrays | {key: np.asarray(arrays[key], dtype=np.float64) * factor}

    return change


def _stamps(change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Callable[..., Arrays]:
    def changed(arrays: Arrays, random: np.random.Generator) -> Arrays:
        t = np.array(arrays["time_stamps"], dtype=np.float64).reshape(-1)
        return arrays | {"time_stamps": change(t, random)[None, :]}

    return changed


def _six_figures(t: np.ndarray, _: np.random.Generator) -> np.ndarray:
    return np.array([float(f"{stamp:.6g}") for stamp in t + EPOCH])


def _single_precision(t: np.ndarray, _: np.random.Generator) -> np.ndarray:
    return (t + EPOCH).astype(np.float32).astype(np.float64)


def _stray(value: float) -> Callable[[np.ndarray, np.random.Generator], np.ndarray]:
    """One stamp of another clock; at the first frame, which leaves the stamps in order, in half of the cases."""

    def change(t: np.ndarray, random: np.random.Generator) -> np.ndarray:
        t = t + EPOCH
        end = 0 if value < EPOCH else -1
        t[end if random.random() < 0.5 else random.integers(len(t))] = value
        return t

    return change


def _repeated(t: np.ndarray, random: np.random.Generator) -> np.ndarray:
    k = int(random.integers(1, len(t)))
    t[k] = t[k - 1]
    return t


def _without_a_key(arrays: Arrays, random: np.random.Generator) -> Arrays:
    keys = sorted(set(arrays) - {"ground_truth", "landmarks"})
    lost = keys[int(random.integers(len(keys)))]
    return {key: array for key, array in arrays.items() if key != lost}


def _without_a_column(arrays: Arrays, random: np.random.Generator) -> Arrays:
    key = ("time_stamps", "linear_velocity", "angular_velocity", "features")[int(random.integers(4))]
    return arrays | {key: np.asarray(arrays[key])[..., :-1]}


RECORDING: tuple[Mutation, ...] = (
    *(
        Mutation(f"{name} times 1e{power}", _scaled(key, 10.0**power), unit=True)
        for name, key in (("stamps", "time_stamps"), ("velocities", "linear_velocity"), ("baseline", "b"))
        for power in POWERS
    ),
    Mutation("angular rates in degrees", _scaled("angular_velocity", 180.0 / np.pi), unit=True),
    Mutation("stamps of an epoch in ns", _stamps(lambda t, _: 1e9 * (t + EPOCH)), unit=True),
    Mutation("stamps of six figures", _stamps(_six_figures)),
    Mutation("stamps in single precision", _stamps(_single_precision)),
    Mutation("a stray zero stamp", _stamps(_stray(0.0))),
    Mutation("a stray stamp in ns", _stamps(_stray(1e9 * EPOCH))),
    Mutation("a repeated stamp", _stamps(_repeated)),
    Mutation("a key is missing", _without_a_key),
    Mutation("a column is missing", _without_a_column),
)
"""of the arrays of our npz"""


def _every(column: int, text: Callable[[float], str]) -> Callable[[Rows, np.random.Generator], Rows]:
    def change(rows: Rows, _: np.random.Generator) -> Rows:
        for row in rows:
            row[column] = text(float(row[column]))
        return rows

    return change


def _times(factor: float) -> Callable[[float], str]:
    return lambda stamp: f"{factor * stamp:.17g}"


def _w_first(rows: Rows, _: np.random.Generator) -> Rows:
    return [[*row[:4], row[7], *row[4:7]] for row in rows]


def _one_zero(rows: Rows, random: np.random.Generator) -> Rows:
    rows[0 if random.random() < 0.5 else int(random.integers(len(rows)))][0] = "0"
    return rows


def _one_twice(rows: Rows, random: np.random.Generator) -> Rows:
    k = int(random.integers(len(rows)))
    return [*rows[: k + 1], list(rows[k]), *rows[k + 1 :]]


def _short_rows(rows: Rows, random: np.random.Generator) -> Rows:
    if random.random() < 0.5:
        return [row[:-1] for row in rows]
    k = int(random.integers(len(rows)))
    return [row[:-1] if i == k else row for i, row in enumerate(rows)]


TRAJECTORY: tuple[Mutation, ...] = (
    *(Mutation(f"stamps times 1e{power}", _every(0, _times(10.0**power)), unit=True) for power in POWERS),
    Mutation("stamps of six figures", _every(0, lambda stamp: f"{stamp:.6g}")),
    Mutation("stamps in single precision", _every(0, lambda stamp: repr(float(np.float32(stamp))))),
    Mutation("a stray zero stamp", _one_zero),
    Mutation("quaternions with w first", _w_first),
    Mutation("a repeated pose", _one_twice),
    Mutation("a column is missing", _short_rows),
)
"""of the rows of a TUM file, as texts; the reference keeps its own"""
