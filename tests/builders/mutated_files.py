"""Mutated recordings and trajectories through `run`, `diagnose`, `compare` and `check`; see benchmarks/mutated.py."""

import json
import math
import resource
import signal
import subprocess
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fgbaseline import data, diagnosis, ekf
from fgbaseline.data.simulate import Simulation, simulate

from .commands import fgbaseline
from .mutations import EPOCH, RECORDING, TRAJECTORY, Mutation

SECONDS = 60
"""of a processor that a command may take: a busy machine is no failure"""
FRAMES = 120
ESTIMATORS = "dead-reckoning,isam2"
SAME = 0.02
"""relative: by so much an error may differ from that of the good file"""
LIMITS = """\
[[limit]]
metric = "ate.rmse"
estimators = "isam2"
at_most = 0.5
"""
CLEAN: dict[str, Any] = {"features_per_frame": 15.0, "wrong_share": 0.0, "moving_share": 0.0, "farthest": 60.0}
"""nothing that `diagnose` would find"""
BASES: tuple[dict[str, Any], ...] = (
    {"path": "town", "seed": 3},
    {"path": "handheld", "seed": 4},
    {"path": "loop", "seed": 5},
)


@dataclass(frozen=True)
class Ended:
    """What became of a case."""

    mutation: str
    codes: dict[str, int | None]
    """exit code by command; None where it was killed after its minute"""
    violations: list[str] = field(default_factory=list)
    repaired: bool = False
    """a trajectory was compared with the errors of the good file"""


@cache
def good_recording(base: int) -> dict[str, Any]:
    """The arrays of an unmutated recording, with truth."""
    sequence = simulate(Simulation(duration=FRAMES / 10.0, frame_rate=10.0, **CLEAN, **BASES[base]))
    with TemporaryDirectory() as folder:
        data.write_npz(sequence, Path(folder) / "a.npz")
        with np.load(Path(folder) / "a.npz") as arrays:
            return {key: arrays[key] for key in arrays.files}


@cache
def good_trajectory(base: int) -> tuple[str, list[list[str]]]:
    """A reference as text of a TUM file, and the rows of an estimate of it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.npz"
        np.savez(path, **good_recording(base))
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


def case(number: int, *, drawing: bool = False) -> Ended:
    """Runs one case; recordings and trajectories in turn."""
    kind = (_recording, _trajectory)[number % 2]
    mutations = (RECORDING, TRAJECTORY)[number % 2]
    turn = number // 2
    mutation, base = mutations[turn % len(mutations)], turn // len(mutations) % len(BASES)
    with TemporaryDirectory() as folder:
        return kind(mutation, base, np.random.default_rng(number), Path(folder), drawing)


def _recording(mutation: Mutation, base: int, random: np.random.Generator, folder: Path, drawing: bool) -> Ended:
    good = {key: np.array(array) for key, array in good_recording(base).items()}
    np.savez(folder / "drive.npz", **mutation.change(good, random))
    (folder / "limits.toml").write_text(LIMITS)
    ended = Ended(mutation.name, {})
    call = partial(_called, ended, folder, drawing)
    if call("diagnose", "drive.npz") == 0 and mutation.unit:
        ended.violations.append("diagnose passes")
    ran = call("run", "drive.npz", "--estimators", ESTIMATORS, "--out", "run") in (0, 1)
    if ran and call("check", "run", "--limits", "limits.toml") == 0 and mutation.unit:
        ended.violations.append("check passes")
    return ended


def _trajectory(mutation: Mutation, base: int, random: np.random.Generator, folder: Path, drawing: bool) -> Ended:
    truth, rows = good_trajectory(base)
    (folder / "truth.tum").write_text(truth)
    changed = mutation.change([list(row) for row in rows], random)
    (folder / "mine.tum").write_text("".join(" ".join(row) + "\n" for row in changed))
    ended = Ended(mutation.name, {})
    code = _called(ended, folder, drawing, "compare", "truth.tum", "mine.tum", "--out", "compared")
    if code == 0:
        judged = slice(1 if _is_in_doubt(folder / "compared") else None)  # positions alone where an order is in doubt
        return _judged(ended, _compared_errors(folder / "compared")[judged], good_distance(base)[judged])
    return ended


def _judged(ended: Ended, errors: list[float], good: list[float]) -> Ended:
    same = bool(np.allclose(errors, good, rtol=SAME, atol=0.0))
    if not same:
        said = ["(" + ", ".join(f"{error:.4g}" for error in some) + ")" for some in (errors, good)]
        ended.violations.append(f"passes with errors of {said[0]}, those of the good file are {said[1]}")
    return Ended(ended.mutation, ended.codes, ended.violations, same)


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 5))


def _called(ended: Ended, folder: Path, drawing: bool, *arguments: str) -> int | None:
    """The exit code of a command, which the case remembers, with what it violates."""
    verb = arguments[0]
    try:
        result = fgbaseline(*arguments, cwd=folder, drawing=drawing, first=_limited, seconds=30.0 * SECONDS)
    except subprocess.TimeoutExpired:
        ended.codes[verb] = None
        ended.violations.append(f"{verb} waits for more than {30.0 * SECONDS:g} s")
        return None
    if result.returncode == -signal.SIGXCPU:
        ended.codes[verb] = None
        ended.violations.append(f"{verb} takes more than {SECONDS} s")
        return None
    ended.codes[verb] = result.returncode
    if result.returncode not in (0, 1, 2) or "Traceback" in result.stderr:
        last = result.stderr.strip().splitlines()[-1:] or [""]
        ended.violations.append(f"{verb} ends with {result.returncode}: {last[0][:160]}")
    return result.returncode


def _compared_errors(folder: Path) -> list[float]:
    """RMSE of the absolute error of a trajectory in position, m, and orientation, degrees; NaN where it has none."""
    read = json.loads((folder / "comparison.json").read_text())["estimates"]["mine"]
    found = [((read.get(what) or {}).get("rmse") or {}).get("value") for what in ("translation", "rotation_deg")]
    return [math.nan if value is None else float(value) for value in found]


def _is_in_doubt(folder: Path) -> bool:
    """Whether the comparison reports that nothing shows the order of quaternions, as on the nearly straight base."""
    read = json.loads((folder / "comparison.json").read_text())["estimates"]["mine"]
    return any("--quaternion settles it" in remark for remark in read["remarks"])


@cache
def good_distance(base: int) -> list[float]:
    """The errors of an unmutated trajectory, m and degrees."""
    truth, rows = good_trajectory(base)
    with TemporaryDirectory() as folder:
        (Path(folder) / "truth.tum").write_text(truth)
        (Path(folder) / "mine.tum").write_text("".join(" ".join(row) + "\n" for row in rows))
        _called(Ended("none", {}), Path(folder), False, "compare", "truth.tum", "mine.tum", "--out", "compared")
        return _compared_errors(Path(folder) / "compared")
