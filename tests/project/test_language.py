"""Language of code and docs: American spelling, and docstrings that start with their subject."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("geometry", "data", "diagnosis", "ekf", "smoother", "compare", "reports", "package", "benchmarks", "tests")
BRITISH = re.compile(
    r"travelled|metre(?!l)|colour|neighbour|behaviour|\bcentred?\b|relabelled|(?<!aria-)\blabelled\b|modelling|"
    r"(?:initial|normal|linear|marginal|visual|general|real|summar|optim|minim|maxim|recogn)is(?:e|ed|es|ing|ation)\b",
    re.IGNORECASE,
)
SHAPE = re.compile(r"\([\w+\- ]+,[^)]*\)")
PERSONS = re.compile(r"\b(who|whoever|nobody|somebody|told|tells?)\b(?! cannot)", re.IGNORECASE)


ELSEWHERE = {"scipy.io.loadmat", "Axes.boxplot", "stereo_calib", "p_rs_r_x", "fgbaseline."}
"""names of other programs, and beginnings of names"""
COMPOSED = re.compile(r"_[TR]_|_NAME$|_\d+$|^(true|truth|divergence)_|^velocity_x$|_\.*$")
"""transforms, and names of which a part is filled in"""


def sources() -> list[Path]:
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))


def docs() -> list[Path]:
    return [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


def strings_that_document(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of docstrings of modules, classes, functions and attributes."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.lineno, node.value.value


def test_there_is_one_spelling() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{i}: {word.group()}"
        for path in (*sources(), *docs())
        if path != Path(__file__)
        for i, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        for word in BRITISH.finditer(re.sub("`.*?`", "", line) if path.name == "CHANGELOG.md" else line)  # former names
    ]
    assert not found


@pytest.mark.parametrize("word", ["travelled", "per_metre", "normalised", "colours", "summarise", "initialised"])
def test_british_words_are_recognized(word: str) -> None:
    assert BRITISH.search(word)


def test_docstrings_start_with_their_subject_and_name_no_persons() -> None:
    begin = re.compile(
        r"(([Oo]f|[Tt]he same|[Aa]nd)|(times|what|how far|that|those|these|which|whose|its?|from which|up to which))\b"
    )
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text.splitlines()[0]}"
        for path in sources()
        if "tests" not in path.parts
        for line, text in strings_that_document(path)
        if begin.match(text) or PERSONS.search(text)
    ]
    assert not found


def test_messages_and_docs_negate_the_verb() -> None:
    """A person reads "is not a rotation"; "is no rotation" is read twice. "There is no ..." stays."""
    negated = re.compile(r"(?<!here )\b(is|are) no (?!longer|more than)[a-zA-Z]+")
    texts = [
        (path, node.lineno, node.value)
        for path in sources()
        if "tests" not in path.parts and "benchmarks" not in path.parts
        for tree in [ast.parse(path.read_text(encoding="utf-8"))]
        for documenting in [{id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}]
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documenting
    ]
    texts += [(path, i, line) for path in docs() for i, line in enumerate(path.read_text().splitlines(), 1)]
    found = [
        f"{path.relative_to(ROOT)}:{i}: {word.group()}" for path, i, text in texts for word in negated.finditer(text)
    ]
    assert not found


def test_the_first_paragraph_of_a_docstring_is_a_sentence_that_begins_with_words() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{node.body[0].lineno}"
        for path in sources()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        for text in [(ast.get_docstring(node) or "").split("\n\n")[0].strip()]
        if text and "tests" not in path.parts and (text[-1] not in ".:?" or SHAPE.match(text))
    ]
    assert not found


def test_names_in_docstrings_exist() -> None:
    """As a name, a part of a string, a module or a folder: what is renamed is renamed in docstrings too."""
    known: set[str] = set()
    for path in sources():
        known.update(path.relative_to(ROOT).with_suffix("").parts)
        text = path.read_text(encoding="utf-8")
        documenting = {line for line, _ in strings_that_document(path)}
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.NAME:
                known.add(token.string)
            elif token.type == tokenize.STRING and token.start[0] not in documenting:
                known.update(re.findall(r"\w+", token.string))
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in sources()
        if "tests" not in path.parts
        for line, text in strings_that_document(path)
        for name in re.findall(r"`([A-Za-z_][\w.]*)`", text)
        if name.rpartition(".")[2] not in known and name not in ELSEWHERE and not COMPOSED.search(name)
    ]
    assert not found
