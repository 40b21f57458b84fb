"""Waiting times of users, as ratios within one run: `python -m benchmarks.latency --only compare-3000 --runs 9`.

Two sides take turns, A B A B, so that a machine that gets slower does so for both; a ratio is of two neighbors. A side
is a number of commands, one after another, in processes of their own. The peers are evo, `--help`, and revision
179d7a6 of this project (`benchmarks/installed_revision.py`). What is held to the wanted ratio is the time by
the clock on the wall; processor time, all processes of a command together, stands beside it and is disturbed least.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import click
import numpy as np

from fgbaseline import data

from . import docs_table
from .claim_table import Row, table
from .installed_revision import BEFORE, ROOT, NoHistoryError, environment
from .metrics import drive

PLACE = Path("docs/performance.md")
SHORT, MIDDLE, LONG = 600, 3000, 100_000
"""poses"""
JOBS = 250
"""jobs of a bench: workers are busy with more of them in the same way"""
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}


class Taken(NamedTuple):
    """Seconds of one side of a comparison."""

    wall: float
    processor: float


Side = Callable[[], Taken]


@dataclass(frozen=True)
class Waiting:
    """A comparison: what is timed, the peer, and the largest ratio of both that is wanted."""

    name: str
    """by which it is selected"""
    claim: str
    most: float
    sides: Callable[["Place"], tuple[Side, Side]]
    """ours and the peer's"""


@dataclass(frozen=True)
class Place:
    """A folder with the files and environments that the comparisons need, made when they are first asked for."""

    folder: Path
    recording: Path | None = None

    @cached_property
    def today(self) -> Path:
        """Commands of the working tree, as installed."""
        return environment(self.folder, None) / "bin"

    @cached_property
    def before(self) -> Path:
        """Commands of the revision that today's is compared with. Raises NoHistoryError."""
        return environment(self.folder, BEFORE) / "bin"

    @cached_property
    def evo(self) -> Path:
        """Commands of evo, from an environment with compiled bytecode like ours."""
        python = self.today / "python"
        uv = Path(sys.executable).with_name("uv")
        installed: list[str | Path] = [uv, "pip", "install", "--quiet", "--compile-bytecode", "--python", python, "evo"]
        subprocess.run(installed, check=True)
        return self.today

    def pair(self, poses: int) -> tuple[Path, Path]:
        """TUM files of a drive and of an estimate that drifts away from it."""
        paths = self.folder / f"reference-{poses}.tum", self.folder / f"estimate-{poses}.tum"
        if not paths[0].exists():
            driven = drive(poses)
            for path, world_T_imu in zip(paths, (driven.reference, driven.estimate), strict=True):
                data.write_tum(path, driven.t, world_T_imu)
        return paths

    def broken(self, name: str, text: str) -> Path:
        """A file of this content, or a folder with it as its `summary.json`."""
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path


def command(*commands: Iterable[str | Path], cwd: Path | None = None, code: int = 0) -> Side:
    """The side of these commands, one after another; raises RuntimeError where one does not exit with `code`."""

    def run() -> Taken:
        start, before = time.perf_counter(), os.times()
        for words in commands:
            ended = subprocess.run(
                [str(word) for word in words],
                cwd=cwd,
                env=os.environ | ONE_THREAD,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
            )
            if ended.returncode != code:
                raise RuntimeError(f"{words} exits with {ended.returncode}: {ended.stderr.decode()[-500:]}")
        after = os.times()
        processor = after.children_user + after.children_system - before.children_user - before.children_system
        return Taken(time.perf_counter() - start, processor)

    return run


def both(words: Callable[[Path, str], list[str | Path]]) -> Callable[[Place], tuple[Side, Side]]:
    """Sides that run the same words with today's commands and with those of the earlier revision."""
    return lambda place: (command(words(place.today, "today")), command(words(place.before, BEFORE)))


def _compare(place: Place, poses: int) -> list[str | Path]:
    return [place.today / "fgbaseline", "compare", *place.pair(poses)]


def _against_ape(place: Place) -> tuple[Side, Side]:
    return command(_compare(place, MIDDLE)), command([place.evo / "evo_ape", "tum", *place.pair(MIDDLE), "-a"])


def _against_ape_and_rpe(place: Place) -> tuple[Side, Side]:
    ape: list[str | Path] = [place.evo / "evo_ape", "tum", *place.pair(LONG), "-a"]
    rpe: list[str | Path] = [place.evo / "evo_rpe", "tum", *place.pair(LONG), "-d", "1", "-u", "m", "--all_pairs"]
    return command(_compare(place, LONG)), command(ape, rpe)


