"""Numbers in JSON: null for what is not finite, and which of these are infinite."""

import math
from collections.abc import Iterator, Mapping
from typing import Any


def finite(value: Any) -> Any:
    """The same tree with None for every float that is not finite; keys are text."""
    if isinstance(value, Mapping):
        return {str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def nulls(value: Any, path: str = "") -> Iterator[tuple[str, bool]]:
    """The path (keys joined by dots) of every value that is None or not finite, and whether it is infinite."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from nulls(inner, f"{path}.{key}" if path else str(key))
    elif value is None or (isinstance(value, float) and not math.isfinite(value)):
        yield path, value is not None and math.isinf(value)
