"""Commands that make experiments: `simulate`, `bench` and `reproduce`."""

from pathlib import Path
from typing import Any

import click

from .options import PATH, Numbers

PATHS = ("town", "loop", "highway", "handheld", "drone", "along")
DENSITIES = ("gyroscope_density", "gyroscope_walk", "accelerometer_density", "accelerometer_walk")


@click.command(epilog="Example: fgbaseline simulate drive.npz --path loop --duration 120 --burst 20:22:0.5 --seed 7")
@click.argument("output", type=PATH)
@click.option("--path", help="Shape of the drive.  [default: town]", type=click.Choice(PATHS))
@click.option("--along", help="Recording whose velocities are the motion (path 'along').", type=PATH)
@click.option(
    "--along-gyro-bias", help="rad/s, first subtracted from the rates of --along.", type=(float, float, float)
)
@click.option("--duration", help="Seconds.  [default: 60, or all of --along]", type=float)
@click.option("--frame-rate", help="Frames a second.  [default: 10]", type=float)
@click.option("--seed", help="The same seed gives the same bytes.  [default: 0]", type=int)
@click.option("--standing", help="Seconds at rest before the motion starts.  [default: 0]", type=float)
@click.option("--imu", is_flag=True, help="Raw inertial samples in place of body velocities.")
@click.option(
    "--cameras",
    help="Both cameras, or the left one alone with --imu.  [default: stereo]",
    type=click.Choice(["stereo", "left"]),
)
@click.option("--imu-rate", help="Hz, with --imu.  [default: 200]", type=float)
@click.option(
    "--imu-noise",
    help="With --imu: noise density and random walk of the gyroscope, then of the accelerometer (continuous time).  "
    "[default: 1.7e-4 2e-5 2e-3 3e-3]",
    type=(float, float, float, float),
)
@click.option("--accelerometer-bias", help="m/s^2, with --imu.", type=(float, float, float))
@click.option("--sigma-linear", help="m/s, 1-sigma noise of a linear velocity sample.  [default: 0.1]", type=float)
@click.option(
    "--sigma-angular", help="rad/s, 1-sigma noise of an angular velocity sample.  [default: 0.01]", type=float
)
@click.option("--gyro-bias", help="rad/s, in recorded axes.", type=(float, float, float))
@click.option("--velocity-scale", help="Recorded over true velocity.  [default: 1]", type=float)
@click.option("--time-offset", help="s: a velocity stamped t was measured at t + offset.  [default: 0]", type=float)
@click.option(
    "--velocity-of-interval",
    help="Interval that a velocity belongs to: after or before its frame, or the mean of both.  [default: after]",
    type=click.Choice(["after", "before", "mean"]),
)
@click.option("--linear-axes", help="Axis convention of the linear velocity, such as x,-y,-z.")
@click.option("--angular-axes", help="Axis convention of the angular velocity.")
@click.option("--features-per-frame", help="Number of tracks in a frame.  [default: 70]", type=float)
@click.option("--track-length", help="Median length of a track, frames.  [default: 14]", type=float)
@click.option("--returning-share", help="Share of tracks that are lost and found again.", type=float)
@click.option("--return-after", help="s from the first observation of such a track to its return.", type=float)
@click.option("--sigma-pixel", help="px, 1-sigma noise of each pixel row.  [default: 0.5]", type=float)
@click.option("--row-correlation", help="Correlation of the noise of vL and vR.  [default: 0]", type=float)
@click.option("--wrong-share", help="Share of wrong matches.  [default: 0.03]", type=float)
@click.option(
    "--burst",
    "bursts",
    help="Share of wrong matches between two times, s; repeatable.",
    type=Numbers("START:END:SHARE", "START:END:SHARE in numbers"),
    multiple=True,
)
@click.option(
    "--blackout",
    "blackouts",
    help="Time without features, s; repeatable.",
    type=Numbers("START:END", "START:END in numbers"),
    multiple=True,
)
@click.option("--moving-share", help="Share of observations on moving objects.", type=float)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def simulate(
    output: Path,
    along: Path | None,
    force: bool,
    imu: bool,
    imu_rate: float | None,
    imu_noise: tuple[float, float, float, float] | None,
    accelerometer_bias: tuple[float, float, float] | None,
    **given: Any,
) -> None:
    """Simulate a recording with its ground truth.

    OUTPUT is an npz file. It has the arrays of docs/formats.md, with `ground_truth` and `landmarks`; `fgbaseline run`
    reads it.

    Exits 0, or 2 on bad input.
    """
    from fgbaseline.data import read, write_npz
    from fgbaseline.data.formats.files.atomic_write import require_new
    from fgbaseline.data.simulate import SimulatedImu, Simulation
    from fgbaseline.data.simulate import simulate as simulated
    from fgbaseline.data.wording import plural
    from fgbaseline.geometry import InputError

    if output.suffix != ".npz":
        raise InputError(f"{output}: a recording is written as .npz; give a name that ends with it")
    require_new(output, force=force)
    settings = {name: value for name, value in given.items() if value not in (None, ())}
    inertial: dict[str, Any] = {"rate": imu_rate, "accelerometer_bias": accelerometer_bias}
    if imu_noise is not None:
        inertial |= dict(zip(DENSITIES, imu_noise, strict=True))
    inertial = {name: value for name, value in inertial.items() if value is not None}
    if inertial and not imu:
        raise InputError("imu-rate, imu-noise, accelerometer-bias: they are settings of --imu; add it")
    if imu:
        settings["imu"] = SimulatedImu(**inertial)
    if along is not None:
        settings["along"] = read(along)
        settings.setdefault("path", "along")
    sequence = simulated(Simulation(**settings))
    write_npz(sequence, output, force=force)
    click.echo(
        f"{output}: {plural(sequence.n_frames, 'frame')}, {plural(len(sequence.observations), 'observation')} of "
        f"{plural(sequence.n_landmarks, 'track')}"
    )


