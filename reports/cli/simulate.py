"""`fgbaseline simulate`: a recording with known truth."""

from pathlib import Path
from typing import Any

import click

PATHS = ("town", "loop", "highway", "handheld", "drone", "along")
INTERVALS = ("after", "before", "mean")
DENSITIES = ("gyroscope_density", "gyroscope_walk", "accelerometer_density", "accelerometer_walk")


class Interval(click.ParamType[tuple[float, ...]]):
    """Numbers separated by colons, such as START:END:SHARE."""

    def __init__(self, *parts: str) -> None:
        self.name = ":".join(parts)
        self._parts = parts

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """The numbers."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(part) for part in str(value).split(":"))
        except ValueError:
            numbers = ()
        if len(numbers) != len(self._parts):
            self.fail(f"expected {self.name} in numbers, got {value!r}", param, ctx)
        return numbers


@click.command(
    epilog="Example: fgbaseline simulate drive.npz --path loop --duration 120 --burst 20:22:0.5 --seed 7",
)
@click.argument("output", type=click.Path(path_type=Path))
@click.option("--path", help="Where it goes.  [default: town]", type=click.Choice(PATHS))
@click.option("--along", help="Recording whose velocities to follow (path 'along').", type=click.Path(path_type=Path))
@click.option("--along-gyro-bias", help="rad/s, taken off the velocities of --along first.", type=(float, float, float))
@click.option("--duration", help="Seconds.  [default: 60, or all of --along]", type=float)
@click.option("--frame-rate", help="Frames a second.  [default: 10]", type=float)
@click.option("--seed", help="Same seed, same bytes.  [default: 0]", type=int)
@click.option("--standing", help="Seconds that the body stands still first.", type=float)
@click.option("--imu", is_flag=True, help="Raw inertial samples in place of body velocities.")
@click.option("--imu-rate", help="Hz, with --imu.  [default: 200]", type=float)
@click.option(
    "--imu-noise",
    help="With --imu: noise density and random walk of the gyroscope, then of the accelerometer (continuous time).  "
    "[default: 1.7e-4 2e-5 2e-3 3e-3]",
    type=(float, float, float, float),
)
@click.option("--accelerometer-bias", help="m/s^2, with --imu.", type=(float, float, float))
@click.option("--sigma-linear", help="m/s, noise of a velocity sample.  [default: 0.1]", type=float)
@click.option("--sigma-angular", help="rad/s, noise of a rate sample.  [default: 0.01]", type=float)
@click.option("--gyro-bias", help="rad/s, in recorded axes.", type=(float, float, float))
@click.option("--velocity-scale", help="Recorded over true velocity.  [default: 1]", type=float)
@click.option("--time-offset", help="s: a velocity stamped t is that of t + offset.  [default: 0]", type=float)
@click.option("--velocity-of-interval", help="What a sample says.  [default: after]", type=click.Choice(INTERVALS))
@click.option("--linear-axes", help="Axis convention of the linear velocity, such as x,-y,-z.")
@click.option("--angular-axes", help="Axis convention of the angular velocity.")
@click.option("--features-per-frame", help="Points tracked at a time.  [default: 70]", type=float)
@click.option("--track-length", help="Median frames until a point is lost.  [default: 14]", type=float)
@click.option("--returning-share", help="Share of tracks that are lost and found again.", type=float)
@click.option("--return-after", help="s from the first sight of such a track to its second.", type=float)
@click.option("--sigma-pixel", help="px, noise of each row.  [default: 0.5]", type=float)
@click.option("--row-correlation", help="Between the noise of vL and vR.  [default: 0]", type=float)
@click.option("--wrong-share", help="Share of wrong matches.  [default: 0.03]", type=float)
@click.option(
    "--burst",
    help="Share of wrong matches between two times, s; repeatable.",
    type=Interval("START", "END", "SHARE"),
    multiple=True,
)
@click.option("--blackout", help="Time without features, s; repeatable.", type=Interval("START", "END"), multiple=True)
@click.option("--moving-share", help="Share of observations on things that move.", type=float)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(
    output: Path,
    along: Path | None,
    force: bool,
    imu: bool,
    imu_rate: float | None,
    imu_noise: tuple[float, float, float, float] | None,
    accelerometer_bias: tuple[float, float, float] | None,
    **given: Any,
) -> None:
    """Simulate a recording and write it to OUTPUT (.npz) with its truth.

    The file is the later course form plus `ground_truth` and `landmarks`, and `fgbaseline run` reads it.
    """
    from fgbaseline.data import read, write_npz
    from fgbaseline.data.plural import plural
    from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
    from fgbaseline.geometry import InputError

    if output.suffix != ".npz":
        raise InputError(f"{output}: a recording is written as .npz; give a name that ends so")
    if output.exists() and not force:
        raise InputError(f"{output}: the file exists; choose another, or replace it with --force")
    settings = {name: value for name, value in given.items() if value not in (None, ())}
    for many, one in (("bursts", "burst"), ("blackouts", "blackout")):
        if one in settings:
            settings[many] = settings.pop(one)
    inertial: dict[str, Any] = {"rate": imu_rate, "accelerometer_bias": accelerometer_bias}
    if imu_noise is not None:
        inertial |= dict(zip(DENSITIES, imu_noise, strict=True))
    inertial = {name: value for name, value in inertial.items() if value is not None}
    if inertial and not imu:
        raise InputError(
            "imu-rate, imu-noise, accelerometer-bias: they are settings of --imu; add it, or leave them out"
        )
    if imu:
        settings["imu"] = SimulatedImu(**inertial)
    if along is not None:
        settings["along"] = read(along)
        settings.setdefault("path", "along")
    sequence = simulate(Simulation(**settings))
    write_npz(sequence, output)
    click.echo(
        f"{output}: {plural(sequence.n_frames, 'frame')}, {plural(len(sequence.observations), 'observation')} of "
        f"{plural(sequence.n_landmarks, 'track')}"
    )
