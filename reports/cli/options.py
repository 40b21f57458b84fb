"""Option types, and options that several commands share."""

from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from ..problem import names_in

PATH = click.Path(path_type=Path)
UNITS = click.Choice(["s", "ms", "us", "ns"])
BODY = click.Choice(["imu", "camera"])
Command = TypeVar("Command", bound=Callable[..., Any])


class NamedFile(click.ParamType[str]):
    """`[NAME=]FILE` as text; a shell completes the file."""

    name = "file"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002
        """Leaves the completion of a path to the shell."""
        return [CompletionItem(incomplete, type="file")]


class FeatureCount(click.ParamType[int | str]):
    """A number of landmarks, or 'all'."""

    name = "N|all"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> int | str:
        """The number, or 'all'."""
        if value == "all":
            return "all"
        try:
            number = int(str(value))
        except ValueError:
            number = 0
        if number < 1:
            self.fail(f"expected a whole number of at least 1 or 'all', got {value!r}", param, ctx)
        return number


class Numbers(click.ParamType[tuple[float, ...]]):
    """Numbers with a separator, in the form that `name` shows: `X,Y,Z`, `START:END`, or of any length `N,N,...`."""

    def __init__(self, name: str, expected: str, *, of: Callable[[str], float] = float) -> None:
        self.name, self._expected, self._of = name, expected, of
        self._separator = ":" if ":" in name else ","
        self._is_list = name.endswith("...")

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """The numbers; those of a list of any length are positive."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(self._of(part) for part in str(value).split(self._separator))
        except ValueError:
            numbers = ()
        if self._is_list:
            is_valid = bool(numbers) and all(isfinite(number) and number > 0 for number in numbers)
        else:
            is_valid = len(numbers) == len(self.name.split(self._separator))
        if not is_valid:
            self.fail(f"expected {self._expected}, got {value!r}", param, ctx)
        return numbers


XYZ = Numbers("X,Y,Z", "three numbers such as 0,0,1")


class Formats(click.ParamType[tuple[str, ...]]):
    """File formats, separated by commas."""

    name = "pdf,svg,png"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        """The formats, each once."""
        if isinstance(value, tuple):
            return value
        wanted = tuple(dict.fromkeys(part.strip().lower() for part in str(value).split(",")))
        for form in wanted:
            if form not in ("pdf", "svg", "png"):
                self.fail(f"there is no format {form!r}; choose from pdf, svg and png", param, ctx)
        return wanted


def seed(what: str) -> Callable[[Command], Command]:
    """The seed of a random choice."""
    return click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help=f"Seed of {what}.")


def choice(name: str, *values: str, what: str) -> Callable[[Command], Command]:
    """An option with the first of its values as default."""
    return click.option(name, type=click.Choice(values), default=values[0], show_default=True, help=what)


open_page = click.option("--open", "opened", is_flag=True, help="Open the page in the browser.")
preset = choice(
    "--preset", "calibrated", "documented", what="The problem: diagnosed and repaired, or as the source paper has it."
)
features = click.option(
    "--features",
    type=FeatureCount(),
    help="Number of landmarks, those with the most observations.  [default: all; with --preset documented 1000]",
)
time_unit = click.option(
    "--time-unit",
    type=UNITS,
    help="Unit of the time stamps of RECORDING.  [default: seconds, unless the recording shows another unit]",
)
as_recorded = click.option(
    "--as-recorded",
    is_flag=True,
    help="No diagnosis and no repairs, assumed noise; velocity k is applied from frame k to k + 1. Only with "
    "--preset calibrated.",
)
repairs = click.option(
    "--repairs",
    type=PATH,
    help="TOML file of your own repairs, applied in addition to those of the diagnosis. Only with --preset calibrated.",
)
held_out = click.option(
    "--held-out",
    type=float,
    default=0.0,
    show_default=True,
    metavar="SHARE",
    help="Share of the tracks withheld from diagnosis and estimators, and used to rank the trajectories.",
)
_RECORDING = (
    click.option(
        "--imu",
        type=PATH,
        metavar="CSV",
        help="Raw inertial samples in EuRoC's form, used instead of any motion data of the input.",
    ),
    click.option(
        "--imu-calibration",
        type=PATH,
        metavar="YAML",
        help="Noise of these samples: EuRoC's sensor.yaml or Kalibr's imu.yaml.  [default: assumed]",
    ),
    click.option(
        "--velocities",
        type=PATH,
        metavar="CSV",
        help="Body velocities: stamp, vx, vy, vz (m/s), wx, wy, wz (rad/s), used instead of any motion data of the "
        "input.",
    ),
    click.option("--extrinsic", type=PATH, metavar="FILE", help="imu_T_cam of the left camera: a line of 12 numbers."),
    click.option("--right", type=PATH, metavar="FOLDER", help="Images: folder of the right camera."),
    click.option(
        "--calibration", type=PATH, metavar="YAML", help="Images: calibration of folders or a bag, Kalibr or OpenCV."
    ),
    click.option("--times", type=PATH, metavar="FILE", help="Images: stamps of folders, a line for each image."),
    click.option(
        "--topics",
        metavar="LEFT[,RIGHT][,IMU]",
        callback=lambda _context, _option, text: names_in(text),
        help="Images: topics of a bag.  [default: by their types]",
    ),
    click.option(
        "--cameras",
        type=click.Choice(["stereo", "left"]),
        help="Images: a pair, or the left camera alone; run, diagnose and export then need raw inertial "
        "samples.  [default: what there is]",
    ),
    click.option("--settings", "tracker", type=PATH, metavar="TOML", help="Images: settings of the tracker."),
)


def recording_inputs(command: Command) -> Command:
    """Options that name what belongs to a recording: images, motion, extrinsic, inertial samples."""
    for option in reversed(_RECORDING):
        command = option(command)
    return command
