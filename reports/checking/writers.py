"""A check as JUnit XML, which CI systems show as tests: one suite per run, one case per limit and estimator."""

import re
from xml.etree import ElementTree

from fgbaseline.compare.limits import Outcome

from .line import Checked, Line
from .wording import bound, cells

NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""characters that no XML document may hold"""


def junit(checked: Checked) -> bytes:
    """The document, in UTF-8; a limit that falls short is a failure, one that cannot be told an error."""
    suites = ElementTree.Element("testsuites", {"name": "fgbaseline check", **_counts(checked.lines)})
    for run in dict.fromkeys(line.run for line in checked.lines):
        lines = tuple(line for line in checked.lines if line.run == run)
        suite = ElementTree.SubElement(suites, "testsuite", {"name": _text(run or "trajectories"), **_counts(lines)})
        for line in lines:
            _case(suite, line, checked)
        if said := [*checked.shortages, *checked.references]:
            ElementTree.SubElement(suite, "system-out").text = _text("\n".join(said))
    if checked.undecided:
        _reference_suite(suites, checked)
    ElementTree.indent(suites)
    document: bytes = ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True)
    return document + b"\n"


def _case(suite: ElementTree.Element, line: Line, checked: Checked) -> None:
    asked = f"beside its baseline ({line.tolerance} allowed)" if line.tolerance else bound(line.bounds)
    name = f"{line.metric} {asked}"  # the same from run to run, whatever the baseline is: it is a test's identity
    case = ElementTree.SubElement(suite, "testcase", classname=_text(line.estimator), name=_text(name))
    if line.outcome is Outcome.HOLDS:
        return
    tag = "failure" if line.outcome is Outcome.FALLS_SHORT else "error"
    texts = cells(line)
    said = line.reason or f"{texts['value']} is not {texts['bound']}"
    problem = ElementTree.SubElement(case, tag, type=line.outcome.value, message=_text(f"{line.metric}: {said}"))
    told = [f"{title}: {text}" for title, text in texts.items()]
    problem.text = _text("\n".join([*told, f"{checked.limits}, line {line.limit_line}"]))


def _reference_suite(suites: ElementTree.Element, checked: Checked) -> None:
    """A case of its own for a reference that is not trusted: without one, a report with no failure would be green."""
    suite = ElementTree.SubElement(suites, "testsuite", name="reference", tests="1", failures="0", errors="1")
    case = ElementTree.SubElement(suite, "testcase", classname="reference", name="trust")
    message = " ".join(checked.references)
    ElementTree.SubElement(case, "error", type=Outcome.CANNOT_TELL.value, message=_text(message)).text = _text(message)
    for count in ("tests", "errors"):
        suites.set(count, str(int(suites.get(count, "0")) + 1))


def _counts(lines: tuple[Line, ...]) -> dict[str, str]:
    outcomes = [line.outcome for line in lines]
    return {
        "tests": str(len(lines)),
        "failures": str(outcomes.count(Outcome.FALLS_SHORT)),
        "errors": str(outcomes.count(Outcome.CANNOT_TELL)),
    }


def _text(text: str) -> str:
    return NOT_XML.sub("?", text)
