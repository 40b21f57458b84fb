"""Options that several commands have, and their types."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


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


preset = click.option(
    "--preset",
    type=click.Choice(["calibrated", "documented"]),
    default="calibrated",
    show_default=True,
    help="How the problem is posed: what the data supports, or as the report has it.",
)
features = click.option(
    "--features",
    type=FeatureCount(),
    help="How many landmarks, those seen most often.  [default: all; 1000 for the documented preset]",
)
imu = click.option(
    "--imu",
    type=click.Path(path_type=Path),
    metavar="CSV",
    help="Raw inertial samples in EuRoC's form, in place of the velocities of SEQUENCE.",
)
imu_calibration = click.option(
    "--imu-calibration",
    type=click.Path(path_type=Path),
    metavar="YAML",
    help="Noise of these samples: EuRoC's sensor.yaml or Kalibr's imu.yaml.  [default: assumed]",
)
time_unit = click.option(
    "--time-unit",
    type=click.Choice(["s", "ms", "us", "ns"]),
    help="What the time stamps of SEQUENCE count.  [default: seconds, unless the recording shows another unit]",
)
_PATH = click.Path(path_type=Path)
_IMAGES = (
    click.option("--right", type=_PATH, metavar="FOLDER", help="Images: folder of the right camera."),
    click.option(
        "--calibration", type=_PATH, metavar="YAML", help="Images: cameras of two folders or a bag, Kalibr or OpenCV."
    ),
    click.option("--times", type=_PATH, metavar="FILE", help="Images: stamps of two folders, a line for each image."),
    click.option("--topics", metavar="LEFT,RIGHT[,IMU]", help="Images: topics of a bag.  [default: by their types]"),
    click.option("--settings", type=_PATH, metavar="TOML", help="Images: settings of the tracker."),
)
_MOTION = (
    click.option(
        "--velocities",
        type=_PATH,
        metavar="CSV",
        help="Body velocities: stamp, vx, vy, vz, wx, wy, wz, in place of the motion of SEQUENCE.",
    ),
    click.option("--extrinsic", type=_PATH, metavar="FILE", help="imu_T_cam of the left camera: a line of 12 numbers."),
)


def images(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of recordings of images, and of motion given beside them."""
    for option in reversed((*_MOTION, *_IMAGES)):
        command = option(command)
    return command


def topic_names(text: str | None) -> tuple[str, ...]:
    """Names separated by commas."""
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())
