"""No module imports one that imports it, imports inside functions included; the docs name modules that exist."""

import re
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]
RECORDS = {"mutants.md"}
"""pages that keep the names of the revision that they measured"""


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("fgbaseline", cache_dir=None)


def cycles(graph: grimp.ImportGraph) -> set[frozenset[str]]:
    """The strongly connected components of more than one module (Tarjan 1972)."""
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: set[frozenset[str]] = set()

    def visit(module: str) -> None:
        number[module] = low[module] = len(number)
        stack.append(module)
        for imported in sorted(graph.find_modules_directly_imported_by(module)):
            if imported not in number:
                visit(imported)
            if imported in stack:
                low[module] = min(low[module], low[imported])
        if low[module] == number[module]:
            component = stack[stack.index(module) :]
            del stack[stack.index(module) :]
            if len(component) > 1:
                found.add(frozenset(component))

    for module in sorted(graph.modules):
        if module not in number:
            visit(module)
    return found


def test_no_module_imports_one_that_imports_it(graph: grimp.ImportGraph) -> None:
    assert len(graph.modules) > 300
    assert graph.find_modules_directly_imported_by("fgbaseline")  # so a room that imports it would be in a cycle
    assert not cycles(graph)


def test_the_modules_that_the_docs_name_exist() -> None:
    rooms = "geometry|data|diagnosis|ekf|smoother|compare|reports|benchmarks"
    named = {
        (page.name, path)
        for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
        if page.name not in RECORDS
        for path in re.findall(rf"(?<![\w/])(?:{rooms})/[\w/]+\.py\b", page.read_text(encoding="utf-8"))
    }
    table = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    modules = {path.name for room in rooms.split("|") for path in (ROOT / room).rglob("*.py")}
    assert len(named) > 30
    assert not {(page, path) for page, path in named if not (ROOT / path).is_file()}
    assert set(re.findall(r"`(\w+\.py)`", table)) <= modules


def test_a_cycle_is_found() -> None:
    graph = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "a"), ("c", "d"), ("d", "e")):
        graph.add_import(importer=importer, imported=imported)
    assert cycles(graph) == {frozenset("abc")}
