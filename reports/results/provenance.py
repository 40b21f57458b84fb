"""Provenance of results: versions, machine, date and command line."""

import os
import platform
import shlex
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import click

LIBRARIES = ("fgbaseline", "gtsam", "numpy", "pandas", "scipy", "matplotlib")
CPU_INFO = Path("/proc/cpuinfo")
MODEL = "model name"
"""key of the processor's name in Linux's file on it, on most architectures"""


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that figures depend on."""
    return {"python": platform.python_version(), **{name: version(name) for name in LIBRARIES}}


def machine() -> dict[str, str | int]:
    """Operating system, architecture and name of the processor, number of cores."""
    return {
        "system": platform.system(),
        "processor": platform.machine(),
        "model": _model(),
        "cores": os.cpu_count() or 0,
    }


def creation() -> dict[str, dict[str, str | int]]:
    """Record at the end of a page: date and command line, versions, machine.

    SOURCE_DATE_EPOCH, as reproducible builds set it, takes the place of the present time.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.now().astimezone() if epoch is None else datetime.fromtimestamp(int(epoch), UTC)
    made = {"date": now.strftime("%Y-%m-%d %H:%M:%S %z"), "command line": _command_line()}
    return {"Created": {**made}, "Versions": {**versions()}, "Machine": machine()}


def _command_line() -> str:
    context = click.get_current_context(silent=True)
    if context is None or context.find_root().obj is None:
        return "none: called from Python"
    return shlex.join(["fgbaseline", *context.find_root().obj])


def _model() -> str:
    """Name of the processor where the system gives one, else its architecture."""
    lines = CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines() if CPU_INFO.is_file() else []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith(MODEL))
    return next(named, "") or platform.processor() or platform.machine()
