"""Mutated recordings and trajectories through `run`, `diagnose`, `compare` and `check`; see benchmarks/mutated.py."""

import json
import math
import os
import resource
import signal
import subprocess
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jinja2
import numpy as np
import pandas as pd
import pytest

from fgbaseline import data, diagnosis, ekf
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.reports import html
from fgbaseline.reports.html import page
from fgbaseline.reports.html.page import environment

from .commands import fgbaseline
from .empty_figures import figures_left_out
from .mutations import EPOCH, RECORDING, TRAJECTORY, Mutation, Rows

SECONDS = 60
"""of a processor that a command may take: a busy machine is no failure"""
SAME = 0.02
"""relative: by so much an error may differ from that of the good file"""
LEFT_OUT = 1
"""poses that a comparison may leave out: the good file is compared without them then"""
LIMITS = """\
[[limit]]
metric = "ate.rmse"
estimators = "{estimator}"
at_most = 0.5
"""
CLEAN: dict[str, Any] = {"features_per_frame": 15.0, "wrong_share": 0.0, "moving_share": 0.0, "farthest": 60.0}
"""nothing that `diagnose` would find"""


@dataclass(frozen=True)
class Form:
    """How much a case holds. All forms run the same mutations and commands and have the same limit of time."""

    frames: int
    """of a recording, at 10 frames/s"""
    paths: tuple[str, ...]
    """of the recordings, in turn; each base has a seed of its own"""
    share_of_runs: float
    """of the recordings, taken at random: the others are only diagnosed"""
    share_of_isam2: float
    """of the runs, taken at random: the others have dead reckoning alone, which `check` trusts in no case"""
    figures: bool
    """whether runs and comparisons have them"""


FULL = Form(120, ("town", "handheld", "loop"), 1.0, 1.0, figures=True)
FAST = Form(32, ("town", "handheld", "highway"), 1 / 3, 0.3, figures=False)
"""about a second of a busy processor, where `FULL` takes six"""


@dataclass(frozen=True)
class Ended:
    """What became of a case."""

    mutation: str
    codes: dict[str, int | None]
    """exit code by command; None where it was killed after its minute"""
    seconds: dict[str, float] = field(default_factory=dict)
    """of a processor, by command"""
    violations: list[str] = field(default_factory=list)
    repaired: bool = False
    """a trajectory was compared with the errors of the good file"""


@lru_cache(4)
def good_recording(base: int, form: Form = FULL) -> dict[str, Any]:
    """The arrays of an unmutated recording, with truth."""
    path = form.paths[base % len(form.paths)]
    sequence = simulate(Simulation(duration=form.frames / 10.0, frame_rate=10.0, path=path, seed=base + 3, **CLEAN))
    with TemporaryDirectory() as folder:
        data.write_npz(sequence, Path(folder) / "a.npz")
        with np.load(Path(folder) / "a.npz") as arrays:
            return {key: arrays[key] for key in arrays.files}


