"""The entry point: finds the command, and turns bad input into one sentence and exit code 2."""

import gc
import importlib
import os
import signal
import sys
from types import FrameType
from typing import NoReturn

import click

COMMANDS = {
    "run": "run",
    "track": "track",
    "compare": "compare",
    "diagnose": "diagnose",
    "export": "export",
    "figures": "figures",
    "check": "check",
    "bench": "bench",
    "reproduce": "reproduce",
    "simulate": "simulate",
}
"""command -> module of this package that holds it under the name `command`"""
BAD_INPUT, INTERRUPTED = 2, 130
NEW_OBJECTS = 50_000
"""between two searches for cyclic garbage, of which there is little; Python has 700, as suits what runs for days"""


class _Commands(click.Group):
    """Imports the module of a command when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f".{COMMANDS[cmd_name]}", __package__).command
        return command


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: fgbaseline run drive.npz --out out/drive",
)
@click.version_option(package_name="fgbaseline")
def group() -> None:
    """How far is a visual-inertial filter from what the data supports?

    Runs an EKF and a factor-graph reference (GTSAM iSAM2) on the same problem and shows where they part.
    """


def main(arguments: list[str] | None = None) -> NoReturn:
    """Runs the command line and exits: 0 well, 1 with a failed estimator, 2 on bad input, 130 when interrupted."""
    # Small matrices everywhere: more than one BLAS thread only makes them wait for each other.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    gc.set_threshold(NEW_OBJECTS)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        code = group.main(arguments, standalone_mode=False)
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
    """What is wrong with the command line, on one line, and where help is."""
    text = " ".join(error.format_message().split()).rstrip(".")
    context = error.ctx if isinstance(error, click.UsageError) else None
    return text if context is None else f"{text}; see {context.command_path} --help"


def _interrupt(signum: int, frame: FrameType | None) -> NoReturn:  # noqa: ARG001
    raise KeyboardInterrupt
