"""Failures of the solution of a graph, and the variable named in messages of GTSAM."""

import re

from numpy.linalg import LinAlgError


class IndeterminateSystemError(Exception):
    """A failed update, which left the solver unchanged. `key` is the variable named by GTSAM, if any."""

    def __init__(self, key: int | None, text: str) -> None:
        super().__init__(text)
        self.key = key


class UnrecoverableError(Exception):
    """The run cannot continue: even a frame's motion alone leaves the system indeterminate."""


FAILURES = (IndeterminateSystemError, UnrecoverableError, RuntimeError, LinAlgError)
"""exceptions that end a run without an answer; GTSAM raises RuntimeError, numpy LinAlgError"""


def failure_reason(error: Exception) -> str:
    """Reason of a failed run: the first line of the exception's text, after the name of the library that raised it."""
    text = " ".join(str(error).strip().split("\n\n")[0].split())
    if isinstance(error, IndeterminateSystemError | UnrecoverableError):
        return text
    return f"{'numpy' if isinstance(error, LinAlgError) else 'GTSAM'} failed: {text}"


def named_variable(text: str) -> int | None:
    """Key of the variable named in a message of GTSAM."""
    match = re.search(r"variable\s+(\d+)", text)
    return int(match.group(1)) if match else None
