"""JSON files that the commands leave, as they stand: read without the models, whose imports take longer than a fault.

`reader` and the models of the results say what is in them. `at` to `nulls` go through their tree of dicts by paths.
"""

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fgbaseline.data.formats.files.file_errors import reading, regular_file, shown
from fgbaseline.geometry import InputError

SUMMARY = "summary.json"
"""results of `run` and `bench`, and the file that identifies a run's folder"""
COMPARISON = "comparison.json"
"""results of `compare`, and the file that identifies a comparison's folder"""
INFINITE = "infinite"
"""the note of a value that is infinite, which JSON has as null"""


def read_document(path: Path) -> dict[str, Any]:
    """A summary.json, a comparison.json or a baseline. Raises InputError."""
    with reading(path):
        try:
            document = json.loads(regular_file(path).read_bytes())
        except (ValueError, RecursionError) as error:
            raise InputError(f"this is not JSON ({error}); give a {SUMMARY} or a baseline") from None
        if not isinstance(document, dict) or not str(document.get("schema", "")).startswith("fgbaseline/"):
            raise InputError(
                f"it is not the summary of a run, comparison or bench (no schema of fgbaseline's); give a {SUMMARY} or "
                "a baseline"
            )
        return document


def document_in(folder: Path, writers: str = "run, compare or bench") -> Path:
    """The summary.json or comparison.json of a folder that `writers` write. Raises InputError where it has none."""
    wanted = f"give one that fgbaseline {writers} wrote"
    if not folder.is_dir():
        raise InputError(f"{shown(folder)}: there is no such folder; {wanted}")
    found = [folder / name for name in (SUMMARY, COMPARISON) if (folder / name).is_file()]
    if not found:
        raise InputError(f"{shown(folder)}: it holds no {SUMMARY}; {wanted}")
    return found[0]


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
