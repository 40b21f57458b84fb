"""`fgbaseline export`: the problem as plain files, for a filter in any language."""

from pathlib import Path
from typing import Literal

import click

from .run import FeatureCount


@click.command(epilog="Example: fgbaseline export drive.npz --out out/problem")
@click.argument("sequence", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier export.")
@click.option(
    "--preset",
    type=click.Choice(["calibrated", "documented"]),
    default="calibrated",
    show_default=True,
    help="How the problem is posed: what the data supports, or as the report has it.",
)
@click.option(
    "--features",
    type=FeatureCount(),
    help="How many landmarks, those seen most often.  [default: all; 1000 for the documented preset]",
)
@click.option(
    "--as-recorded", is_flag=True, help="No diagnosis: take the recording as it is, with assumed noise (calibrated)."
)
@click.option("--repairs", type=click.Path(path_type=Path), help="TOML file of what is set by hand, as for run.")
@click.option(
    "--held-out", type=float, default=0.0, metavar="SHARE", help="Keep this share of the tracks out, as run does."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of what is held out.")
def command(
    sequence: Path,
    out: Path,
    force: bool,
    preset: Literal["calibrated", "documented"],
    features: int | Literal["all"] | None,
    as_recorded: bool,
    repairs: Path | None,
    held_out: float,
    seed: int,
) -> int:
    """Write the problem that `fgbaseline run` would solve on SEQUENCE: npz, CSV and JSON.

    Repaired velocities and increments with their covariances, observations with the mask, noise, kernel, priors,
    calibration and time stamps: whoever solves it, in any language, solves the same problem. What comes out of it goes
    back through `fgbaseline compare`. Ground truth is not exported.
    """
    from fgbaseline.reports.run.export import export
    from fgbaseline.reports.run.job import RunSettings

    settings = RunSettings(
        sequence=sequence,
        preset=preset,
        features=features,
        as_recorded=as_recorded,
        held_out=held_out,
        seed=seed,
        repairs=repairs,
    )
    return export(settings, out, force=force)
