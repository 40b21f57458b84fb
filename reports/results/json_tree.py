"""Nested results (dicts of dicts, as JSON has them) by paths."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

INFINITE = "infinite"
"""the note of a value that is infinite, which JSON has as null"""


def at(tree: Any, *path: str) -> Any:
    """The value at a path of keys; None where a key on the way is missing."""
    for key in path:
        tree = tree.get(key) if isinstance(tree, Mapping) else None
    return tree


def leaves(tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The path (keys joined by dots) and the value of everything that is not itself a mapping."""
    if isinstance(tree, Mapping):
        for key, inner in tree.items():
            yield from leaves(inner, f"{path}.{key}" if path else str(key))
    else:
        yield path, tree


def finite(tree: Any) -> Any:
    """The tree with None for every float that is not finite; keys are text, tuples are lists."""
    if isinstance(tree, Mapping):
        return {str(key): finite(inner) for key, inner in tree.items()}
    if isinstance(tree, list | tuple):
        return [finite(inner) for inner in tree]
    return None if isinstance(tree, float) and not math.isfinite(tree) else tree


def nulls(tree: Any) -> Iterator[tuple[str, bool]]:
    """The path of every value that is None or not finite, and whether it is infinite."""
    for path, value in leaves(tree):
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            yield path, value is not None and math.isinf(value)
