"""How often the diagnosis is right, on simulated recordings whose faults are known: `python benchmarks/diagnosis.py`.

Seed k has the k-th of the 24 axis conventions for its angular velocity and another for its linear velocity, a bias and
a delay of its own. The table is in docs/diagnosis.md.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np

from fgbaseline.data import diagnose
from fgbaseline.data.diagnose import findings_of
from fgbaseline.data.simulate import AXIS_CONVENTIONS, Simulation, simulate

CLEAN = ("town", "loop", "highway", "handheld")
RATE = 10.0


def faulty(path: Any, seed: int, duration: float) -> dict[str, Any]:
    """What was found of one recording, right or wrong."""
    rng = np.random.default_rng(seed)
    angular, linear = AXIS_CONVENTIONS[seed % 24], AXIS_CONVENTIONS[(7 * seed + 5) % 24]
    bias, offset = rng.uniform(-0.03, 0.03, 3), float(rng.uniform(-0.1, 0.1))
    settings = {"angular_axes": angular, "linear_axes": linear, "gyro_bias": tuple(bias), "time_offset": offset}
    d = diagnose(simulate(Simulation(path=path, duration=duration, seed=seed, **settings)))
    error = np.abs(d.gyro_bias - bias)
    return {
        "angular axes": d.angular.name == angular,
        "linear axes": d.linear.name == linear,
        "forward axis": d.linear.name.split(",")[0] == linear.split(",")[0],
        "y and z said not to be identifiable": not (d.linear.seen[1] or d.linear.seen[2]),
        "bias within 0.001 rad/s": bool(error.max() < 0.001),
        "bias within 4 standard errors": bool((error < 4.0 * d.gyro_bias_deviation).all()),
        "delay identifiable": d.timing.identifiable,
        "delay within 0.2 frames": abs(d.timing.shift - offset) * RATE < 0.2,
        "delay within 0.2 frames, or said not to be identifiable": abs(d.timing.shift - offset) * RATE < 0.2
        or not d.timing.identifiable,
    }


def clean(path: Any, seed: int, duration: float) -> dict[str, Any]:
    found = findings_of(diagnose(simulate(Simulation(path=path, duration=duration, seed=seed))))
    return {"nothing found": not found} | {f"({finding.code})": True for finding in found}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=24)
    parser.add_argument("--duration", type=float, default=25.0)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    with ProcessPoolExecutor(options.jobs) as pool:
        studies: list[tuple[str, Any, tuple[str, ...]]] = [
            ("hand-held, faulty", faulty, ("handheld",)),
            ("car, faulty", faulty, ("town",)),
            ("clean", clean, CLEAN),
        ]
        for title, study, paths in studies:
            for path in paths:
                seeds = range(options.seeds if title != "clean" else max(1, options.seeds // 2))
                answers = list(pool.map(study, [path] * len(seeds), seeds, [options.duration] * len(seeds)))
                print(f"\n{title}: {path}, {len(seeds)} seeds of {options.duration:g} s", flush=True)
                for line in shares(answers):
                    print(line, flush=True)


def shares(answers: list[dict[str, Any]]) -> Iterator[str]:
    names = dict.fromkeys(name for answer in answers for name in answer)
    for name in names:
        right = sum(bool(answer.get(name)) for answer in answers)
        yield f"  {right:4d} of {len(answers)}  {name}"


if __name__ == "__main__":
    main()
