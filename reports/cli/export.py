"""`fgbaseline export`: the problem as plain files, for a filter in any language."""

from pathlib import Path
from typing import Any

import click

from . import options


@click.command(epilog="Example: fgbaseline export drive.npz --out out/problem")
@click.argument("sequence", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier export.")
@options.preset
@options.features
@options.imu
@options.imu_calibration
@click.option(
    "--as-recorded", is_flag=True, help="No diagnosis: take the recording as it is, with assumed noise (calibrated)."
)
@click.option("--repairs", type=click.Path(path_type=Path), help="TOML file of what is set by hand, as for run.")
@click.option(
    "--held-out", type=float, default=0.0, metavar="SHARE", help="Keep this share of the tracks out, as run does."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of what is held out.")
def command(out: Path, force: bool, **given: Any) -> int:
    """Write the problem that `fgbaseline run` would solve on SEQUENCE: npz, CSV and JSON.

    Repaired velocities and increments with their covariances, observations with the mask, noise, kernel, priors,
    calibration and time stamps: whoever solves it, in any language, solves the same problem. What comes out of it goes
    back through `fgbaseline compare`. Ground truth is not exported.
    """
    from fgbaseline.reports.run.export import export
    from fgbaseline.reports.run.problem import RunSettings

    return export(RunSettings(**given), out, force=force)
