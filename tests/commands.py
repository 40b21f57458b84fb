"""The installed command `fgbaseline`, started as a user starts it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

COMMAND = Path(sys.executable).with_name("fgbaseline")


def environment(**changes: str) -> dict[str, str]:
    """The environment of a user at no terminal of known width."""
    kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR", "PYTHONPATH")}
    return {**kept, **changes}


def fgbaseline(*arguments: str | Path, cwd: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """The command run to its end in `cwd`, with no input."""
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        cwd=cwd,
        env=environment(**env),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def heeding_interrupts() -> None:
    """For a child before it starts: a shell's background jobs, and so all they start, ignore interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def started(*arguments: str | Path, cwd: Path) -> subprocess.Popen[str]:
    """The command, running; its standard error can be read line by line."""
    return subprocess.Popen(
        [COMMAND, *map(str, arguments)],
        cwd=cwd,
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heeding_interrupts,
    )


def everything_in(folder: Path) -> set[str]:
    """Every file and folder below, hidden ones too."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}