def _refused(arguments: Callable[[Place], list[str | Path]]) -> Callable[[Place], tuple[Side, Side]]:
    def sides(place: Place) -> tuple[Side, Side]:
        ours = command([place.today / "fgbaseline", *arguments(place)], code=2)
        return ours, command([place.today / "fgbaseline", "--help"])

    return sides


def _page(place: Place) -> tuple[Side, Side]:
    sides = []
    for commands, name in ((place.today, "today"), (place.before, "before")):
        out = place.folder / f"comparison-{name}"
        words: list[str | Path] = [commands / "fgbaseline", "compare", *place.pair(SHORT), "--out", out, "--force"]
        sides.append(command(words))
    return sides[0], sides[1]


def _beside(place: Place) -> tuple[Side, Side]:
    """Stages of a run but the estimators', each by the benchmark of its own revision."""

    recording = place.recording
    assert recording is not None

    def side(commands: Path) -> Side:
        source = commands.parents[1] / "source"
        names = ("run_overhead", "rest_of_run")  # today's, and that of `BEFORE`
        name = next(name for name in names if (source / "benchmarks" / f"{name}.py").is_file())
        words: list[str | Path] = [commands / "python", "-m", f"benchmarks.{name}", recording, "--stages"]

        def run() -> Taken:
            text = subprocess.run(
                [str(word) for word in words], cwd=source, stdout=subprocess.PIPE, check=True, text=True
            ).stdout
            stages = {name: seconds for name, seconds in json.loads(text).items() if not name.startswith("solving")}
            return Taken(sum(stages.values()), float("nan"))

        return run

    return side(place.today), side(place.before)


SOLVED = """
import json, sys, time
from fgbaseline import data, smoother
try:
    from fgbaseline.diagnosis import calibrated
except ImportError:  # where it was before
    from fgbaseline.data import calibrated
problem = calibrated(data.read(sys.argv[1]))
start = time.perf_counter(), time.process_time()
smoother.isam2(problem)
print(json.dumps([time.perf_counter() - start[0], time.process_time() - start[1]]))
"""
"""seconds of `isam2` alone, on the problem that each revision makes of a recording"""


def _isam2(place: Place) -> tuple[Side, Side]:
    def side(commands: Path) -> Side:
        words = [str(commands / "python"), "-c", SOLVED, str(place.recording)]

        def run() -> Taken:
            text = subprocess.run(
                words, cwd=place.folder, env=os.environ | ONE_THREAD, stdout=subprocess.PIPE, check=True, text=True
            ).stdout
            return Taken(*json.loads(text))

        return run

    return side(place.today), side(place.before)


def _within(module: str, ours: str, peer: str, *options: str) -> Callable[[Place], tuple[Side, Side]]:
    """Sides that one process of today's measures, and prints as JSON under these keys."""

    def sides(_: Place) -> tuple[Side, Side]:
        taken = dict[str, float]()

        def run() -> Taken:
            words = [sys.executable, "-m", module, *options]
            text = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, check=True, text=True).stdout
            taken.update(json.loads(text))
            return Taken(taken[ours], float("nan"))

        return run, lambda: Taken(taken[peer], float("nan"))

    return sides


def _broken(name: str) -> Callable[[Place], Path]:
    files = {
        "words.tum": "# timestamp tx ty tz qx qy qz qw\n0.0 0 0 0 0 0 0 1\n0.1 here there 0 0 0 0 1\n",
        "run/summary.json": '{"schema": "fgbaseline/summary/1", "estimators": {"ekf": ',
        "limits.toml": "[ate\nrmse = 1\n",
    }
    return lambda place: place.broken(name, files[name])


