"""Time of the tests that two revisions have in common: `python -m benchmarks.suite_time --select bootstrap`.

Each revision runs its own tests (those marked `full` left out) in an environment of its own, on two workers. Tests are
the same where their names are, with the parameters: files moved. Names that occur twice, and tests that do not pass on
both sides, are left out.
"""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import click
import numpy as np

from .claim_table import Row, table
from .installed_revision import BEFORE, environment
from .latency import ONE_THREAD

WANTED = 0.6
RECORDINGS = "FGBASELINE_RECORDINGS"


def seconds(folder: Path, revision: str | None, select: str) -> dict[str, float]:
    """Seconds of each test that passes, by its name; set-up and teardown are part of it."""
    place = environment(folder, revision)
    source, python = place.parent / "source", place / "bin" / "python"
    group = f"{source / 'pyproject.toml'}:dev"
    uv = Path(sys.executable).with_name("uv")
    subprocess.run([uv, "pip", "install", "--quiet", "--python", python, "--group", group], check=True)
    report = folder / f"{revision or 'today'}.xml"
    words = [python, "-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", "-k", select, f"--junitxml={report}"]
    if '"full:' in (source / "pyproject.toml").read_text(encoding="utf-8"):  # an unknown marker is an error
        words += ["-m", "not full"]
    subprocess.run(words, cwd=source, env=os.environ | ONE_THREAD, stdout=subprocess.DEVNULL, check=False)
    cases = [case for case in ElementTree.parse(report).iter("testcase") if len(case) == 0]
    often = Counter(case.attrib["name"] for case in cases)
    return {name: float(case.attrib["time"]) for case in cases if often[name := case.attrib["name"]] == 1}


def rows(select: str) -> list[Row]:
    """The ratio over all tests in common, and how many these are."""
    with TemporaryDirectory(prefix="fgbaseline-") as folder:
        ours, theirs = (seconds(Path(folder), revision, select) for revision in (None, BEFORE))
    common = ours.keys() & theirs.keys()
    if not common:
        raise click.ClickException("no test passes on both sides")
    ratio = sum(ours[test] for test in common) / sum(theirs[test] for test in common)
    quartiles = np.quantile([ours[test] / max(theirs[test], 1e-3) for test in common], [0.25, 0.75])
    claim = f"`make test`, {len(common):,} tests that {BEFORE} has too, to {BEFORE}"
    spread = f"{quartiles[0]:.2f} to {quartiles[1]:.2f} (half of the tests)"
    return [Row(claim, f"at most {WANTED:g} times", f"{ratio:.2f} times", spread, ratio <= WANTED)]


@click.command()
@click.option("--select", default="", metavar="EXPRESSION", help="Tests that pytest selects by -k; by default all.")
@click.option("--recordings", type=click.Path(path_type=Path, exists=True, file_okay=False), help="Real recordings.")
def main(select: str, recordings: Path | None) -> None:
    """Print the table; the whole takes as long as the tests of both revisions."""
    if recordings is not None:
        os.environ[RECORDINGS] = str(recordings.resolve())
    click.echo(table(rows(select)))


if __name__ == "__main__":
    main()
