"""Growth of time and memory with frames, features a frame and landmarks: `python -m benchmarks.growth`.

Every estimator answers in a process of its own, after a small problem that has brought all imports. A size that would
take it too long, going by the sizes before, is left out, and said to be.
"""

import tempfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np

from fgbaseline import data, diagnosis
from fgbaseline.data import Problem, Status, find_estimator
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.diagnosis import AsRecordedSettings, NoiseSettings

from .subprocess_cost import StoppedError, apart, forget_peak, memory, peak_memory

ESTIMATORS = ("dead-reckoning", "ekf", "joint-ekf", "isam2", "fixed-lag", "batch")
PATIENCE = 100.0
"""processor seconds: a size that would take longer is left out"""
LAST_STRAW = 250
"""processor seconds, after which a process is stopped that takes longer than was expected"""
WARM_FRAMES = 12
LEAST_SECONDS, LEAST_MB = 0.02, 2.0
"""s; below it a figure measures the process and not the problem"""


@dataclass(frozen=True, slots=True)
class Axis:
    """Quantity that is varied; the others are fixed."""

    name: str
    held: str
    drives: tuple[Simulation, ...]


@dataclass(frozen=True, slots=True)
class Point:
    """One estimator on one problem."""

    axis: str
    estimator: str
    size: float
    seconds: float | None
    """CPU time; None where it was left out"""
    megabytes: float | None
    """held at most, beyond what the process held before"""
    spent: float = 0.0
    """processor seconds, the answer of isam2 included from which batch starts"""
    why: str = ""
    """reason for which it was left out; empty if it was run"""


def axes(quick: bool = False) -> tuple[Axis, ...]:
    """The three, from small to large. `quick` for trying."""
    frames = (50, 100, 200) if quick else (300, 1000, 3000, 10_000)
    features = (10, 20, 40) if quick else (20, 40, 80, 160, 300)
    lengths = (28.0, 14.0, 7.0) if quick else (56.0, 28.0, 14.0, 7.0, 3.5)
    few, some = (60, 100) if quick else (150, 200)
    return (
        Axis("frames", "20 features a frame", tuple(_drive(n, 20.0) for n in frames)),
        Axis("features a frame", f"{few} frames", tuple(_drive(few, float(n)) for n in features)),
        Axis(
            "landmarks",
            f"{some} frames with 30 features, tracks ever shorter",
            tuple(replace(_drive(some, 30.0), track_length=length) for length in lengths),
        ),
    )


def _drive(frames: int, features: float) -> Simulation:
    return Simulation(duration=frames / 10.0, features_per_frame=features, seed=1)


def measured(quick: bool = False) -> list[Point]:
    """Every estimator on every size of every axis, the smallest first."""
    points: list[Point] = []
    with tempfile.TemporaryDirectory() as folder:
        for axis in axes(quick):
            for number, drive in enumerate(axis.drives):
                problem, place = posed(drive), Path(folder) / f"{axis.name} {number}"
                place.mkdir()
                data.write_problem(problem, place)
                size = _size(axis.name, problem)
                points += [_point(axis, name, size, place, points) for name in ESTIMATORS]
                times = (
                    f"{p.estimator} {p.seconds:.2g} s" for p in points[-len(ESTIMATORS) :] if p.seconds is not None
                )
                click.echo(f"{size:.0f} {axis.name}: {', '.join(times)}", err=True)
    return points


def posed(drive: Simulation) -> Problem:
    """The problem of a drive with the noise that it has: nothing is diagnosed."""
    noise = NoiseSettings(drive.sigma_pixel, drive.sigma_linear, drive.sigma_angular)
    return diagnosis.calibrated(simulate(drive), settings=AsRecordedSettings(noise, shift=Shift.AFTER))


def _size(axis: str, problem: Problem) -> float:
    o = problem.observations()
    sizes = {"frames": problem.n_frames, "features a frame": len(o) / problem.n_frames}
    return float(sizes.get(axis, len(problem.features)))


def _point(axis: Axis, name: str, size: float, place: Path, points: Iterable[Point]) -> Point:
    before = [p for p in points if (p.axis, p.estimator) == (axis.name, name)]
    expected = _expected(before, size)
    if expected > PATIENCE:
        return Point(axis.name, name, size, None, None, why=f"about {expected:,.0f} s expected")
    try:
        took = apart("benchmarks.growth:solve", name, str(place), limit=LAST_STRAW)
    except StoppedError:
        return Point(axis.name, name, size, None, None, why=f"stopped after {LAST_STRAW} s")
    return Point(axis.name, name, size, took.answer["seconds"], took.answer["megabytes"], took.answer["spent"])


