"""`fgbaseline check`: evaluation and exit code, and the outputs.

These are the terminal, Markdown for a pull request, JSON, and JUnit XML, which CI systems show as tests.
"""

import json
import math
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
from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.formats.file_errors import writing
from fgbaseline.data.toml_file import TomlFile
from fgbaseline.geometry import InputError

from ..formatting import md
from ..phrases.check import bound, remarks, verdict
from ..results.check import Checked, Line
from ..results.reader import Measured, read_measured
from ..tables.check import cells, check_table, unit_of
from ..tables.writers import UNWRAPPED, print_table
from ..tables.writers import markdown as markdown_table
from .baseline import refusal, require_replaceable, write_baseline
from .evaluation import evaluate
from .limits_file import Limits

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
        "lines": [_line(line) for line in checked.lines],
    }
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def _line(line: Line) -> dict[str, Any]:
    return {
        "outcome": line.outcome.value,
        "run": line.run,
        "estimator": line.estimator,
        "metric": line.metric,
        "unit": unit_of(line.metric),
        "value": line.value,
        "at_least": None if line.bounds is None else _finite(line.bounds.at_least),
        "at_most": None if line.bounds is None else _finite(line.bounds.at_most),
        "tolerance": line.tolerance,
        "margin": line.margin,
        "baseline": line.before,
        "change": line.change,
        "reason": line.reason,
        "missing": line.missing,
        "sample": None if line.shortage is None else line.shortage.n,
        "coverage": None if line.shortage is None else line.shortage.coverage,
        "limit": line.limit,
    }


def _finite(bound: float) -> float | None:
    return bound if math.isfinite(bound) else None


def junit(checked: Checked) -> bytes:
    """The JUnit document, in UTF-8; a violated limit is a failure, an undecided one an error."""
    suites = ElementTree.Element("testsuites", {"name": "fgbaseline check", **_counts(checked.lines)})
    for run in dict.fromkeys(line.run for line in checked.lines):
        lines = tuple(line for line in checked.lines if line.run == run)
        suite = ElementTree.SubElement(suites, "testsuite", {"name": _text(run or "trajectories"), **_counts(lines)})
        for line in lines:
            _case(suite, line, checked)
        if sentences := checked.notices:
            ElementTree.SubElement(suite, "system-out").text = _text("\n".join(sentences))
    if checked.undecided:
        _reference_suite(suites, checked)
    ElementTree.indent(suites)
    document: bytes = ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True)
    return document + b"\n"


def _case(suite: ElementTree.Element, line: Line, checked: Checked) -> None:
    asked = f"beside its baseline ({line.tolerance} allowed)" if line.tolerance else bound(line.bounds)
    name = f"{line.metric} {asked}"  # without the baseline's value: the name identifies the test from run to run
    case = ElementTree.SubElement(suite, "testcase", classname=_text(line.estimator), name=_text(name))
    if line.outcome is Outcome.HOLDS:
        return
    tag = "failure" if line.outcome is Outcome.VIOLATED else "error"
    texts = cells(line)
    reason = line.reason or f"{texts['value']} is not {texts['bound']}"
    problem = ElementTree.SubElement(case, tag, type=line.outcome.value, message=_text(f"{line.metric}: {reason}"))
    texts_of = [f"{title}: {text}" for title, text in texts.items()]
    problem.text = _text("\n".join([*texts_of, f"{checked.limits}, {line.limit}"]))


def _reference_suite(suites: ElementTree.Element, checked: Checked) -> None:
    """A separate case for an untrusted reference: without one, a report without failures would be green."""
    suite = ElementTree.SubElement(suites, "testsuite", name="reference", tests="1", failures="0", errors="1")
    case = ElementTree.SubElement(suite, "testcase", classname="reference", name="trust")
    message = " ".join(checked.references)
    ElementTree.SubElement(case, "error", type=Outcome.UNDECIDED.value, message=_text(message)).text = _text(message)
    for count in ("tests", "errors"):
        suites.set(count, str(int(suites.get(count, "0")) + 1))


def _counts(lines: tuple[Line, ...]) -> dict[str, str]:
    outcomes = [line.outcome for line in lines]
    return {
        "tests": str(len(lines)),
        "failures": str(outcomes.count(Outcome.VIOLATED)),
        "errors": str(outcomes.count(Outcome.UNDECIDED)),
    }


def _text(text: str) -> str:
    return NOT_XML.sub("?", text)
