"""`fgbaseline check`: inputs, evaluation, outputs and exit code."""

import os
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import click

from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.formats.named_file import writing
from fgbaseline.geometry import InputError

from ..results.check import Checked
from ..results.reader import read_folder, read_measured
from .baseline import refusal, require_replaceable, write_baseline
from .evaluation import evaluate
from .limits_file import read_limits
from .output import as_json, junit, markdown, print_check

JOB_SUMMARY = "GITHUB_STEP_SUMMARY"
"""environment variable of GitHub: the file that the page of the job shows"""


@dataclass(frozen=True, slots=True)
class Outputs:
    """Files to write, in addition to the table on the terminal."""

    junit: Path | None = None
    markdown: Path | None = None
    json: Path | None = None


def check(
    folder: Path,
    limits_file: Path,
    baseline_file: Path | None,
    outputs: Outputs,
    *,
    update: bool = False,
    accept_worse: bool = False,
) -> int:
    """Evaluates a folder against limits and a baseline, writes the outputs, and returns the exit code."""
    if update and baseline_file is None:
        raise InputError("update-baseline: name the file to write with --baseline FILE")
    if accept_worse and not update:
        raise InputError("accept-worse: it has an effect with --update-baseline only; add that")
    limits, measured = read_limits(limits_file), read_folder(folder)
    if update and baseline_file is not None:
        baseline = require_replaceable(baseline_file)
    else:
        baseline = None if baseline_file is None else read_measured(baseline_file)
    checked = evaluate(limits, measured, baseline, updating=update)
    _write(checked, outputs)
    print_check(checked)
    if not update or baseline_file is None:
        return checked.exit_code
    if checked.exit_code and not accept_worse:
        click.echo(f"fgbaseline: {refusal(checked, baseline_file)}", err=True)
        return checked.exit_code
    click.echo(write_baseline(checked, baseline_file))
    return evaluate(limits, measured, read_measured(baseline_file)).exit_code


def _write(checked: Checked, outputs: Outputs) -> None:
    """Writes all files or none, and GitHub's summary of the job."""
    texts = (
        (outputs.junit, junit(checked)),
        (outputs.markdown, markdown(checked).encode()),
        (outputs.json, as_json(checked).encode()),
    )
    with ExitStack() as stack:
        for path, text in texts:
            if path is not None:
                stack.enter_context(atomic_write(path)).write(text)
    if summary := os.environ.get(JOB_SUMMARY):
        with writing(summary), Path(summary).open("a", encoding="utf-8") as file:
            file.write(markdown(checked) + "\n")
