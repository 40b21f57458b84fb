"""The command `fgbaseline`: as a user starts it, or in a fork of this process, which has imported what it needs."""

import gc
import json
import os
import pkgutil
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import NoReturn

import pytest

import fgbaseline as fgbaseline_package
from fgbaseline.reports.cli import main

from .empty_figures import empty_files, figures_left_empty

COMMAND = Path(sys.executable).with_name("fgbaseline")
ROOT = Path(__file__).parents[2]
SECONDS = 1200
"""that a command may take, on a machine that has much else to do"""
UNDRAWN = """
import json
import sys
import pytest
from fgbaseline.reports.cli import main

root = sys.argv.pop(1)
sys.path.append(root)
from tests.builders.empty_figures import figures_left_empty

sys.path.remove(root)
figures_left_empty(pytest.MonkeyPatch())
codes = []
for arguments in json.loads(sys.argv[1]):
    sys.argv[1:] = arguments
    try:
        main(arguments)
    except SystemExit as ended:
        codes.append(ended.code or 0)
sys.exit(max(codes))
"""


def environment(**changes: str) -> dict[str, str]:
    """The environment of a user at no terminal of known width."""
    kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR", "PYTHONPATH")}
    return {**kept, **changes}


def installed(*arguments: str | Path, cwd: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """The installed command run to its end in `cwd`, with no input, in a process that imports everything anew."""
    return _ended([COMMAND, *arguments], cwd, environment(**env))


def undrawn(*commands: Sequence[str], cwd: Path, **env: str) -> subprocess.CompletedProcess[str]:
    """Commands one after another in one new Python that leaves their figures empty; the highest of their exit codes."""
    return _ended([sys.executable, "-c", UNDRAWN, ROOT, json.dumps(commands)], cwd, environment(**env))


def undrawn_command() -> str:
    """A program that is the command but for its figures, which it leaves empty."""
    return f"import json, sys\nsys.argv[1:] = [{str(ROOT)!r}, json.dumps([sys.argv[1:]])]\n{UNDRAWN}"


def fgbaseline(
    *arguments: str | Path,
    cwd: Path,
    drawing: bool = True,
    first: Callable[[], object] = lambda: None,
    seconds: float = SECONDS,
    **env: str,
) -> subprocess.CompletedProcess[str]:
    """The command in a fork: its own folder, environment, output and end, and none of the seconds that imports take.

    Without `drawing`, figures have their files, but nothing is on them. `first` is called in the fork before all else.
    Raises subprocess.TimeoutExpired after `seconds`; the command is killed then.
    """
    command = _in_a_fork([str(part) for part in arguments], environment(**env), drawing, first)
    return _ended(["fgbaseline", *arguments], cwd, None, command, seconds)


def started(*arguments: str | Path, cwd: Path, drawing: bool = True) -> subprocess.Popen[str]:
    """The same, running; its standard error can be read line by line."""
    command = _in_a_fork([str(part) for part in arguments], environment(), drawing)
    return subprocess.Popen(
        ["fgbaseline"],
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=command,
        restore_signals=False,
    )


def _ended(
    command: list[str | Path],
    cwd: Path,
    env: dict[str, str] | None,
    instead: Callable[[], NoReturn] | None = None,
    seconds: float = SECONDS,
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=env,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
        preexec_fn=instead,
        restore_signals=instead is None,  # those that Python ignores are ignored in a fork of it
    )


def _in_a_fork(
    arguments: list[str], env: dict[str, str], drawing: bool, first: Callable[[], object] = lambda: None
) -> Callable[[], NoReturn]:
    """What `subprocess` is to call in the child it forks, which does not come to starting another program then."""
    _everything_imported()
    if not drawing:
        empty_files()
    return partial(_become, arguments, env, drawing, first, _descriptors())


@cache
def _everything_imported() -> None:
    """What the commands import when they run, so that no fork has to."""
    for module in pkgutil.walk_packages(fgbaseline_package.__path__, f"{fgbaseline_package.__name__}."):
        if not module.name.endswith((".schema", ".pytest_plugin", "__main__")):
            import_module(module.name)


def _descriptors() -> set[int]:
    return {int(path.name) for path in Path("/proc/self/fd").iterdir()}


def _become(
    arguments: list[str], env: dict[str, str], drawing: bool, first: Callable[[], object], known: set[int]
) -> NoReturn:
    """Turns this fork into the command, in the folder and with the output that it has; never returns into the tests."""
    code: int | str | None = 1
    gc.freeze()  # a search for garbage among all that the tests have would copy their memory, page by page
    try:
        for number in _descriptors() - known - {0, 1, 2}:  # one of them has the parent wait for a new program
            with suppress(OSError):
                os.close(number)
        signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell's background jobs ignore
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        os.environ.clear()
        os.environ.update(env)
        first()
        if not drawing:
            figures_left_empty(pytest.MonkeyPatch())
        main(arguments)
    except SystemExit as ended:
        code = ended.code
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 0)


def heeding_interrupts() -> None:
    """For a child before it starts: a shell's background jobs, and so all they start, ignore interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def everything_in(folder: Path) -> set[str]:
    """Every file and folder below, hidden ones too."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}
