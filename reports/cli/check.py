"""`fgbaseline check`: accuracy limits that hold in CI."""

from pathlib import Path

import click

FILE = click.Path(path_type=Path)


@click.command(
    epilog="Example: fgbaseline check out/drive --limits limits.toml --baseline baseline.json --junit check.xml"
)
@click.argument("folder", metavar="DIR", type=FILE)
@click.option("--limits", required=True, type=FILE, metavar="FILE", help="What has to hold, in TOML (docs/ci.md).")
@click.option(
    "--baseline",
    type=FILE,
    metavar="FILE",
    help="How it was before: written by --update-baseline, or the summary.json of an earlier run.",
)
@click.option("--junit", type=FILE, metavar="FILE", help="Write JUnit XML, which CI systems show as tests.")
@click.option("--markdown", type=FILE, metavar="FILE", help="Write Markdown, for a comment on a pull request.")
@click.option("--json", "as_json", type=FILE, metavar="FILE", help="Write JSON, with every number in full.")
@click.option("--update-baseline", is_flag=True, help="Write the baseline anew, unless a limit falls short.")
@click.option("--accept-worse", is_flag=True, help="Let --update-baseline write although a limit falls short.")
def command(
    folder: Path,
    limits: Path,
    baseline: Path | None,
    junit: Path | None,
    markdown: Path | None,
    as_json: Path | None,
    update_baseline: bool,
    accept_worse: bool,
) -> int:
    """Hold what `run`, `compare` or `bench` left in DIR against limits, and against a baseline.

    On GitHub the table also goes to the page of the job (GITHUB_STEP_SUMMARY).

    Exits 0 when all limits hold, 1 when some fall short, 2 when it cannot tell (a figure rests on fewer than 30 poses
    or covers less than half of the time, the reference is untrusted, or there is no baseline to compare with), and on
    bad input.
    """
    from ..checking.command import Outputs, check

    outputs = Outputs(junit=junit, markdown=markdown, json=as_json)
    return check(folder, limits, baseline, outputs, update=update_baseline, accept_worse=accept_worse)