@click.command(epilog="Example: fgbaseline bench suites/quick.toml --out out/bench/quick")
@click.argument("suite", type=PATH)
@click.option("--out", type=PATH, help="Folder to write.  [default: out/bench/NAME]")
@click.option(
    "--data",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="Folder of the suite's relative paths.  [default: the suite's folder]",
)
@click.option("--workers", type=click.IntRange(min=1), help="Processes.  [default: one for each core]")
@click.option("--scheduler", metavar="ADDRESS", help="Run on this Dask cluster instead (fgbaseline[cluster]).")
@click.option("--force", is_flag=True, help="Run every job again.")
def bench(
    suite: Path, out: Path | None, data: Path | None, workers: int | None, scheduler: str | None, force: bool
) -> int:
    """Run every recording, setting and seed of SUITE.

    SUITE is a TOML file. A benchmark report is written. Finished runs are kept: the same command resumes an
    interrupted bench, and runs again only what has changed: a recording, a setting, the source code. docs/bench.md
    describes suites and report.

    Exits 0 when every estimator succeeded in every run, 1 when one failed, 2 on bad input.
    """
    from fgbaseline.geometry import InputError

    from ..bench.command import bench as run_bench

    if workers is not None and scheduler is not None:
        raise InputError("workers: it is for this machine, and a cluster has its own; leave it out with --scheduler")
    return run_bench(suite, out, data=data, workers=workers, scheduler=scheduler, force=force)


@click.command(epilog="Example: fgbaseline reproduce 03.npz 10.npz --out out/reproduction")
@click.argument("sequence", metavar="RECORDING...", nargs=-1, required=True, type=PATH)
@click.option("--out", type=PATH, default=Path("out/reproduction"), show_default=True, help="Folder to write.")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier reproduction.")
@click.option(
    "--sweep-features",
    type=Numbers("N,N,...", "whole numbers from 1 on, separated by commas", of=int),
    default="200,400,700,1000",
    show_default=True,
    help="Numbers of features of the sweep.",
)
@click.option(
    "--sweep-noise",
    type=Numbers("V,V,...", "numbers above 0, separated by commas"),
    default="0.01,1,15,100",
    show_default=True,
    help="Variances V of the sweep, px², of each pixel row.",
)
def reproduce(
    sequence: tuple[Path, ...], out: Path, force: bool, sweep_features: tuple[int, ...], sweep_noise: tuple[float, ...]
) -> int:
    """Draw the source paper's figures and test its claims.

    The source paper's recordings are 03.npz and 10.npz, recognized by their numbers of frames; others get figures of
    the same kind. For a recording without features, the trajectory is drawn. The other figures use features simulated
    along it, and say so. Each claim has the measured value, its cause, and the result on the repaired recording.

    Exits 0 when the reproduction is written, whatever the claims' results, and 2 on bad input.
    """
    from ..reproduction.command import reproduce as run_reproduction
    from ..reproduction.experiments import SweepSettings

    return run_reproduction(sequence, out, SweepSettings(sweep_features, sweep_noise), force=force)
