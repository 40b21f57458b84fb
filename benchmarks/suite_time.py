"""CPU time of the tests that two revisions have in common: `python -m benchmarks.suite_time --select bootstrap`.

Each revision runs its own files (tests marked `full` left out) in an environment of its own, on two workers. Tests are
the same where their names are, with the parameters: files moved. Names that occur twice, and tests that do not pass on
both sides, are left out.
"""

import os
import subprocess
import sys
from collections import Counter
from functools import cache
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


@cache
def environment_of_tests(folder: Path, revision: str | None) -> tuple[Path, Path]:
    """Sources of a revision, and the Python of its environment with the packages of its tests."""
    place = environment(folder, revision)
    source, python = place.parent / "source", place / "bin" / "python"
    group = f"{source / 'pyproject.toml'}:dev"
    uv = Path(sys.executable).with_name("uv")
    subprocess.run([uv, "pip", "install", "--quiet", "--python", python, "--group", group], check=True)
    return source, python


def pytest(folder: Path, revision: str | None, *words: str | Path, **variables: str) -> str:
    """What pytest prints for the tests of a revision, in its environment, with our plugin."""
    source, python = environment_of_tests(folder, revision)
    everything = os.environ | ONE_THREAD | {"PYTHONPATH": str(Path(__file__).parent)} | variables
    command = [python, "-m", "pytest", "-q", "-p", "cpu_time_plugin", *words]
    if '"full:' in (source / "pyproject.toml").read_text(encoding="utf-8"):  # an unknown marker is an error
        command += ["-m", "not full"]
    return subprocess.run(command, cwd=source, env=everything, stdout=subprocess.PIPE, text=True, check=False).stdout


def names(folder: Path, revision: str | None, select: str) -> set[str]:
    """Names of a revision's tests that occur once."""
    collected = pytest(folder, revision, "--collect-only", "-k", select)
    often = Counter(line.partition("::")[2].rpartition("::")[2] for line in collected.splitlines() if "::" in line)
    return {name for name, times in often.items() if times == 1}


def seconds(folder: Path, revision: str | None, tests: Path) -> dict[str, float]:
    """CPU seconds of each of the named tests that passes."""
    report = folder / f"{revision or 'today'}.xml"
    pytest(folder, revision, "-n", "2", "--dist", "loadfile", f"--junitxml={report}", FGBASELINE_TESTS=str(tests))
    passed = [
        case for case in ElementTree.parse(report).iter("testcase") if {child.tag for child in case} == {"properties"}
    ]
    return {
        case.attrib["name"]: float(cpu.attrib["value"])
        for case in passed
        for cpu in case.iterfind("properties/property[@name='cpu']")
    }


def rows(select: str, folder: Path) -> list[Row]:
    """The ratio over all tests in common, and how many these are."""
    both = (None, BEFORE)
    tests = folder / "tests.txt"
    tests.write_text(
        "\n".join(set.intersection(*(names(folder, revision, select) for revision in both))), encoding="utf-8"
    )
    ours, theirs = (seconds(folder, revision, tests) for revision in both)
    common = ours.keys() & theirs.keys()
    if not common:
        raise click.ClickException("no test passes on both sides")
    ratio = sum(ours[test] for test in common) / sum(theirs[test] for test in common)
    quartiles = np.quantile([ours[test] / max(theirs[test], 1e-3) for test in common], [0.25, 0.75])
    claim = f"`make test`, {len(common):,} tests that {BEFORE} has too, to {BEFORE} (CPU time)"
    spread = f"{quartiles[0]:.2f} to {quartiles[1]:.2f} (half of the tests)"
    return [Row(claim, f"at most {WANTED:g} times", f"{ratio:.2f} times", spread, ratio <= WANTED)]


@click.command()
@click.option("--select", default="", metavar="EXPRESSION", help="Tests that pytest selects by -k; by default all.")
@click.option("--recordings", type=click.Path(path_type=Path, exists=True, file_okay=False), help="Real recordings.")
@click.option("--keep", type=click.Path(path_type=Path, file_okay=False), help="Folder for both JUnit reports.")
def main(select: str, recordings: Path | None, keep: Path | None) -> None:
    """Print the table; the whole takes twice as long as the tests in common."""
    if recordings is not None:
        os.environ[RECORDINGS] = str(recordings.resolve())
    with TemporaryDirectory(prefix="fgbaseline-") as folder:
        place = keep or Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        click.echo(table(rows(select, place)))


if __name__ == "__main__":
    main()
