"""The command `fgbaseline`: as a user starts it, or in a fork of this process, which has imported what it needs."""

import os
import pkgutil
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NoReturn

import pytest

from fgbaseline import reports
from fgbaseline.reports.cli import main

from .empty_figures import figures_left_empty

COMMAND = Path(sys.executable).with_name("fgbaseline")
SECONDS = 300
"""that a command may take"""
INTERNAL_ERROR = 1
ROOT = Path(__file__).parents[1]
UNDRAWN = """
import sys
import pytest
from fgbaseline.reports.cli import main

root = sys.argv.pop(1)
sys.path.append(root)
from tests.empty_figures import figures_left_empty

sys.path.remove(root)
figures_left_empty(pytest.MonkeyPatch())
main(sys.argv[1:])
"""


def environment(**changes: str) -> dict[str, str]:
    """The environment of a user at no terminal of known width."""
    kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR", "PYTHONPATH")}
    return {**kept, **changes}


def installed(*arguments: str | Path, cwd: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """The installed command run to its end in `cwd`, with no input, in a process that imports everything anew."""
    return _ended([COMMAND, *arguments], cwd, env)


def undrawn(*arguments: str | Path, cwd: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """The command in a new Python that leaves its figures empty."""
    return _ended([sys.executable, "-c", UNDRAWN, ROOT, *arguments], cwd, env)


def _ended(command: list[str | Path], cwd: Path, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=environment(**env),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )


def fgbaseline(
    *arguments: str | Path,
    cwd: Path,
    drawing: bool = True,
    first: Callable[[], object] = lambda: None,
    **env: str,
) -> subprocess.CompletedProcess[str]:
    """The command in a fork: its own folder, environment, output and end, and none of the seconds that imports take.

    Without `drawing`, figures have their files, but nothing is on them. `first` is called in the fork before all else.
    """
    _everything_imported()
    (out, into_out), (err, into_err) = os.pipe(), os.pipe()
    process = os.fork()
    if process == 0:
        _become(list(map(str, arguments)), cwd, environment(**env), into_out, into_err, drawing, first)
    os.close(into_out)
    os.close(into_err)
    with ThreadPoolExecutor(2) as readers:
        told = list(readers.map(_read, (out, err)))
    status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    return subprocess.CompletedProcess(["fgbaseline", *map(str, arguments)], status, *told)


def _read(number: int) -> str:
    with open(number) as stream:
        return stream.read()


@cache
def _everything_imported() -> None:
    """What the commands import when they run, so that no fork has to."""
    for module in pkgutil.walk_packages(reports.__path__, f"{reports.__name__}."):
        if not module.name.endswith((".schema", ".pytest_plugin")):
            import_module(module.name)


def _become(
    arguments: list[str],
    cwd: Path,
    env: dict[str, str],
    out: int,
    err: int,
    drawing: bool,
    first: Callable[[], object],
) -> NoReturn:
    """Turns this fork into the command; never returns into the tests."""
    code = INTERNAL_ERROR
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.alarm(SECONDS)
        with open(os.devnull) as nothing:  # noqa: PTH123
            os.dup2(nothing.fileno(), 0)
        os.dup2(out, 1)
        os.dup2(err, 2)
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        os.chdir(cwd)
        os.environ.clear()
        os.environ.update(env)
        first()
        if not drawing:
            figures_left_empty(pytest.MonkeyPatch())
        main(arguments)
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else INTERNAL_ERROR
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def heeding_interrupts() -> None:
    """For a child before it starts: a shell's background jobs, and so all they start, ignore interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def started(*arguments: str | Path, cwd: Path) -> subprocess.Popen[str]:
    """The installed command, running; its standard error can be read line by line."""
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
