"""`fgbaseline compare`: trajectories from anywhere against a reference."""

from pathlib import Path
from typing import Any

import click


class Direction(click.ParamType[tuple[float, ...]]):
    """Three numbers with commas between."""

    name = "X,Y,Z"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """The three numbers."""
        try:
            numbers = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) != 3:
            self.fail(f"expected three numbers such as 0,0,1, got {value!r}", param, ctx)
        return numbers


@click.command(
    epilog="Example: fgbaseline compare truth.tum mine=out.tum --align yaw --out out/comparison\n\n"
    "\b\nAgainst a run, with reprojection of your own landmarks:\n"
    "fgbaseline compare out/drive mine.tum --sequence out/problem --landmarks mine.csv --out out/comparison"
)
@click.argument("reference")
@click.argument("estimates", nargs=-1, metavar="[NAME=]ESTIMATE...")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for tables, figures and report.html.")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier comparison.")
@click.option(
    "--align",
    type=click.Choice(["none", "first-pose", "yaw", "se3", "sim3"]),
    help="What an estimate may be moved by.  [default: none against a run, whose world is theirs; else se3]",
)
@click.option("--align-first", type=click.IntRange(min=1), metavar="N", help="Align over the first N poses.")
@click.option(
    "--up",
    type=Direction(),
    help="Up in the reference's world.  [default: 0,-1,0 in KITTI files; else by the run or --sequence, else 0,0,1]",
)
@click.option(
    "--association",
    type=click.Choice(["nearest", "interpolated"]),
    default="nearest",
    show_default=True,
    help="How poses are paired in time, each at most once.",
)
@click.option("--tolerance", type=float, metavar="S", help="Largest difference in time of a pair.  [default: 0.01]")
@click.option("--offset", type=float, default=0.0, metavar="S", help="Added to the stamps of the estimates.")
@click.option("--search-offset", type=float, metavar="S", help="Search for the offset within so many seconds.")
@click.option(
    "--delta",
    "deltas",
    multiple=True,
    metavar="LENGTH",
    help="Of relative errors: 1s, 10m, 30deg or 5frames; may be given again.  [default: 1s and 10m]",
)
@click.option("--all-pairs", is_flag=True, help="Relative errors from every pose, not end to end.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["tum", "kitti", "euroc", "npz"]),
    help="Insist on a format of the files.  [default: detected from the content]",
)
@click.option(
    "--times",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Time stamps of KITTI files, one a line; may be given again: each file takes those that are as many.",
)
@click.option(
    "--time-unit",
    type=click.Choice(["s", "ms", "us", "ns"]),
    help="Of time stamps whose unit is in doubt.  [default: by header, size, rate and the other file]",
)
@click.option(
    "--quaternion",
    type=click.Choice(["xyzw", "wxyz"]),
    help="Order of quaternions that no header names.  [default: as usual in the format, unless the other fits better]",
)
@click.option(
    "--lever-arm",
    type=Direction(),
    help="The point that the reference follows, m, in the estimate's body, whose orientations carry it.",
)
@click.option("--align-body", is_flag=True, help="Remove a constant rotation between the bodies.")
@click.option(
    "--sequence",
    type=click.Path(path_type=Path),
    help="The recording, or the folder of fgbaseline export: adds reprojection.",
)
@click.option(
    "--landmarks",
    multiple=True,
    metavar="[NAME=]FILE",
    help="Landmarks of an estimate: CSV with id,x,y,z, id being the index in --sequence; may be given again.",
)
@click.option(
    "--held-out",
    type=float,
    default=0.0,
    metavar="SHARE",
    help="Judge all paths by this share of the recording's tracks; export with the same SHARE and --seed for a filter "
    "that has not seen them.  [default: as the run]",
)
@click.option(
    "--reference-body", type=click.Choice(["imu", "camera"]), default="imu", help="Whose poses the reference has."
)
@click.option(
    "--estimate-body", type=click.Choice(["imu", "camera"]), default="imu", help="Whose poses the estimates have."
)
@click.option(
    "--extrinsic",
    type=click.Path(path_type=Path),
    help="imu_T_cam, one line of 12 numbers.  [default: of --sequence]",
)
@click.option(
    "--beside", default="all", show_default=True, help="Estimators of the run to show too: names, all or none."
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the bootstrap and --held-out."
)
def command(
    reference: str,
    estimates: tuple[str, ...],
    landmarks: tuple[str, ...],
    deltas: tuple[str, ...],
    out: Path | None,
    force: bool,
    **options: Any,
) -> None:
    """Compare each ESTIMATE with REFERENCE: TUM, KITTI, EuRoC CSV or npz files.

    REFERENCE may also be the folder of a run: its reference is taken, the trust in it is printed first, and its other
    estimators are compared beside yours.

    Exits 0, or 2 on bad input.
    """
    import numpy as np

    from fgbaseline.compare.trajectory_comparison.metrics import compare_entries
    from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings
    from fgbaseline.data.formats.atomic_folder import require_free
    from fgbaseline.geometry import InputError

    from ..comparing.inputs import read_entries
    from ..phrases.comparison import caption, verdict
    from ..results.comparison import MARK
    from ..results.comparison_summary import summarize
    from ..tables import print_table
    from ..tables.comparison import comparison_table

    settings = Settings(**options, deltas=tuple(Delta.parse(text) for text in deltas))
    if out is not None:
        require_free(out, force=force, mark=MARK)
    elif force:
        raise InputError("force: there is no folder to replace; add --out DIR")
    with np.errstate(all="ignore"):
        comparison = compare_entries(read_entries(reference, estimates, landmarks, settings), settings)
    summary = summarize(comparison, caption(comparison))
    if out is not None:
        from ..comparing.folder import write

        write(comparison, summary, out, force=force)
    first, *others = verdict(comparison)
    click.echo(f"{first}\n")
    print_table(comparison_table(comparison, summary), wrap_names=False)
    click.echo("\n".join([f"{summary.caption}\n", *others]))
    if out is not None:
        click.echo(f"\nThe report is in {out / 'report.html'}")
