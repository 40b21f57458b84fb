"""`fgbaseline check`: evaluation and exit code, and the outputs.

These are the terminal, Markdown for a pull request, JSON, and JUnit XML, which CI systems show as tests.
"""

import json
import os
import re
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import click
from rich.console import Console

from fgbaseline.compare.acceptance_limits import Outcome
from fgbaseline.data.formats.files.atomic_write import atomic_write
from fgbaseline.data.formats.files.file_errors import writing
from fgbaseline.data.formats.files.toml_file import TomlFile
from fgbaseline.geometry import InputError

from ..formatting import md
from ..phrases.check import bound, remarks, verdict
from ..results.check import Checked, Line
from ..results.json_files import finite
from ..results.reader import Measured, read_measured
from ..tables.check import cells, check_table, unit_of
from ..tables.writers import UNWRAPPED, print_table
from ..tables.writers import markdown as markdown_table
from .evaluation import evaluate
from .limits import Limits, refusal, require_replaceable, write_baseline

SCHEMA = "fgbaseline/check/1"
STYLES: Mapping[str, str] = {Outcome.HOLDS: "green", Outcome.UNDECIDED: "yellow", Outcome.VIOLATED: "bold red"}
SIGNS: Mapping[Outcome, str] = {Outcome.HOLDS: "✅", Outcome.UNDECIDED: "❔", Outcome.VIOLATED: "❌"}
NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""characters that XML does not allow"""
JOB_SUMMARY = "GITHUB_STEP_SUMMARY"
"""environment variable of GitHub: the file that the page of the job shows"""


@dataclass(frozen=True, slots=True)
class Outputs:
    """Files to write, in addition to the table on the terminal."""

    junit: Path | None = None
    markdown: Path | None = None
    json: Path | None = None


def check(
    measured: Measured,
    limits: TomlFile[Limits],
    baseline_file: Path | None,
    outputs: Outputs,
    *,
    update: bool = False,
    accept_worse: bool = False,
) -> int:
    """Evaluates metrics against limits and a baseline, writes the outputs, and returns the exit code."""
    if update and baseline_file is None:
        raise InputError("update-baseline: name the file to write with --baseline FILE")
    if accept_worse and not update:
        raise InputError("accept-worse: it has an effect with --update-baseline only; add that")
    read = require_replaceable if update else read_measured
    baseline = None if baseline_file is None else read(baseline_file)
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
        (outputs.junit, junit(checked).encode()),
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


def print_check(checked: Checked) -> None:
    """Prints too small samples and untrusted references, the table, the remarks, and the verdict."""
    console = Console()
    console = Console(width=None if console.is_terminal else max(console.width, UNWRAPPED), highlight=False)
    for sentence in checked.notices:
        console.print(sentence, markup=False, soft_wrap=True)
    print_table(check_table(checked), styles=STYLES)
    for sentence in [*remarks(checked), verdict(checked)]:
        console.print(sentence, markup=False, soft_wrap=True)


def markdown(checked: Checked) -> str:
    """A heading with the verdict, too small samples and untrusted references, the table, and the remarks."""
    baseline = f"; baseline: {md(checked.baseline)}" if checked.baseline else ""
    return "\n".join(
        [
            f"### Accuracy: {md(verdict(checked))}",
            "",
            *(f"> {md(sentence)}\n" for sentence in checked.notices),
            markdown_table(check_table(checked, SIGNS)),
            *(f"- {md(sentence)}" for sentence in remarks(checked)),
            f"Limits: {md(checked.limits)}{baseline}",
            "",
        ]
    )


def as_json(checked: Checked) -> str:
    """The JSON document: the outcome, its inputs, and every line with all digits."""
    document = {
        "schema": SCHEMA,
        "exit_code": checked.exit_code,
        "verdict": verdict(checked),
        "count": {outcome.value: n for outcome, n in checked.count.items()},
        "summary": str(checked.measured.path),
        "limits": checked.limits,
        "baseline": checked.baseline,
        "shortages": list(checked.shortages),
        "references": list(checked.references),
        "reference_sigmas": list(checked.sigmas),
        "lines": [finite(_line(line)) for line in checked.lines],
    }
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def _line(line: Line) -> dict[str, Any]:
    bounds, shortage = line.bounds, line.shortage
    return {
        "outcome": line.outcome.value,
        "run": line.run,
        "estimator": line.estimator,
        "metric": line.metric,
        "unit": unit_of(line.metric),
        "value": line.value,
        "at_least": None if bounds is None else bounds.at_least,
        "at_most": None if bounds is None else bounds.at_most,
        "tolerance": line.tolerance,
        "margin": line.margin,
        "baseline": line.before,
        "change": line.change,
        "reason": line.reason,
        "missing": line.missing,
        "sample": None if shortage is None else shortage.n,
        "coverage": None if shortage is None else shortage.coverage,
        "limit": line.limit,
    }


def junit(checked: Checked) -> str:
    """The JUnit document; a violated limit is a failure, an undecided one an error.

    An untrusted reference has a case of its own: without one, a report without failures would be green.
    """
    suites = ElementTree.Element(
        "testsuites", {"name": "fgbaseline check", **_counts(checked.lines, extra=checked.undecided)}
    )
    for run in dict.fromkeys(line.run for line in checked.lines):
        lines = tuple(line for line in checked.lines if line.run == run)
        suite = ElementTree.SubElement(suites, "testsuite", {"name": run or "trajectories", **_counts(lines)})
        for line in lines:
            _case(suite, line, checked)
        if checked.notices:
            ElementTree.SubElement(suite, "system-out").text = "\n".join(checked.notices)
    if checked.undecided:
        suite = ElementTree.SubElement(suites, "testsuite", {"name": "reference", **_counts((), extra=True)})
        case = ElementTree.SubElement(suite, "testcase", classname="reference", name="trust")
        reasons = " ".join(checked.references)
        _problem(case, Outcome.UNDECIDED, reasons, reasons)
    ElementTree.indent(suites)
    document = NOT_XML.sub("?", ElementTree.tostring(suites, encoding="unicode"))
    return f"<?xml version='1.0' encoding='utf-8'?>\n{document}\n"


def _case(suite: ElementTree.Element, line: Line, checked: Checked) -> None:
    asked = f"beside its baseline ({line.tolerance} allowed)" if line.tolerance else bound(line.bounds)
    name = f"{line.metric} {asked}"  # without the baseline's value: the name identifies the test from run to run
    case = ElementTree.SubElement(suite, "testcase", classname=line.estimator, name=name)
    if line.outcome is not Outcome.HOLDS:
        texts = cells(line)
        reason = line.reason or f"{texts['value']} is not {texts['bound']}"
        detail = [*(f"{title}: {text}" for title, text in texts.items()), f"{checked.limits}, {line.limit}"]
        _problem(case, line.outcome, f"{line.metric}: {reason}", "\n".join(detail))


def _problem(case: ElementTree.Element, outcome: Outcome, message: str, text: str) -> None:
    tag = "failure" if outcome is Outcome.VIOLATED else "error"
    ElementTree.SubElement(case, tag, type=outcome.value, message=message).text = text


def _counts(lines: tuple[Line, ...], *, extra: bool = False) -> dict[str, str]:
    """Attributes with the number of tests; `extra` is the case of an untrusted reference, an error."""
    outcomes = [line.outcome for line in lines]
    return {
        "tests": str(len(lines) + extra),
        "failures": str(outcomes.count(Outcome.VIOLATED)),
        "errors": str(outcomes.count(Outcome.UNDECIDED) + extra),
    }
