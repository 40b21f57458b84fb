"""`fgbaseline simulate`: a recording with known truth."""

from pathlib import Path
from typing import Any

import click

PATHS = ("town", "loop", "highway", "handheld", "along")
INTERVALS = ("after", "before", "mean")


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


def option(name: str, help: str, **more: Any) -> Any:
    """An option that is passed on only where it is given: defaults stand in `Simulation`."""
    return click.option(name, help=help, **more)


@click.command(
    epilog="Example: fgbaseline simulate drive.npz --path loop --duration 120 --burst 20:22:0.5 --seed 7",
)
@click.argument("output", type=click.Path(path_type=Path))
@option("--path", "Where it goes.  [default: town]", type=click.Choice(PATHS))
@option("--along", "Recording whose velocities to follow (path 'along').", type=click.Path(path_type=Path))
@option("--along-gyro-bias", "rad/s, taken off the velocities of --along first.", type=(float, float, float))
@option("--duration", "Seconds.  [default: 60, or all of --along]", type=float)
@option("--frame-rate", "Frames a second.  [default: 10]", type=float)
@option("--seed", "Same seed, same bytes.  [default: 0]", type=int)
@option("--sigma-linear", "m/s, noise of a velocity sample.  [default: 0.1]", type=float)
@option("--sigma-angular", "rad/s, noise of a rate sample.  [default: 0.01]", type=float)
@option("--gyro-bias", "rad/s, in recorded axes.", type=(float, float, float))
@option("--velocity-scale", "Recorded over true velocity.  [default: 1]", type=float)
@option("--time-offset", "s: a velocity stamped t is that of t + offset.  [default: 0]", type=float)
@option("--velocity-of-interval", "What a sample says.  [default: after]", type=click.Choice(INTERVALS))
@option("--linear-axes", "Axis convention of the linear velocity, such as x,-y,-z.")
@option("--angular-axes", "Axis convention of the angular velocity.")
@option("--features-per-frame", "Points tracked at a time.  [default: 70]", type=float)
@option("--track-length", "Median frames until a point is lost.  [default: 14]", type=float)
@option("--returning-share", "Share of tracks that are lost and found again.", type=float)
@option("--return-after", "s from the first sight of such a track to its second.", type=float)
@option("--sigma-pixel", "px, noise of each row.  [default: 0.5]", type=float)
@option("--row-correlation", "Between the noise of vL and vR.  [default: 0]", type=float)
@option("--wrong-share", "Share of wrong matches.  [default: 0.03]", type=float)
@option(
    "--burst",
    "Seconds, seconds and share of wrong matches; repeatable.",
    type=Interval("START", "END", "SHARE"),
    multiple=True,
)
@option("--blackout", "Seconds without features; repeatable.", type=Interval("START", "END"), multiple=True)
@option("--moving-share", "Share of observations on things that move.", type=float)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(output: Path, along: Path | None, force: bool, **given: Any) -> None:
    """Simulate a recording and write it to OUTPUT (.npz) with its truth.

    The file is the later course form plus `ground_truth` and `landmarks`, and `fgbaseline run` reads it.
    """
    from fgbaseline.data import read, write_npz
    from fgbaseline.data.simulate import Simulation, simulate
    from fgbaseline.geometry import InputError

    if output.exists() and not force:
        raise InputError(f"{output}: the file exists; choose another, or replace it with --force")
    settings = {name: value for name, value in given.items() if value not in (None, ())}
    for many, one in (("bursts", "burst"), ("blackouts", "blackout")):
        if one in settings:
            settings[many] = settings.pop(one)
    if along is not None:
        settings["along"] = read(along)
        settings.setdefault("path", "along")
    sequence = simulate(Simulation(**settings))
    write_npz(sequence, output)
    click.echo(
        f"{output}: {sequence.n_frames} frames, {len(sequence.observations)} observations of "
        f"{sequence.n_landmarks} tracks"
    )
