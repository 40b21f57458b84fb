"""Failures of a graph's solution, and what GTSAM's messages say of them."""

import re


class IndeterminateSystemError(Exception):
    """An update failed; the tree is as it was before it. `key` is the variable that GTSAM named, if any."""

    def __init__(self, key: int | None, text: str) -> None:
        super().__init__(text)
        self.key = key


class UnrecoverableError(Exception):
    """The run cannot go on: even a frame's motion alone leaves the system indeterminate."""


def named_variable(text: str) -> int | None:
    """The key of the variable that a message of GTSAM names."""
    match = re.search(r"variable\s+(\d+)", text)
    return int(match.group(1)) if match else None
