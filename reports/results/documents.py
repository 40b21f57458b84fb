"""JSON files that the commands leave, as they stand: read without the models, whose imports take longer than a fault.

`reader` and the models of the results say what is in them.
"""

import json
from pathlib import Path
from typing import Any

from fgbaseline.data.formats.named_file import reading, regular_file, shown
from fgbaseline.geometry import InputError

SUMMARY = "summary.json"
"""results of `run` and `bench`, and the file that identifies a run's folder"""
COMPARISON = "comparison.json"
"""results of `compare`, and the file that identifies a comparison's folder"""


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


def measured_file(folder: Path) -> Path:
    """The summary.json or comparison.json of a folder. Raises InputError where it has none."""
    wanted = "give one that fgbaseline run, compare or bench wrote"
    if not folder.is_dir():
        raise InputError(f"{shown(folder)}: there is no such folder; {wanted}")
    found = [folder / name for name in (SUMMARY, COMPARISON) if (folder / name).is_file()]
    if not found:
        raise InputError(f"{shown(folder)}: it holds no {SUMMARY}; {wanted}")
    return found[0]


def drawn_file(folder: Path) -> Path:
    """The comparison.json or summary.json of a folder whose figures are drawn. Raises InputError where it has none."""
    found = [folder / name for name in (COMPARISON, SUMMARY) if (folder / name).is_file()]
    if not found:
        raise InputError(f"{folder}: it has no {SUMMARY}; give the folder that fgbaseline run or compare wrote")
    return found[0]
