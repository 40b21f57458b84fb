"""`fgbaseline run`: every estimator, the comparison and the report."""

from pathlib import Path
from typing import Any

import click

from . import options

DEFAULT_ESTIMATORS = "dead-reckoning,ekf,isam2,isam2-online"


@click.command(
    epilog="Example: fgbaseline run drive.npz --truth poses.txt --truth-frame camera --out out/drive",
)
@click.argument("sequence", required=False, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder to write.  [default: out/NAME]")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier run.")
@options.preset
@click.option("--estimators", default=DEFAULT_ESTIMATORS, show_default=True, help="Names, separated by commas.")
@options.features
@click.option(
    "--landmarks",
    type=click.Choice(["in-turn", "held"]),
    default="in-turn",
    show_default=True,
    help="Whether the documented SLAM updates landmarks in turn with the pose or holds the mapping's.",
)
@click.option("--truth", type=click.Path(path_type=Path), help="Ground truth: a trajectory file.")
@click.option(
    "--truth-frame", type=click.Choice(["camera", "imu"]), help="The body whose poses the ground truth gives."
)
@click.option(
    "--as-recorded",
    is_flag=True,
    help="No diagnosis: the recording as it is, velocity k moving frame k to k + 1, with assumed noise (calibrated).",
)
@options.imu
@options.imu_calibration
@options.images
@options.time_unit
@click.option(
    "--repairs",
    type=click.Path(path_type=Path),
    help="TOML file of repairs set by hand; what it leaves out comes from the diagnosis (calibrated).",
)
@click.option(
    "--held-out",
    type=float,
    default=0.0,
    show_default=True,
    help="Share of the tracks that diagnosis and estimators never see, to rank the paths by.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of the simulated drive, and of which tracks are held out.",
)
@click.option(
    "--rerun",
    "rerun_file",
    metavar="FILE.rrd",
    type=click.Path(path_type=Path),
    help="Also write a recording for the viewer Rerun (needs the extra fgbaseline[rerun]).",
)
def command(
    out: Path | None,
    force: bool,
    estimators: str,
    landmarks: str,
    time_unit: str | None,
    rerun_file: Path | None,
    topics: str | None,
    settings: Path | None,
    **given: Any,
) -> int:
    """Run all estimators on SEQUENCE, compare them and write a report.

    SEQUENCE is a recording of tracks, or a folder or ROS bag of stereo images: they are tracked, and the tracks stay in
    tracks.npz in the folder of the run.

    Without SEQUENCE: on a simulated drive of a minute through a town, with known truth.

    Exits 0 when every estimator gave an answer, 1 when one failed (the report is written all the same), 2 on bad
    input.
    """
    from fgbaseline.data import LandmarkMode, TimeUnit
    from fgbaseline.reports.cli.run_output import report
    from fgbaseline.reports.run.problem import RunSettings

    chosen = RunSettings(
        estimators=tuple(name.strip() for name in estimators.split(",") if name.strip()),
        landmarks=LandmarkMode(landmarks),
        time_unit=None if time_unit is None else TimeUnit(time_unit),
        topics=options.topic_names(topics),
        tracker=settings,
        **given,
    )
    return report(chosen, out, force=force, rerun_file=rerun_file)
