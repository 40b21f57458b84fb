"""On which line of a TOML text each key and each element of an array stands.

`tomllib` reads the values and keeps no positions; the tree of tree-sitter's TOML grammar has them and no values.
"""

import tomllib
from collections.abc import Iterator
from typing import Any, TypeAlias

import tree_sitter_toml
from tree_sitter import Language, Node, Parser

Place: TypeAlias = tuple[str | int, ...]
"""keys and indices that lead from the top of a TOML document to a value, such as ("limit", 0, "metric")"""

_HEADERS = ("table", "table_array_element")
_KEYS = ("bare_key", "quoted_key", "dotted_key")


def lines_of(text: bytes) -> dict[Place, int]:
    """Place -> line, from 1, at which it is first named; of a text that `tomllib` accepts."""
    document = Parser(Language(tree_sitter_toml.language())).parse(text)
    lines: dict[Place, int] = {}
    elements: dict[Place, int] = {}
    for node in document.root_node.named_children:
        table: Place = ()
        if node.type in _HEADERS:
            array = node.type == "table_array_element"
            table = _opened(_key(node), elements, array=array)
            for depth in range(1, len(table) + 1):
                lines.setdefault(table[:depth], _line(node))
        for place, line in _named_in(node, table):
            lines.setdefault(place, line)
    return lines


def _opened(key: tuple[str, ...], elements: dict[Place, int], *, array: bool) -> Place:
    """The place of a table whose header is `key`, which leads through the last elements of arrays of tables."""
    place: Place = ()
    for depth, part in enumerate(key, 1):
        place = (*place, part)
        if array and depth == len(key):
            elements[place] = elements.get(place, -1) + 1
        if place in elements:
            place = (*place, elements[place])
    return place


def _named_in(node: Node, place: Place) -> Iterator[tuple[Place, int]]:
    """Every place below a value, a pair or a table that stands at `place`, with its line."""
    if node.type == "pair":
        value = node.named_children[-1]
        for part in _key(node):
            place = (*place, part)
            yield place, _line(node)
        yield from _named_in(value, place)
    elif node.type in (*_HEADERS, "inline_table"):
        for child in node.named_children:
            if child.type == "pair":
                yield from _named_in(child, place)
    elif node.type == "array":
        values = [child for child in node.named_children if child.type != "comment"]
        for index, child in enumerate(values):
            yield (*place, index), _line(child)
            yield from _named_in(child, (*place, index))


def _key(node: Node) -> tuple[str, ...]:
    """The parts of the key of a pair or a header; tomllib knows how they are quoted."""
    text = next(child.text for child in node.named_children if child.type in _KEYS)
    assert text is not None
    parts: list[str] = []
    inner: Any = tomllib.loads(f"{text.decode()} = 0")
    while isinstance(inner, dict):
        (part,) = inner
        parts.append(part)
        inner = inner[part]
    return tuple(parts)


def _line(node: Node) -> int:
    return node.start_point.row + 1
