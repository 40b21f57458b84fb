"""Commands that evaluate and present what others have written: `compare`, `check` and `figures`."""

from pathlib import Path
from typing import Any

import click

from .options import BODY, PATH, UNITS, XYZ, Formats, NamedFile, choice, open_page, seed


@click.command(
    epilog="Example: fgbaseline compare truth.tum mine=out.tum --align yaw --out out/comparison\n\n"
    "\b\nAgainst a run, with reprojection of your own landmarks:\n"
    "fgbaseline compare out/drive mine.tum --sequence out/problem --landmarks mine.csv --out out/comparison"
)
@click.argument("reference", type=NamedFile())
@click.argument("estimates", nargs=-1, type=NamedFile(), metavar="[NAME=]ESTIMATE...")
@click.option("--out", type=PATH, help="Folder for tables, figures and report.html.")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier comparison.")
@open_page
@click.option(
    "--align",
    type=click.Choice(["none", "first-pose", "yaw", "se3", "sim3"]),
    help="Alignment of each estimate.  [default: none against a run, which has the same world frame; else se3]",
)
@click.option("--align-first", type=click.IntRange(min=1), metavar="N", help="Align over the first N poses.")
@click.option(
    "--up",
    type=XYZ,
    help="Up direction in the reference's world frame.  [default: the first found of: the reference's comment "
    "'# up x y z' or KITTI's format, the run, --sequence, an estimate's comment; else 0,0,1]",
)
@choice("--association", "nearest", "interpolated", what="Association of poses by time, each at most once.")
@click.option("--tolerance", type=float, metavar="S", help="Largest time difference of a pair.  [default: 0.01]")
@click.option("--offset", type=float, default=0.0, metavar="S", help="Added to the stamps of the estimates.")
@click.option("--search-offset", type=float, metavar="S", help="Estimate the time offset, within +-S.")
@click.option(
    "--delta",
    "deltas",
    multiple=True,
    metavar="LENGTH",
    help="Delta of the relative errors: 1s, 10m, 30deg or 5frames; repeatable.  [default: 1s and 10m]",
)
@click.option(
    "--all-pairs", is_flag=True, help="Relative errors over all pairs, not consecutive ones (evo: --all_pairs)."
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["tum", "kitti", "euroc", "npz"]),
    help="Format of the files.  [default: detected from the content]",
)
@click.option(
    "--times",
    multiple=True,
    type=PATH,
    help="Time stamps of KITTI files, one a line. Repeatable: each KITTI file takes the stamps that are as many as its "
    "poses.",
)
@click.option(
    "--time-unit",
    type=UNITS,
    help="Unit of ambiguous time stamps.  [default: detected from the header, magnitude, rate and the other file]",
)
@click.option(
    "--quaternion",
    type=click.Choice(["xyzw", "wxyz"]),
    help="Order of quaternions without a header.  [default: the format's, unless the other fits better]",
)
@click.option(
    "--lever-arm",
    type=XYZ,
    help="Lever arm, m: position of the reference's body in the estimate's body frame, rotated by the estimate's "
    "orientation.",
)
@click.option("--align-body", is_flag=True, help="Remove a constant rotation between the body frames.")
@click.option(
    "--sequence", type=PATH, help="The recording, or the folder of fgbaseline export: adds reprojection errors."
)
@click.option(
    "--landmarks",
    multiple=True,
    type=NamedFile(),
    metavar="[NAME=]FILE",
    help="Landmarks of an estimate: CSV with id,x,y,z, id being the index in --sequence; repeatable.",
)
@click.option(
    "--held-out",
    type=float,
    default=0.0,
    metavar="SHARE",
    help="Rank all trajectories by how they predict this share of the recording's tracks. To withhold these from your "
    "filter, export its problem with the same SHARE and --seed.  [default: as the run]",
)
@click.option(
    "--reference-body", type=BODY, default="imu", help="Frame of the reference's poses: world_T_imu or world_T_camera."
)
@click.option(
    "--estimate-body", type=BODY, default="imu", help="Frame of the estimates' poses: world_T_imu or world_T_camera."
)
@click.option("--extrinsic", type=PATH, help="imu_T_cam, one line of 12 numbers.  [default: of --sequence]")
@click.option(
    "--beside", default="all", show_default=True, help="Estimators of the run to compare as well: names, all or none."
)
@seed("the bootstrap and of the choice of held-out tracks")
def compare(
    reference: str,
    estimates: tuple[str, ...],
    landmarks: tuple[str, ...],
    deltas: tuple[str, ...],
    out: Path | None,
    force: bool,
    opened: bool,
    **options: Any,
) -> None:
    """Compare each ESTIMATE with REFERENCE.

    Both are trajectories: TUM, KITTI, EuRoC, OpenVINS or npz files, or ROS bags. REFERENCE may also be the folder of
    a run. Then its reference is used, the trust in it is printed first, and its other estimators are compared too.

    Exits 0, or 2 on bad input.
    """
    from fgbaseline.data.formats.files.atomic_folder import require_free
    from fgbaseline.geometry import InputError

    from ..comparison import compare as compare_files
    from ..results.json_files import COMPARISON

    if out is not None:
        require_free(out, force=force, mark=COMPARISON)
    elif force or opened:
        option, what = ("force", "folder to replace") if force else ("open", "page")
        raise InputError(f"{option}: there is no {what}; add --out DIR")
    report = compare_files(reference, *estimates, landmarks=landmarks, deltas=deltas, drawn=out is not None, **options)
    from ..open_page import announce, print_sentences
    from ..phrases.evidence import FIRST
    from ..tables.writers import print_table

    page = None if out is None else report.report(out, force=force)
    first, *others = report.verdict
    print_sentences([first], mark="")
    click.echo()
    print_table(report.text_table, wrap_names=False)
    print_sentences([report.caption], mark="")
    click.echo()
    print_sentences(others, None if page is None else FIRST - 1)
    if page is not None:
        announce(page, opened=opened)


