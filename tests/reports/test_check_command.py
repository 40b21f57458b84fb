"""`fgbaseline check` as its users run it: exit codes, the table, the files, and the baseline."""

import json
from pathlib import Path
from typing import Any

import pytest
from junitparser import Error, Failure, JUnitXml

from fgbaseline.geometry import InputError
from fgbaseline.reports.accuracy_check.command import Outputs
from fgbaseline.reports.cli import main
from fgbaseline.reports.tables.check import unit_of

from ..builders.commands import everything_in, fgbaseline
from ..builders.summaries import check_files, estimator, summary, write

LIMITS = """
[[limit]]
metric = "ate.rmse"
estimators = "*ekf"
at_most = 0.5

[[limit]]
metric = "divergence.rmse"
estimators = "isam2"
at_most = 1.0
baseline = { better = "lower", relative = 0.1 }
"""
GOOD = summary(isam2=estimator(0.1), ekf=estimator(0.4), joint_ekf=estimator(0.3))
BAD = summary(isam2=estimator(0.1, divergence=0.3), ekf=estimator(0.6), joint_ekf=estimator(None, status="failed"))
UNTRUSTED = {**GOOD, "reference": {"name": "isam2", "trust": "untrusted", "reasons": ["it | lost <it>"]}}


def held(folder: Path, **keywords: Any) -> int:
    """The exit code of a check of `out` with every kind of file written."""
    outputs = Outputs(folder / "check.xml", folder / "check.md", folder / "check.json")
    return check_files(folder / "out", folder / "limits.toml", folder / "baseline.json", outputs, **keywords)


@pytest.mark.parametrize(("document", "code"), [(GOOD, 0), (BAD, 1), (UNTRUSTED, 2)])
def test_the_command_exits_with_what_it_found(document: Any, code: int, tmp_path: Path) -> None:
    write(tmp_path, document, LIMITS, GOOD)
    options = ("--limits", "limits.toml", "--baseline", "baseline.json", "--junit", "j.xml")
    result = fgbaseline("check", "out", *options, cwd=tmp_path)
    assert (result.returncode, result.stderr) == (code, "")
    assert (tmp_path / "j.xml").is_file()
    titles, *rows = result.stdout.splitlines()[1 if code == 2 else 0 :]
    assert titles.split() == ["limit", "estimator", "metric", "value", "bound", "margin", "baseline", "change"]
    assert len(rows) == 4 + {0: 1, 1: 2, 2: 3}[code]
    said = {0: "All 4 limits hold.", 1: "3 of 4 limits are violated.", 2: "2 of 4 limits are undecided."}[code]
    assert rows[-1] == said
    if code == 2:
        assert result.stdout.startswith("The reference, isam2, is untrusted: it | lost <it>.")


def test_a_row_has_value_bound_margin_and_change(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, BAD, LIMITS, GOOD)
    assert held(tmp_path) == 1
    rows = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "violated ekf ate.rmse (m) 0.6 <= 0.5 -0.1 0.4 +0.2 (+50 %)" in rows
    assert "holds isam2 divergence.rmse (m) 0.3 <= 1 +0.7 0.2 +0.1 (+50 %)" in rows
    assert "violated isam2 divergence.rmse (m) 0.3 <= 0.22 (10 % allowed) -0.08 0.2 +0.1 (+50 %)" in rows
    assert "violated joint-ekf ate.rmse (m) - <= 0.5 - 0.3 -" in rows
    assert any("joint-ekf, ate.rmse: the estimator failed: it lost its way" in row for row in rows)


