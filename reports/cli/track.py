"""`fgbaseline track`: from images to stereo tracks."""

from pathlib import Path
from typing import Any

import click

from . import options


@click.command(epilog="Example: fgbaseline track V1_01_easy --out out/tracks.npz")
@click.argument("source", metavar="INPUT", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Npz to write.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
@options.imu
@options.imu_calibration
@options.images
def command(source: Path, out: Path, force: bool, settings: Path | None, topics: str | None, **given: Any) -> int:
    """Track the stereo images in INPUT: a EuRoC, TUM-VI or KITTI folder, two folders, or a ROS bag.

    Rectified pairs, Lucas-Kanade from frame to frame and from left to right; what a check rejects ends its track. The
    npz is a recording for run and diagnose. Without motion in INPUT, run needs --imu or --velocities, and --extrinsic.
    """
    from fgbaseline.data.tracking import ImageOptions
    from fgbaseline.reports.run.images import write_tracks

    return write_tracks(source, out, ImageOptions(topics=options.topic_names(topics), **given), settings, force=force)
