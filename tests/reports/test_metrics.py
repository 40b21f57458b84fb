"""A metric is defined once: its record leads to a figure of the results, and tables, page and glossary follow it."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fgbaseline.compare.acceptance_limits import Better
from fgbaseline.reports.html.run_page import render
from fgbaseline.reports.results import metric_registry
from fgbaseline.reports.results.comparison import Summary as Comparison
from fgbaseline.reports.results.glossary import DELTA, TERMS
from fgbaseline.reports.results.metric_record import COMPARISON, MAIN, TERMINAL, Metric
from fgbaseline.reports.results.metric_registry import METRICS
from fgbaseline.reports.results.run import Summary
from fgbaseline.reports.tables.run import evidence_table, main_table, terminal_table

from ..builders.runs import answer, as_dict, run_of, scene, standard_run
from ..builders.synthetic import plain_problem

GLOSSARY = Path(__file__).parents[2] / "docs" / "glossary.md"
NOT_OF_A_COMPARISON = ~COMPARISON


def leads_to_a_number(schema: dict[str, Any], model: str, path: tuple[str, ...]) -> bool:
    """Whether a path of keys below a model of the schema ends at a number, or at a figure with its interval."""

    def resolved(node: dict[str, Any]) -> list[dict[str, Any]]:
        if "$ref" in node:
            return resolved(schema["$defs"][node["$ref"].rpartition("/")[2]])
        return [inner for each in node["anyOf"] for inner in resolved(each)] if "anyOf" in node else [node]

    nodes = [schema["$defs"][model]]
    for key in path:
        below = [node.get("properties", {}).get(key) or node.get("additionalProperties") for node in nodes]
        nodes = [inner for node in below if isinstance(node, dict) for inner in resolved(node)]
    return any(node.get("type") in ("number", "integer") or "value" in node.get("properties", {}) for node in nodes)


@pytest.mark.parametrize("metric", METRICS, ids=lambda metric: metric.key)
def test_the_path_of_a_metric_leads_to_a_figure(metric: Metric) -> None:
    assert metric.tables or metric.name
    if metric.tables & NOT_OF_A_COMPARISON:
        assert leads_to_a_number(Summary.model_json_schema(), "InertialEstimatorSummary", metric.path)
    if metric.tables & COMPARISON:
        assert leads_to_a_number(Comparison.model_json_schema(), "EstimateSummary", metric.path)


def test_a_path_that_leads_nowhere_is_noticed() -> None:
    assert not leads_to_a_number(Summary.model_json_schema(), "InertialEstimatorSummary", ("divergence", "rsme"))


def test_one_record_adds_a_metric_to_page_and_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    added = Metric(("divergence", "p95"), "divergence", "95th percentile", "m", Better.LOWER, MAIN | TERMINAL)
    added = replace(added, brief="divergence, 95th percentile")
    monkeypatch.setattr(metric_registry, "METRICS", (*METRICS, added))
    run = standard_run()
    summary = as_dict(run)
    value = added.value(summary["estimators"]["ekf"]).text
    for table in (main_table(run, summary["estimators"]), terminal_table(run, summary["estimators"])):
        (i,) = (i for i, column in enumerate(table.columns) if "95th percentile, m" in column.heading and i > 1)
        assert next(row for row in table.rows if row.name == "ekf").cells[i].text == value
    assert re.search(rf"<td[^>]*>(<strong>)?{re.escape(value)}<", render(run, summary, {}))


def test_by_products_of_the_reference_are_not_best_in_what_is_measured_from_it() -> None:
    problem = plain_problem(scene())
    twin = answer(problem, "isam2-online")
    run = run_of(problem, answer(problem, "isam2", by_products={"isam2-online": twin}), twin, answer(problem, "ekf"))
    estimators = as_dict(run)["estimators"]
    for table in (main_table(run, estimators), evidence_table(run, estimators)):
        measured = [i for i, c in enumerate(table.columns) if c.term in ("divergence", "map difference")]
        assert measured
        for row in table.rows:
            assert row.name == "ekf" or not any(row.cells[i].best for i in measured)


def test_every_heading_of_a_metric_links_to_a_term_that_the_docs_define_too() -> None:
    documented = set(re.findall(r"^\| ([^|]+?) \|", GLOSSARY.read_text(encoding="utf-8"), re.MULTILINE))
    assert set(TERMS) <= documented
    assert {metric.glossary_term for metric in METRICS if metric.group != "runtime"} == set(TERMS)
    assert all(DELTA not in term for term in TERMS)
    page = render(standard_run(), as_dict(standard_run()), {})
    for term in ("ATE", "divergence", "reprojection error", "NEES"):
        anchor = re.sub(r"\W+", "-", term).lower()
        assert re.search(rf'<th[^>]*><a class="term" href="#term-{anchor}"', page)
        assert f'<div id="term-{anchor}"><dt>{term}</dt>' in page
