"""Figures drawn by several processes are those that one draws, whatever becomes of the others."""

import os
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import FrameType

import pytest

from fgbaseline.reports import figures
from fgbaseline.reports.comparison import Run
from fgbaseline.reports.figures import sharing

from .reported import answer, run_of, scene
from .synthetic import plain_problem

FORKS = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely")


@cache
def small_run() -> Run:
    problem = plain_problem(scene())
    return run_of(problem, answer(problem, "ekf"))


@cache
def drawn_by_one() -> dict[str, figures.Written]:
    return figures.draw_and_write(small_run(), 1)


def children() -> set[str]:
    """The processes that this one has started and that are left."""
    return set(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())


def test_one_process_writes_what_draw_draws() -> None:
    drawn = figures.draw(small_run())
    assert list(drawn) == list(drawn_by_one())
    name = "paths_overlaid"
    assert drawn_by_one()[name].title == drawn[name].get_label()
    assert drawn_by_one()[name].files == {form: figures.encoded(drawn[name], form) for form in ("png", "svg")}


@FORKS
def test_three_processes_write_the_same_bytes_in_the_same_order_and_none_is_left() -> None:
    before = children()
    shared = figures.draw_and_write(small_run(), 3)
    assert list(shared) == list(drawn_by_one())
    assert shared == drawn_by_one()
    assert children() <= before


@FORKS
def test_what_a_process_had_taken_when_it_died_is_drawn_by_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    def die(run: Run, names: list[str], numbers: int, *_: object) -> None:
        os.read(numbers, 1)
        os._exit(9)

    monkeypatch.setattr(sharing, "_help", die)
    assert figures.draw_and_write(small_run(), 2) == drawn_by_one()


@FORKS
def test_a_fork_whose_parent_was_killed_ends() -> None:
    """What it draws fits into no pipe, so it would wait for a reader for ever."""
    script = """
import os, signal, time
from fgbaseline.reports.figures import sharing

def large(*_):
    time.sleep(0.5)
    return {"large": bytes(10_000_000)}

sharing._written = large
parent = os.getpid()
with sharing._helping(None, [], 0, 1):
    os.kill(parent, signal.SIGKILL)
"""
    # The fork has the pipe open as well: that it closes says that the fork has ended.
    killed = subprocess.run([sys.executable, "-c", script], stdout=subprocess.PIPE, timeout=120.0, check=False)
    assert killed.returncode == -signal.SIGKILL


@FORKS
def test_an_interrupt_that_comes_while_a_process_forks_is_not_lost() -> None:
    def interrupt(signum: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    due = [signal.SIGTERM]
    os.register_at_fork(after_in_parent=lambda: signal.raise_signal(due.pop()) if due else None)
    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        with pytest.raises(KeyboardInterrupt):
            figures.draw_and_write(small_run(), 2)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert due == []