@pytest.mark.parametrize("document", [GOOD, BAD, UNTRUSTED])
def test_the_junit_file_reads_the_same_in_another_parser(document: Any, tmp_path: Path) -> None:
    write(tmp_path, document, LIMITS, GOOD)
    code = held(tmp_path)
    lines = json.loads((tmp_path / "check.json").read_text())["lines"]
    report = JUnitXml.fromfile(str(tmp_path / "check.xml"))
    suites = {suite.name: suite for suite in report}
    cases = list(suites["town"])
    results = [[type(each) for each in case.result] for case in cases]
    kinds = {"holds": [], "violated": [Failure], "undecided": [Error]}
    assert results == [kinds[line["outcome"]] for line in lines]
    assert [case.classname for case in cases] == [line["estimator"] for line in lines]
    assert len({(case.classname, case.name) for case in cases}) == len(cases)
    everything = [each for suite in report for case in suite for each in case.result]
    counted = (report.tests, report.failures, report.errors)
    assert counted == (
        sum(len(list(suite)) for suite in report),
        sum(isinstance(each, Failure) for each in everything),
        sum(isinstance(each, Error) for each in everything),
    )
    assert bool(everything) == (code != 0)  # a red check is never a green report
    for case, line in zip(cases, lines, strict=True):
        if line["outcome"] == "violated":
            assert line["limit"] in case.result[0].text


def test_names_of_junit_cases_stay_when_the_baseline_moves(tmp_path: Path) -> None:
    def names(baseline: Any) -> list[str]:
        write(tmp_path, GOOD, LIMITS, baseline)
        held(tmp_path)
        return [case.name for suite in JUnitXml.fromfile(str(tmp_path / "check.xml")) for case in suite]

    assert names(GOOD) == names(BAD)


def test_an_estimator_of_any_name_leaves_xml_and_markdown_whole(tmp_path: Path) -> None:
    name = 'a|b <script> & "c" \x07 `d` *e*'
    document = {**GOOD, "estimators": {**GOOD["estimators"], name: estimator(None, status="failed")}}
    write(tmp_path, document, '[[limit]]\nmetric = "ate.rmse"\nat_most = 1\n')
    assert (
        check_files(tmp_path / "out", tmp_path / "limits.toml", None, Outputs(tmp_path / "x.xml", tmp_path / "x.md"))
        == 1
    )
    (suite,) = JUnitXml.fromfile(str(tmp_path / "x.xml"))
    assert next(case.classname for case in suite if case.result) == name.replace("\x07", "?")
    table = [row for row in (tmp_path / "x.md").read_text().splitlines() if row.startswith("|")]
    assert {row.replace("\\|", "").count("|") for row in table} == {9}
    assert "<script>" not in "".join(table).replace("\\<script\\>", "")


def test_markdown_goes_to_the_page_of_a_github_job_after_what_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, BAD, LIMITS, GOOD)
    page = tmp_path / "summary.md"
    page.write_text("what an earlier step said\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    held(tmp_path)
    text = (tmp_path / "check.md").read_text()
    assert page.read_text() == f"what an earlier step said\n{text}\n"
    assert text.startswith("### Accuracy: 3 of 4 limits are violated.\n")
    assert "| ❌ violated | ekf | ate.rmse (m) | 0.6 | \\<= 0.5 | -0.1 | 0.4 | +0.2 (+50 %) |" in text
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "missing" / "summary.md"))
    with pytest.raises(InputError, match=r"summary\.md: it cannot be written"):
        held(tmp_path)


def test_the_json_file_has_every_number_in_full(tmp_path: Path) -> None:
    value = 0.1 + 0.2 / 3.0
    write(tmp_path, summary(isam2=estimator(divergence=value), ekf=estimator(0.25)), LIMITS, GOOD)
    held(tmp_path)
    document = json.loads((tmp_path / "check.json").read_text())
    assert (document["schema"], document["exit_code"]) == ("fgbaseline/check/1", 0)
    assert document["count"] == {"holds": 3, "undecided": 0, "violated": 0}
    ekf, bound, before = document["lines"]
    assert (ekf["value"], ekf["at_most"], ekf["at_least"], ekf["margin"]) == (0.25, 0.5, None, 0.25)
    assert (bound["value"], bound["unit"], bound["baseline"]) == (value, "m", 0.2)
    assert (before["at_most"], before["tolerance"]) == (0.22, "10 %")


