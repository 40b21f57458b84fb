"""Whether a value read from a file is a number that a double can hold."""

import sys
from typing import TypeGuard


def is_finite_number(value: object) -> TypeGuard[int | float]:
    """No infinity, NaN or truth value. An integer too large for a double must not be turned into one to be told."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