def _expected(before: Iterable[Point], size: float) -> float:
    """Seconds, extrapolated by the power of the last two sizes, at least proportional; 0 where nothing was tried."""
    tried = list(before)
    known = [(p.size, p.spent) for p in tried if not p.why]
    if not known:
        return float("inf") if tried else 0.0
    (n, seconds), power = known[-1], 1.0
    if len(known) > 1:
        m, earlier = known[-2]
        power = max(power, float(np.log(seconds / earlier) / np.log(n / m)))
    return float(seconds * (size / n) ** power)


def solve(name: str, place: str) -> dict[str, float]:
    """Work of a separate process: one answer, after a small one; of batch, the time without iSAM2's run."""
    estimator, given = find_estimator(name), {}
    problem = data.read_problem(place)
    estimator(posed(_drive(WARM_FRAMES, 20.0)), None)
    forget_peak()
    held, start = memory(), time.process_time()
    if name == "batch":
        given = {"given": {"isam2": find_estimator("isam2")(problem, None)}}
    begin = time.process_time()
    estimate = estimator(problem, None, **given)
    end = time.process_time()
    if estimate.status is Status.FAILED:
        raise RuntimeError(f"{name} failed: {estimate.reason}")
    return {"seconds": end - begin, "spent": end - start, "megabytes": peak_memory() - held}


def exponent(sizes: Iterable[float], values: Iterable[float], least: float) -> float:
    """The slope of a line through the logarithms, where at least three values exceed `least`; else NaN."""
    pairs = np.array([(x, y) for x, y in zip(sizes, values, strict=True) if y > least])
    if len(pairs) < 3:
        return float("nan")
    return float(np.polyfit(np.log(pairs[:, 0]), np.log(pairs[:, 1]), 1)[0])


def of(points: Iterable[Point], axis: str, estimator: str) -> list[Point]:
    """The points of one line."""
    return [p for p in points if (p.axis, p.estimator) == (axis, estimator)]


def tables(points: list[Point], axes_measured: Iterable[Axis]) -> str:
    """Markdown: for each axis seconds and megabytes of every size, and the exponents."""
    return "\n\n".join(_table(axis, points) for axis in axes_measured)


def _table(axis: Axis, points: list[Point]) -> str:
    sizes = sorted({p.size for p in points if p.axis == axis.name})
    head = " | ".join(f"{size:,.0f}" for size in sizes)
    lines = [f"Against {axis.name} ({axis.held}):", "", f"| estimator | {head} | time ~ | memory ~ |"]
    lines.append("|" + "---|" * (len(sizes) + 3))
    for name in ESTIMATORS:
        line = of(points, axis.name, name)
        powers = exponents(line)
        cells = [*(_cell(p) for p in line), *(_power(powers[unit]) for unit in ("seconds", "megabytes"))]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def exponents(line: list[Point]) -> Mapping[str, float]:
    """Exponents of time and memory along one line."""
    there = [(p.size, p.seconds, p.megabytes) for p in line if p.seconds is not None and p.megabytes is not None]
    sizes = [size for size, _, _ in there]
    return {
        "seconds": exponent(sizes, [seconds for _, seconds, _ in there], LEAST_SECONDS),
        "megabytes": exponent(sizes, [megabytes for _, _, megabytes in there], LEAST_MB),
    }


def _cell(point: Point) -> str:
    if point.seconds is None or point.megabytes is None:
        return f"left out: {point.why}"
    seconds = f"{point.seconds:.2g}" if point.seconds < 10.0 else f"{point.seconds:.0f}"
    return f"{seconds} s, {point.megabytes:.0f} MB"


def _power(value: float) -> str:
    return f"n^{value:.2f}" if np.isfinite(value) else "-"


@click.command()
@click.option("--quick", is_flag=True, help="Small sizes, for trying.")
@click.option("--figure", type=click.Path(dir_okay=False, path_type=Path), help="PNG to write.")
def main(quick: bool, figure: Path | None) -> None:
    """Print the tables."""
    points = measured(quick)
    click.echo(tables(points, axes(quick)))
    if figure is not None:
        from .growth_figure import drawn

        figure.write_bytes(drawn(points))


if __name__ == "__main__":
    main()
