"""Options that several commands have, and their types."""

from pathlib import Path

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
