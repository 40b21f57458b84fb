"""Is a simulated drive like the real ones? `pytest -s tests/data/test_simulate_likeness.py` prints the table."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from fgbaseline.data.formats import read
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.geometry import disparity

CARS = [
    "03.npz",
    "ece276a_2020/0027.npz",
    *(f"utias/2011_09_26_drive_{n}_sync_KLT.mat" for n in ("0001", "0005", "0009", "0036")),
    "utias/2011_09_30_drive_0027_sync_KLT.mat",
]
HEAD = (
    "                        observations a frame      frames a track            depth, m\n"
    "                         mean    5 %   95 %   mean  25 %  50 %  75 %  95 %   5 %  25 %  50 %  75 %  95 %"
)
WIDTHS = (7, 7, 7, 7, 6, 6, 6, 6, 6, 6, 6, 6, 6)


def statistics(s: Sequence) -> list[float]:
    """Observations a frame (mean, 5 %, 95 %), track length (mean, quartiles, 95 %) and depth in m (5, 25, ... 95 %)."""
    frames = np.bincount(s.observations.frame, minlength=s.n_frames)
    length = s.observations.counts(s.n_landmarks)
    length = length[length > 0]
    d = disparity(s.observations.pixel)
    depth = s.camera.fu * s.camera.baseline / d[d > 0.5]
    return [
        frames.mean(),
        *np.percentile(frames, [5, 95]),
        length.mean(),
        *np.percentile(length, [25, 50, 75, 95]),
        *np.percentile(depth, [5, 25, 50, 75, 95]),
    ]


def line(name: str, numbers: list[float]) -> str:
    cells = (f"{x:>{w}.{1 if w > 6 else 0}f}" for x, w in zip(numbers, WIDTHS, strict=True))
    return f"{name:<22}" + "".join(cells)


def test_a_simulated_town_lies_among_the_real_recordings(recordings: Callable[[str], Path]) -> None:
    real = {name: statistics(read(recordings(name))) for name in CARS}
    towns = [statistics(simulate(Simulation(seed=seed))) for seed in range(10)]
    town = [float(x) for x in np.mean(towns, axis=0)]
    print("\n" + HEAD)
    for name, numbers in real.items():
        print(line(Path(name).stem[-22:], numbers))
    print(line("simulated, 10 seeds", town))
    lowest, highest = np.min(list(real.values()), axis=0), np.max(list(real.values()), axis=0)
    assert (town >= 0.9 * lowest).all()
    assert (town <= 1.1 * highest).all()
