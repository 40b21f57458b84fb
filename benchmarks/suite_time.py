"""Time of the tests that two revisions have in common: `python -m benchmarks.suite_time --tests tests/geometry`.

Each revision runs its own tests (those marked `full` left out) in an environment of its own, on two workers. Tests are
the same where file and name are, with their parameters; those that do not pass on both sides are left out.
"""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import click
import numpy as np

from .claim_table import Row, table
from .revision import BEFORE, environment
from .waiting import ONE_THREAD

WANTED = 0.6
RECORDINGS = "FGBASELINE_RECORDINGS"


def seconds(folder: Path, revision: str | None, tests: str) -> dict[tuple[str, str], float]:
    """Seconds of each test that passes, by file and name; set-up and teardown are part of it."""
    place = environment(folder, revision)
    source, python = place.parent / "source", place / "bin" / "python"
    group = f"{source / 'pyproject.toml'}:dev"
    uv = Path(sys.executable).with_name("uv")
    subprocess.run([uv, "pip", "install", "--quiet", "--python", python, "--group", group], check=True)
    report = folder / f"{revision or 'today'}.xml"
    words = [
        python,
        "-m",
        "pytest",
        "-q",
        "-n",
        "2",
        "--dist",
        "loadfile",
        "-m",
        "not full",
        f"--junitxml={report}",
        tests,
    ]
    subprocess.run(words, cwd=source, env=os.environ | ONE_THREAD, stdout=subprocess.DEVNULL, check=False)
    cases = [case for case in ElementTree.parse(report).iter("testcase") if len(case) == 0]
    return {
        (case.attrib["classname"].rpartition(".")[2], case.attrib["name"]): float(case.attrib["time"]) for case in cases
    }


def rows(tests: str) -> list[Row]:
    """The ratio over all tests in common, and how many these are."""
    with TemporaryDirectory(prefix="fgbaseline-") as folder:
        ours, theirs = (seconds(Path(folder), revision, tests) for revision in (None, BEFORE))
    common = ours.keys() & theirs.keys()
    if not common:
        raise click.ClickException(f"no test in {tests} passes on both sides")
    ratio = sum(ours[test] for test in common) / sum(theirs[test] for test in common)
    quartiles = np.quantile([ours[test] / max(theirs[test], 1e-3) for test in common], [0.25, 0.75])
    claim = f"`make test`, {len(common):,} tests of {tests} that {BEFORE} has too, to {BEFORE}"
    spread = f"{quartiles[0]:.2f} to {quartiles[1]:.2f} (half of the tests)"
    return [Row(claim, f"at most {WANTED:g} times", f"{ratio:.2f} times", spread, ratio <= WANTED)]


@click.command()
@click.option("--tests", default="tests", show_default=True, help="Folder or file of both revisions.")
@click.option("--recordings", type=click.Path(path_type=Path, exists=True, file_okay=False), help="Real recordings.")
def main(tests: str, recordings: Path | None) -> None:
    """Print the table; the whole takes as long as the tests of both revisions."""
    if recordings is not None:
        os.environ[RECORDINGS] = str(recordings.resolve())
    click.echo(table(rows(tests)))


if __name__ == "__main__":
    main()
