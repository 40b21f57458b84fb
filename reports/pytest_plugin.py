"""Pytest plugin with the fixture `assert_accuracy`; fgbaseline is imported when a test first uses it."""

import re
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds `--accuracy-figures DIR`, for CI systems that archive a folder."""
    parser.getgroup("fgbaseline").addoption(
        "--accuracy-figures",
        metavar="DIR",
        type=Path,
        help="Folder for the figures of trajectories that violate a limit.  [default: the test's tmp_path]",
    )


@pytest.fixture
def assert_accuracy(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., dict[str, float]]:
    """`fgbaseline.reports.accuracy_check.assert_accuracy`, whose figure has the test's name."""
    from .accuracy_check import assert_accuracy as asserted

    folder = request.config.getoption("--accuracy-figures") or tmp_path
    stem = re.sub(r"[^\w.-]+", "_", request.node.name)
    names = (f"{stem}.png" if n == 1 else f"{stem}-{n}.png" for n in count(1))

    def in_test(estimate: Any, reference: Any, **limits: Any) -> dict[str, float]:
        __tracebackhide__ = True
        return asserted(estimate, reference, **{"figure": folder / next(names), **limits})

    return in_test
