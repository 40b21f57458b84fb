"""The command `fgbaseline`: its group of commands, and bad input as one sentence with exit code 2.

A command imports what it needs when it runs, so that `--help` answers at once.
"""

import gc
import os
import signal
import sys
from types import FrameType
from typing import NoReturn

import click

from .evaluation_commands import check, compare, figures
from .experiment_commands import bench, reproduce, simulate
from .recording_commands import diagnose, estimators, export, run, track

COMMANDS = {
    command.name: command
    for command in (run, track, compare, estimators, diagnose, export, figures, check, bench, reproduce, simulate)
    if command.name is not None
}
"""in the order of `--help`"""
BAD_INPUT, INTERRUPTED = 2, 130
NEW_OBJECTS = 50_000
"""between two searches for cyclic garbage, of which there is little; Python's 700 suits processes that run for days"""


class _Commands(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(COMMANDS)


@click.group(
    cls=_Commands,
    commands=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: fgbaseline run drive.npz --out out/drive",
)
@click.version_option(package_name="fgbaseline")
def group() -> None:
    """Compare a visual-inertial filter with a factor-graph reference.

    Runs an EKF and a reference (GTSAM iSAM2) on the same problem, and reports divergence, reprojection errors and
    consistency.
    """


def main(arguments: list[str] | None = None) -> NoReturn:
    """Runs the command line and exits: 0 success, 1 a failed estimator, 2 bad input, 130 interrupted."""
    # Small matrices everywhere: more than one BLAS thread only makes them wait for each other.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    gc.set_threshold(NEW_OBJECTS)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        code = group.main(arguments, standalone_mode=False, obj=sys.argv[1:] if arguments is None else arguments)
        sys.exit(code if isinstance(code, int) else 0)
    except (click.exceptions.Abort, KeyboardInterrupt):
        click.echo("fgbaseline: interrupted; no half-written file or folder is left", err=True)
        sys.exit(INTERRUPTED)
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        sys.exit(BAD_INPUT)
    except click.ClickException as error:
        click.echo(f"fgbaseline: {_sentence(error)}", err=True)
        sys.exit(BAD_INPUT)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except Exception as error:
        from fgbaseline.geometry import FgbaselineError

        if not isinstance(error, FgbaselineError):
            raise
        click.echo(f"fgbaseline: {error}", err=True)
        sys.exit(BAD_INPUT)


def _sentence(error: click.ClickException) -> str:
    """Fault of the command line, on one line, and the command that prints help."""
    text = " ".join(error.format_message().split()).rstrip(".")
    context = error.ctx if isinstance(error, click.UsageError) else None
    return text if context is None else f"{text}; see {context.command_path} --help"


def _interrupt(signum: int, frame: FrameType | None) -> NoReturn:  # noqa: ARG001
    raise KeyboardInterrupt
