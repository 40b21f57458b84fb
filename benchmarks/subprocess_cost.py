"""Time and memory of a function in a separate process, with none of the caller's in them.

`python -m benchmarks.subprocess_cost MODULE FUNCTION JSON` is that process; it answers in one line of JSON.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import importlib
import json
import resource
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MB = 1e6


class StoppedError(Exception):
    """The process took longer than it was given."""


@dataclass(frozen=True, slots=True)
class Taken:
    """Cost of one call."""

    answer: Any
    seconds: float
    """by the clock on the wall"""
    processor: float
    """s of processor time, imports included"""
    peak: float
    """MB, of the whole process, imports included"""


def apart(function: str, *arguments: Any, limit: int | None = None) -> Taken:
    """The call of a function, named as `module:name`, of arguments and with an answer that JSON can write.

    Raises StoppedError after `limit` processor seconds, and RuntimeError where the process fails.
    """
    arguments_text = json.dumps({"arguments": arguments, "limit": limit})
    ended = subprocess.run(
        [sys.executable, "-m", "benchmarks.subprocess_cost", *function.split(":"), arguments_text],
        cwd=Path(__file__).parents[1],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if ended.returncode == -signal.SIGXCPU:
        raise StoppedError(f"{function} was stopped after {limit:.0f} s")
    if ended.returncode != 0:
        raise RuntimeError(f"{function} ended with {ended.returncode}")
    return Taken(**json.loads(ended.stdout))


def peak_memory() -> float:
    """MB that this process has held at most.

    Linux reports it in /proc, which is used: to `ru_maxrss` a process inherits what its parent held.
    """
    held = _status("VmHWM")
    if held is not None:
        return held
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / MB


def memory() -> float:
    """MB that this process holds now; its peak, where the system does not report the present value."""
    held = _status("VmRSS")
    return peak_memory() if held is None else held


def forget_peak() -> None:
    """Resets the peak of the memory, where the system allows that."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _status(field: str) -> float | None:
    try:
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return None
    return next((int(line.split()[1]) * 1024 / MB for line in lines if line.startswith(f"{field}:")), None)


def main() -> None:
    """Calls the function and prints its time and memory."""
    module, name, arguments = sys.argv[1:]
    asked = json.loads(arguments)
    if asked["limit"] is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (asked["limit"], resource.RLIM_INFINITY))
    function = getattr(importlib.import_module(module), name)
    start = time.perf_counter()
    answer = function(*asked["arguments"])
    seconds = time.perf_counter() - start
    print(json.dumps({"answer": answer, "seconds": seconds, "processor": time.process_time(), "peak": peak_memory()}))


if __name__ == "__main__":
    main()