_words, _summary, _limits = map(_broken, ("words.tum", "run/summary.json", "limits.toml"))
REFUSED = {
    "compare, a missing file": lambda p: ["compare", p.pair(SHORT)[0], p.folder / "missing.tum"],
    "compare, words in place of numbers": lambda p: ["compare", p.pair(SHORT)[0], _words(p)],
    "check, a missing folder": lambda p: ["check", p.folder / "missing", "--limits", _limits(p)],
    "check, a broken summary.json": lambda p: ["check", _summary(p).parent, "--limits", _limits(p)],
    "figures, a missing folder": lambda p: ["figures", p.folder / "missing"],
    "figures, a broken summary.json": lambda p: ["figures", _summary(p).parent],
}
ALL = (
    Waiting("compare-3000", f"`compare` of {MIDDLE:,} poses, to `evo_ape tum -a`", 1.0, _against_ape),
    Waiting(
        "compare-100000",
        f"`compare` of {LONG:,} poses, to `evo_ape` and `evo_rpe -d 1 -u m --all_pairs` together",
        0.2,
        _against_ape_and_rpe,
    ),
    *(
        Waiting(f"refused: {name}", f"`{name.replace(',', '`,', 1)}, to `--help`", 3.0, _refused(words))
        for name, words in REFUSED.items()
    ),
    Waiting("page", f"`compare --out` with page and figures, {SHORT} poses, to {BEFORE}", 0.4, _page),
    Waiting(
        "import-compare",
        f"`import fgbaseline.compare`, to {BEFORE}",
        0.3,
        both(lambda commands, _: [commands / "python", "-c", "import fgbaseline.compare"]),
    ),
    Waiting(
        "import-comparison",
        f"`from fgbaseline.reports.comparison import compare`, to {BEFORE}",
        0.3,
        both(lambda commands, _: [commands / "python", "-c", "from fgbaseline.reports.comparison import compare"]),
    ),
    Waiting(
        "joint",
        "`joint-ekf` at 300 features a frame, to one Cholesky, one triangular solve and one symmetric update each",
        1.5,
        _within("benchmarks.joint_update", "frames", "algebra"),
    ),
    Waiting(
        "bench",
        f"{JOBS:,} short runs by `bench` on two workers of Dask, to the runs alone",
        1.05,
        _within("benchmarks.bench_overhead", "workers", "own", "--runs", str(JOBS)),
    ),
    Waiting("run", f"`run 03.npz` beside its estimators, to {BEFORE}", 0.5, _beside),
    Waiting("isam2", f"`isam2` on 03.npz, to {BEFORE}", 0.65, _isam2),
)
NEED_RECORDING = ("run", "isam2")


def measured(waiting: Waiting, place: Place, runs: int) -> Row:
    """The ratio of its two sides over so many pairs of runs, the first pair not counted."""
    wanted = f"at most {waiting.most:g} times"
    try:
        ours, peer = waiting.sides(place)
    except NoHistoryError as error:
        return Row(waiting.claim, wanted, f"not measured: {error}", "", None)
    pairs = [(ours(), peer()) for _ in range(runs + 1)][1:]
    seconds = np.array(pairs)  # (runs, 2, 2): ours and the peer's, wall and processor
    ratios = seconds[:, 0] / seconds[:, 1]
    wall, processor = np.median(ratios, axis=0)
    spread = f"{ratios[:, 0].min():.2f} to {ratios[:, 0].max():.2f}"
    own = np.median(seconds[:, 0, 0])
    beside = "" if np.isnan(processor) else f", processor {processor:.2f}"
    return Row(waiting.claim, wanted, f"{wall:.2f} times ({own:.2f} s{beside})", spread, bool(wall <= waiting.most))


def rows(place: Place, runs: int, only: str = "") -> Iterator[Row]:
    """Every comparison whose name has `only` in it."""
    for waiting in ALL:
        if only in waiting.name and (waiting.name not in NEED_RECORDING or place.recording is not None):
            yield measured(waiting, place, runs)


@click.command()
@click.option("--only", default="", help="Comparisons whose name has this in it.")
@click.option("--runs", type=click.IntRange(min=1), default=7, show_default=True)
@click.option(
    "--recording",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="03.npz, for what a run takes beside its estimators, and isam2; both left out without it.",
)
@click.option("--write", is_flag=True, help="Write docs/performance.md between its marks.")
def main(only: str, runs: int, recording: Path | None, write: bool) -> None:
    """Time what people wait for beside its peers."""
    with TemporaryDirectory(prefix="fgbaseline-") as folder:
        place = Place(Path(folder), None if recording is None else recording.resolve())
        found = []
        for row in rows(place, runs, only):
            found.append(row)
            click.echo(f"{row.claim}: {row.ratio_or_value} ({row.spread})", err=True)
    day = time.strftime("%Y-%m-%d")
    note = f"{runs} pairs of runs on {day}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the end."
    text = f"{note}\n\n{table(found)}"
    click.echo(text)
    if write:
        docs_table.write(PLACE, "waiting", [text])


if __name__ == "__main__":
    main()
