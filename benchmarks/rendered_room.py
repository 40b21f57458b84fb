"""A folder of rendered stereo images with IMU data and ground truth: `python -m benchmarks.rendered_room FOLDER`."""

import shutil
from pathlib import Path

import click

from tests.builders.rendered import SwayingRoom


@click.command()
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@click.option("--frames", default=100, show_default=True, help="Number of stereo pairs, at 20 Hz.")
def main(folder: Path, frames: int) -> None:
    """Writes FOLDER in EuRoC's form, in place of what an earlier call wrote there."""
    shutil.rmtree(folder / "mav0", ignore_errors=True)
    SwayingRoom(frames).write_euroc(folder)


if __name__ == "__main__":
    main()