@pytest.mark.parametrize(
    ("document", "said"),
    [
        (GOOD, "The limit holds."),
        (UNTRUSTED, "The limit holds, but the reference is not trusted enough"),
    ],
)
def test_a_reference_that_is_not_trusted_keeps_metrics_within_limits_from_holding(
    document: Any, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, document, '[[limit]]\nmetric = "ate.rmse"\nestimators = "ekf"\nat_most = 0.5\n')
    code = check_files(tmp_path / "out", tmp_path / "limits.toml", None, Outputs(tmp_path / "check.xml"))
    assert said in capsys.readouterr().out
    report = JUnitXml.fromfile(str(tmp_path / "check.xml"))
    assert (code, report.errors) == ((2, 1) if document is UNTRUSTED else (0, 0))


def test_files_are_written_all_or_none(tmp_path: Path) -> None:
    write(tmp_path, GOOD, LIMITS, GOOD)
    there = everything_in(tmp_path)
    outputs = Outputs(tmp_path / "check.xml", tmp_path / "check.md", tmp_path / "missing" / "check.json")
    with pytest.raises(InputError, match=r"missing/check\.json"):
        check_files(tmp_path / "out", tmp_path / "limits.toml", tmp_path / "baseline.json", outputs)
    assert everything_in(tmp_path) == there


TEXT = """{
  "runs": {
    "town": {
      "estimators": {
        "ekf": {
          "ate": {
            "rmse": 0.4
          }
        },
        "isam2": {
          "divergence": {
            "rmse": 0.33333
          }
        },
        "joint-ekf": {
          "ate": {
            "rmse": 0.3
          }
        }
      },
      "reference": {
        "name": "isam2",
        "trust": "trusted"
      },
      "sequence": {
        "name": "town"
      }
    }
  },
  "schema": "fgbaseline/baseline/1"
}
"""
THIRD = summary(joint_ekf=estimator(0.3), isam2=estimator(0.1, divergence=1 / 3), ekf=estimator(0.4))


def test_a_new_baseline_holds_the_guarded_figures_sorted_and_rounded(tmp_path: Path) -> None:
    seconds = '[[limit]]\nmetric = "seconds"\nat_most = 60\n'
    write(tmp_path, THIRD, LIMITS + seconds)
    assert held(tmp_path, update=True) == 0
    assert (tmp_path / "baseline.json").read_text() == TEXT
    assert held(tmp_path) == 0
    other = {**THIRD, "machine": {"cores": 64}, "estimators": dict(reversed(THIRD["estimators"].items()))}
    other["estimators"]["isam2"] |= {"seconds": 9.5, "divergence": {"rmse": 1 / 3 + 1e-9}}
    write(tmp_path, other, LIMITS + seconds)
    assert held(tmp_path, update=True) == 0
    assert (tmp_path / "baseline.json").read_text() == TEXT


def test_a_baseline_is_updated_where_a_limit_is_violated_only_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, THIRD, LIMITS)
    held(tmp_path, update=True)
    worse = summary(isam2=estimator(0.1, divergence=0.9), ekf=estimator(0.4), joint_ekf=estimator(0.3))
    write(tmp_path, worse, LIMITS)
    assert held(tmp_path, update=True) == 1
    assert (tmp_path / "baseline.json").read_text() == TEXT
    assert "1 of 4 limits is violated; correct that, or use --accept-worse" in capsys.readouterr().err
    assert held(tmp_path, update=True, accept_worse=True) == 0
    assert (tmp_path / "baseline.json").read_text() == TEXT.replace("0.33333", "0.9")
    write(tmp_path, summary(isam2=estimator(), ekf=estimator(0.7), joint_ekf=estimator(0.3)), LIMITS)
    assert held(tmp_path, update=True, accept_worse=True) == 1  # accepted, but still above its written bound
    assert (
        json.loads((tmp_path / "baseline.json").read_text())["runs"]["town"]["estimators"]["ekf"]["ate"]["rmse"] == 0.7
    )