@click.command(
    epilog="Example: fgbaseline check out/drive --limits limits.toml --baseline baseline.json --junit check.xml"
)
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("--limits", required=True, type=PATH, metavar="FILE", help="Limits, in TOML (docs/ci.md).")
@click.option(
    "--baseline",
    type=PATH,
    metavar="FILE",
    help="Earlier metrics: written by --update-baseline, or the summary.json of an earlier run.",
)
@click.option("--junit", type=PATH, metavar="FILE", help="Write JUnit XML, which CI systems show as tests.")
@click.option("--markdown", type=PATH, metavar="FILE", help="Write Markdown, for a comment on a pull request.")
@click.option("--json", "as_json", type=PATH, metavar="FILE", help="Write JSON, with all digits.")
@click.option("--update-baseline", is_flag=True, help="Write a new accuracy baseline, unless a limit is violated.")
@click.option("--accept-worse", is_flag=True, help="Let --update-baseline write although a limit is violated.")
def check(
    folder: Path,
    limits: Path,
    baseline: Path | None,
    junit: Path | None,
    markdown: Path | None,
    as_json: Path | None,
    update_baseline: bool,
    accept_worse: bool,
) -> int:
    """Check the metrics in DIR against limits.

    DIR is the folder of `run`, `compare` or `bench`. Limits may refer to an accuracy baseline, the metrics of an
    earlier run. On GitHub the table also goes to the page of the job
    (GITHUB_STEP_SUMMARY).

    Exits 0 when all limits hold, 1 when one is violated, 2 when one is undecided, and on bad input. A limit is
    undecided when its metric has fewer than 30 poses or covers less than half of the time, when the reference is
    untrusted, or when there is no accuracy baseline to compare with.
    """
    from fgbaseline.data.formats.files.toml_text import toml_values

    from ..results.json_files import document_in, read_document

    values, summary = toml_values(limits), document_in(folder)
    document = read_document(summary)  # faults of both files are reported before their models are imported
    from ..accuracy_check.command import Outputs
    from ..accuracy_check.command import check as check_measured
    from ..accuracy_check.limits import read_limits
    from ..results.reader import read_measured

    measured, outputs = read_measured(summary, document), Outputs(junit, markdown, as_json)
    options = {"update": update_baseline, "accept_worse": accept_worse}
    return check_measured(measured, read_limits(limits, values), baseline, outputs, **options)


@click.command(epilog="Example: fgbaseline figures out/drive --format pdf --out paper/figures")
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("--format", "formats", type=Formats(), default="pdf", show_default=True, help="One or more of these.")
@click.option("--out", type=PATH, help="Folder to write.  [default: DIR/paper]")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier call.")
def figures(folder: Path, formats: tuple[str, ...], out: Path | None, force: bool) -> int:
    """Draw the figures in DIR again, for a paper.

    DIR is the folder of a run or comparison. The figures are one column wide, with letters of 7 points, embedded
    fonts, and lines that differ without color. They show what is in the folder; nothing is computed again.
    captions.json has a caption for each.

    Exits 0, or 2 on bad input.
    """
    from fgbaseline.data.formats.files.atomic_folder import atomic_folder
    from fgbaseline.data.wording import plural

    from ..results.json_files import COMPARISON, document_in, read_document

    file = document_in(folder, "run or compare")
    read_document(file)  # a fault is reported before matplotlib is imported
    from ..figures.comparison import draw_for_paper as draw_comparison
    from ..figures.comparison_data import of_comparison_folder
    from ..figures.drawing import CAPTIONS, save, save_captions
    from ..figures.run import draw_for_paper as draw_run
    from ..figures.run_data import of_folder
    from ..figures.style import PAPER

    place = out or folder / "paper"
    drawn = draw_comparison(of_comparison_folder(folder)) if file.name == COMPARISON else draw_run(of_folder(folder))
    with atomic_folder(place, force=force, mark=CAPTIONS) as building:
        save({name: figure for name, (figure, _) in drawn.items()}, building, formats, PAPER)
        save_captions({name: caption for name, (_, caption) in drawn.items()}, building)
    click.echo(f"{plural(len(drawn), 'figure')} as {', '.join(formats)} in {place}")
    return 0
