"""pytest plugin (`-p cpu_time_plugin`): CPU seconds of each test as a property of the JUnit report, `cpu`.

Set-up, teardown and finished child processes are part of it. If the variable FGBASELINE_TESTS names a file, only the
tests whose names are its lines run. It imports nothing of this project, so that any revision can use it.
"""

import os
import resource
from collections.abc import Generator
from pathlib import Path

import pytest

STARTED = pytest.StashKey[float]()


def _cpu_seconds() -> float:
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if chosen := os.environ.get("FGBASELINE_TESTS"):
        names = set(Path(chosen).read_text(encoding="utf-8").split("\n"))
        config.hook.pytest_deselected(items=[item for item in items if item.name not in names])
        items[:] = [item for item in items if item.name in names]


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None]:
    item.stash[STARTED] = _cpu_seconds()
    return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> Generator[None]:
    try:
        return (yield)
    finally:
        item.user_properties.append(("cpu", _cpu_seconds() - item.stash[STARTED]))
