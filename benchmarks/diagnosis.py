"""Hit rate of the diagnosis on simulated recordings with known faults: `python benchmarks/diagnosis.py`.

Seed k has the k-th of the 24 axis conventions for its angular velocity and another for its linear velocity, a bias and
a delay of its own. The table is in docs/diagnosis.md.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.diagnosis import Diagnosis, diagnose, findings_of

RATE = 10.0
"""frames a second"""
BIAS, NEAR = 0.001, 0.2
"""rad/s and frames: how near is right"""
CARS = ("town", "loop", "highway")


@dataclass(frozen=True)
class Recording:
    """A path, a seed, and the noise of the gyroscope."""

    path: Any
    seed: int
    duration: float
    sigma_angular: float


@dataclass(frozen=True)
class Faults:
    """Faults that a recording was given."""

    angular: str
    linear: str
    bias: np.ndarray
    offset: float


def faulty(recording: Recording) -> tuple[Diagnosis, Faults]:
    """A diagnosed recording whose velocities are in other axes, biased and late."""
    rng = np.random.default_rng(recording.seed)
    faults = Faults(
        angular=AXIS_CONVENTIONS[recording.seed % 24],
        linear=AXIS_CONVENTIONS[(7 * recording.seed + 5) % 24],
        bias=rng.uniform(-0.03, 0.03, 3),
        offset=float(rng.uniform(-1.0 / RATE, 1.0 / RATE)),
    )
    settings = {
        "angular_axes": faults.angular,
        "linear_axes": faults.linear,
        "gyro_bias": tuple(faults.bias),
        "time_offset": faults.offset,
    }
    return diagnose(simulated(recording, **settings)), faults


def simulated(recording: Recording, **settings: Any) -> Any:
    return simulate(
        Simulation(
            path=recording.path,
            duration=recording.duration,
            frame_rate=RATE,
            seed=recording.seed,
            sigma_angular=recording.sigma_angular,
            **settings,
        )
    )


def hand_held(recording: Recording) -> dict[str, bool]:
    """Every axis is excited: all are identifiable."""
    d, faults = faulty(recording)
    return {
        "axes of both velocities": (d.angular.name, d.linear.name) == (faults.angular, faults.linear),
        "all axes said to be seen": all(d.angular.determined) and all(d.linear.determined),
    } | bias_and_delay(d, faults)


def car(recording: Recording) -> dict[str, bool]:
    """Finding that names the forward axis of the linear velocity; the others are not identifiable."""
    d, faults = faulty(recording)
    return {
        "axes of the angular velocity": d.angular.name == faults.angular,
        "forward axis of the linear velocity": d.linear.determined[0]
        and d.linear.name.split(",")[0] == faults.linear.split(",")[0],
        "y and z said not to be identifiable": not (d.linear.determined[1] or d.linear.determined[2]),
    } | bias_and_delay(d, faults)


def bias_and_delay(d: Diagnosis, faults: Faults) -> dict[str, bool]:
    error = np.abs(d.gyro_bias - faults.bias)
    near = abs(d.timing.shift - faults.offset) * RATE < NEAR
    return {
        f"bias within {BIAS:g} rad/s on every axis": bool(error.max() < BIAS),
        "bias within 4 standard errors": bool((error < 4.0 * d.gyro_bias_deviation).all()),
        f"delay within {NEAR:g} frames": near and d.timing.identifiable,
        f"delay within {NEAR:g} frames, or said not to be identifiable": near or not d.timing.identifiable,
    }


def clean(recording: Recording) -> dict[str, bool]:
    """Nothing is wrong; what is found all the same is counted by its code."""
    found = findings_of(diagnose(simulated(recording)))
    return {"nothing found": not found} | {f"({finding.code})": True for finding in found}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hand-held", type=int, default=100, help="seeds")
    parser.add_argument("--cars", type=int, default=48, help="seeds")
    parser.add_argument("--duration", type=float, default=60.0, help="s")
    parser.add_argument("--sigma-angular", type=float, default=0.01, help="rad/s, noise of the gyroscope")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--studies", default="hand-held,car,clean-hand-held,clean-car")
    options = parser.parse_args()

    def recordings(n: int, *paths: str) -> list[Recording]:
        return [Recording(paths[k % len(paths)], k, options.duration, options.sigma_angular) for k in range(n)]

    studies: dict[str, tuple[Callable[[Recording], dict[str, bool]], list[Recording]]] = {
        "hand-held": (hand_held, recordings(options.hand_held, "handheld")),
        "car": (car, recordings(options.cars, "town")),
        "clean-hand-held": (clean, recordings(options.hand_held, "handheld")),
        "clean-car": (clean, recordings(options.cars, *CARS)),
    }
    with ProcessPoolExecutor(options.jobs) as pool:
        for title in options.studies.split(","):
            study, each = studies[title]
            if each:
                answers = list(pool.map(study, each))
                print(f"\n{title}: {len(each)} recordings of {options.duration:g} s", flush=True)
                for line in shares(answers):
                    print(line, flush=True)


def shares(answers: list[dict[str, bool]]) -> Iterator[str]:
    """A line for each claim: how often it holds, and the seeds for which it does not."""
    for name in dict.fromkeys(name for answer in answers for name in answer):
        right = [bool(answer.get(name)) for answer in answers]
        few = name.startswith("(")
        seeds = [str(seed) for seed, holds in enumerate(right) if holds == few]
        note = f"  ({'' if few else 'not '}seeds {', '.join(seeds)})" if seeds and sum(right) != len(right) else ""
        yield f"  {sum(right):4d} of {len(right)}  {name}{note}"


if __name__ == "__main__":
    main()
