"""`fgbaseline diagnose`: what is wrong with a recording."""

from pathlib import Path

import click

from . import options


@click.command(epilog="Example: fgbaseline diagnose drive.npz --out out/diagnosis")
@click.argument("sequence", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for diagnosis.json and figures.")
@click.option("--json", "as_json", is_flag=True, help="Print diagnosis.json alone on standard output.")
@click.option(
    "--write-repairs",
    type=click.Path(path_type=Path),
    help="TOML file to write what was found to, for run --repairs, to be edited by hand.",
)
@options.imu
@options.imu_calibration
@options.time_unit
@click.option("--force", is_flag=True, help="Replace the folder, or the repairs, of an earlier diagnosis.")
def command(
    sequence: Path,
    out: Path | None,
    as_json: bool,
    write_repairs: Path | None,
    imu: Path | None,
    imu_calibration: Path | None,
    time_unit: str | None,
    force: bool,
) -> int:
    """Find what is wrong with SEQUENCE: units, axes, bias, delay, scale, extrinsic, tracks; and how large its noise is.

    From the recording alone: ground truth in it is not looked at. `fgbaseline run` repairs what is found here.

    Exits 0 when the recording is clean, 1 with findings, 2 when it cannot tell, and on bad input.
    """
    from fgbaseline.data import TimeUnit, read
    from fgbaseline.reports.run.diagnose import print_diagnosis

    unit = None if time_unit is None else TimeUnit(time_unit)
    recording = read(sequence, time_unit=unit, imu=imu, imu_calibration=imu_calibration)
    return print_diagnosis(recording, out, as_json=as_json, repairs=write_repairs, force=force)