@lru_cache(4)
def good_trajectory(base: int, form: Form = FULL) -> tuple[str, list[list[str]]]:
    """A reference as text of a TUM file, and the rows of an estimate of it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.npz"
        np.savez(path, **good_recording(base, form))
        sequence = data.read(path)
        assert sequence.truth is not None
        estimate = ekf.dead_reckoning(diagnosis.calibrated(sequence)).world_T_imu
        start = np.eye(4)
        start[:3, 3] = 3.0, -2.0, 1.0
        texts = []
        for poses in (sequence.truth.world_T_imu, estimate):
            data.write_tum(path, sequence.t + EPOCH, start @ poses)
            texts.append(path.read_text())
    return texts[0], [line.split() for line in texts[1].splitlines() if not line.startswith("#")]


def case(number: int, form: Form = FULL, *, drawing: bool = False) -> Ended:
    """Runs one case; recordings and trajectories in turn. Without `drawing`, figures are empty."""
    kind = (_recording, _trajectory)[number % 2]
    mutations = (RECORDING, TRAJECTORY)[number % 2]
    turn = number // 2
    mutation, base = mutations[turn % len(mutations)], turn // len(mutations)
    with TemporaryDirectory() as folder:
        return kind(mutation, base, np.random.default_rng(number), _Commands(form, Path(folder), drawing))


def _recording(mutation: Mutation, base: int, random: np.random.Generator, commands: "_Commands") -> Ended:
    form, folder = commands.form, commands.folder
    estimators = ["dead-reckoning"]
    chance_of_run, chance_of_isam2 = random.spawn(1)[0].random(2)
    if chance_of_isam2 < form.share_of_isam2:
        estimators.append("isam2")
    good = {key: np.array(array) for key, array in good_recording(base, form).items()}
    np.savez(folder / "drive.npz", **mutation.change(good, random))
    (folder / "limits.toml").write_text(LIMITS.format(estimator=estimators[-1]))
    ended = Ended(mutation.name, {})
    call = partial(commands.call, ended)
    if call("diagnose", "drive.npz") == 0 and mutation.unit:
        ended.violations.append("diagnose passes")
    if chance_of_run >= form.share_of_runs:
        return ended
    ran = call("run", "drive.npz", "--estimators", ",".join(estimators), "--out", "run") in (0, 1)
    if ran and call("check", "run", "--limits", "limits.toml") == 0 and mutation.unit:
        ended.violations.append("check passes")
    return ended


def _trajectory(mutation: Mutation, base: int, random: np.random.Generator, commands: "_Commands") -> Ended:
    truth, rows = good_trajectory(base, commands.form)
    folder = commands.folder
    (folder / "truth.tum").write_text(truth)
    changed = mutation.change([list(row) for row in rows], random)
    (folder / "mine.tum").write_text("".join(" ".join(row) + "\n" for row in changed))
    ended = Ended(mutation.name, {})
    code = commands.call(ended, "compare", "truth.tum", "mine.tum", "--out", "compared")
    if code == 0:
        judged = slice(1 if _is_in_doubt(folder / "compared") else None)  # positions alone where an order is in doubt
        stamps = set(pd.read_csv(folder / "compared" / "series" / "mine.csv")["t"])
        kept = [row for row in rows if float(row[0]) in stamps]
        alike = len(rows) - LEFT_OUT <= len(kept) < len(rows)
        good = _errors(truth, kept, commands.form) if alike else good_distance(base, commands.form)
        return _judged(ended, _compared_errors(folder / "compared")[judged], good[judged])
    return ended


def _judged(ended: Ended, errors: list[float], good: list[float]) -> Ended:
    same = bool(np.allclose(errors, good, rtol=SAME, atol=0.0))
    if not same:
        said = ["(" + ", ".join(f"{error:.4g}" for error in some) + ")" for some in (errors, good)]
        ended.violations.append(f"compare passes with errors of {said[0]}, those of the good file are {said[1]}")
    return replace(ended, repaired=same)


@dataclass(frozen=True)
class _Commands:
    """Runs the commands of a case in its folder."""

    form: Form
    folder: Path
    drawing: bool

    def call(self, ended: Ended, *arguments: str) -> int | None:
        """The exit code of a command, which the case remembers, with its time and what it violates."""
        verb, before = arguments[0], _seconds_of_children()
        if not self.form.figures:
            _templates()
        drawing = self.drawing or not self.form.figures
        waiting = 30.0 * SECONDS
        code: int | None = None
        try:
            result = fgbaseline(*arguments, cwd=self.folder, drawing=drawing, first=self._limited, seconds=waiting)
        except subprocess.TimeoutExpired:
            ended.violations.append(f"{verb} waits for more than {waiting:g} s")
        else:
            code = result.returncode
            if code == -signal.SIGXCPU:
                ended.violations.append(f"{verb} takes more than {SECONDS} s")
                code = None
            elif code not in (0, 1, 2) or "Traceback" in result.stderr:
                last = result.stderr.strip().splitlines()[-1:] or [""]
                ended.violations.append(f"{verb} ends with {code}: {last[0][:160]}")
        ended.codes[verb] = code
        ended.seconds[verb] = _seconds_of_children() - before
        return code

    def _limited(self) -> None:
        """Limits this fork; without figures it leaves them out, takes one core, and compiles no template."""
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 5))
        if not self.form.figures:
            cores = sorted(os.sched_getaffinity(0))
            os.sched_setaffinity(0, {cores[os.getpid() % len(cores)]})
            patch = pytest.MonkeyPatch()
            figures_left_out(patch)
            patch.setattr(page, "environment", _templates)


@cache
def _templates() -> jinja2.Environment:
    """The environment of the pages with every template compiled, which a command does anew."""
    compiled = environment()
    for file in files(html).iterdir():
        if file.name.endswith(".html"):
            compiled.get_template(file.name)
    return compiled


def _seconds_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _compared_errors(folder: Path) -> list[float]:
    """RMSE of the absolute error of a trajectory in position, m, and orientation, degrees; NaN where it has none."""
    read = json.loads((folder / "comparison.json").read_text())["estimates"]["mine"]
    found = [((read.get(what) or {}).get("rmse") or {}).get("value") for what in ("translation", "rotation_deg")]
    return [math.nan if value is None else float(value) for value in found]


def _is_in_doubt(folder: Path) -> bool:
    """Whether the comparison reports that nothing shows the order of quaternions, as on the nearly straight base."""
    read = json.loads((folder / "comparison.json").read_text())["estimates"]["mine"]
    return any("--quaternion settles it" in remark for remark in read["remarks"])


@lru_cache(4)
def good_distance(base: int, form: Form = FULL) -> list[float]:
    """The errors of an unmutated trajectory, m and degrees."""
    return _errors(*good_trajectory(base, form), form)


def _errors(truth: str, rows: Rows, form: Form) -> list[float]:
    with TemporaryDirectory() as folder:
        (Path(folder) / "truth.tum").write_text(truth)
        (Path(folder) / "mine.tum").write_text("".join(" ".join(row) + "\n" for row in rows))
        commands = _Commands(form, Path(folder), drawing=False)
        commands.call(Ended("none", {}), "compare", "truth.tum", "mine.tum", "--out", "compared")
        return _compared_errors(Path(folder) / "compared")