@pytest.mark.parametrize("accept_worse", [False, True])
def test_no_baseline_comes_from_an_untrusted_reference(accept_worse: bool, tmp_path: Path) -> None:
    write(tmp_path, UNTRUSTED, LIMITS)
    if accept_worse:
        with pytest.raises(InputError, match="not trusted enough"):
            held(tmp_path, update=True, accept_worse=True)
    else:
        assert held(tmp_path, update=True) == 2
    assert not (tmp_path / "baseline.json").exists()


def test_no_baseline_without_ground_truth_names_the_metric_that_needs_it(tmp_path: Path) -> None:
    blind = estimator(ate=None) | {"ate": None, "notes": {"ate": "the recording has no ground truth"}}
    write(tmp_path, summary(isam2=estimator(0.1), ekf=blind, joint_ekf=estimator(0.3)), LIMITS)
    undecided = r"not written, since ate\.rmse of ekf is undecided: the recording has no ground truth"
    with pytest.raises(InputError, match=undecided):
        held(tmp_path, update=True, accept_worse=True)
    assert not (tmp_path / "baseline.json").exists()


def test_no_baseline_holds_what_is_no_number(tmp_path: Path) -> None:
    write(tmp_path, BAD, LIMITS)
    with pytest.raises(InputError, match=r"joint-ekf has no ate\.rmse for the baseline: the estimator failed"):
        held(tmp_path, update=True, accept_worse=True)
    assert not (tmp_path / "baseline.json").exists()


def test_a_summary_is_not_overwritten_by_a_baseline(tmp_path: Path) -> None:
    write(tmp_path, GOOD, LIMITS, GOOD)
    with pytest.raises(InputError, match=r"baseline\.json: this is not a baseline but fgbaseline/summary/1"):
        held(tmp_path, update=True)


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("check out", ("--limits", "check --help")),
        ("check missing --limits limits.toml", ("missing", "no such folder")),
        ("check . --limits limits.toml", ("no summary.json", "fgbaseline run")),
        ("check out --limits missing.toml", ("missing.toml", "no such file")),
        ("check out --limits limits.toml", ("limits.toml: limit[", "--baseline FILE")),
        ("check out --limits limits.toml --baseline missing.json", ("missing.json", "no such file")),
        ("check out --limits limits.toml --baseline limits.toml", ("limits.toml", "not JSON")),
        ("check out --limits limits.toml --update-baseline", ("update-baseline", "--baseline FILE")),
        ("check out --limits limits.toml --baseline baseline.json --accept-worse", ("--update-baseline",)),
        ("check out --limits limits.toml --baseline baseline.json --junit no/x.xml", ("no/x.xml",)),
        ("check out --limits limits.toml --baseline out/new.json --update-baseline --junit .", (".", "folder")),
    ],
)
def test_bad_input_is_one_sentence(
    line: str,
    names: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    write(tmp_path, GOOD, LIMITS, GOOD)
    there = everything_in(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    printed = capsys.readouterr()
    assert (ended.value.code, printed.out) == (2, "")
    assert len(printed.err.strip().splitlines()) == 1
    assert all(name in printed.err for name in names), printed.err
    assert everything_in(tmp_path) == there


@pytest.mark.parametrize(
    ("metric", "unit"),
    [
        ("ate.rmse", "m"),
        ("divergence.rotation_rmse_deg", "°"),
        ("ate_unaligned.final", "m"),
        ("reprojection_common.median", "px"),
        ("reprojection.under_3px", ""),
        ("reprojection.n", ""),
        ("held_out.median", "px"),
        ("map.median", "m"),
        ("map.n", ""),
        ("nees.mean", ""),
        ("seconds", "s"),
        ("translation.rmse.value", "m"),
        ("relative.0.5 s.rotation_deg.median.value", "°"),
    ],
)
def test_units_are_those_of_the_schema(metric: str, unit: str) -> None:
    assert unit_of(metric) == unit
