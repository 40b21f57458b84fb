"""The figures of a run drawn by several processes at once, each taking the next that nobody has taken."""

import gc
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import ForkProcess

from fgbaseline.reports.comparison import Run

from .drawing import drawings
from .layout import lay_out
from .saving import Written, written
from .style import in_style

FORMS = ("png", "svg")
INTERRUPTS = (signal.SIGINT, signal.SIGTERM)


def draw_and_write(run: Run, processes: int) -> dict[str, Written]:
    """What `draw` draws, by name, written as PNG and SVG; the same bytes however many processes share the work.

    The others are forks, which have the run and all that is imported, and need nothing sent. Only Linux forks safely;
    elsewhere one process draws everything.
    """
    names = list(drawings(run))
    helpers = min(processes, len(names)) - 1 if sys.platform == "linux" else 0
    with _not_collecting(), _taken_in_turn(len(names)) as numbers, _helping(run, names, numbers, helpers) as answers:
        done = _written(run, names, numbers)
        for answer in answers:
            try:
                done |= answer.recv()
            except EOFError:  # it died; what it had taken is drawn below
                continue
    missing = [name for name in names if name not in done]
    done |= {name: _one(run, name) for name in missing}
    return {name: figure for name in names if (figure := done[name]) is not None}


def cores() -> int:
    """That this process may use, as far as `draw_and_write` can make use of them."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1


def _one(run: Run, name: str) -> Written | None:
    with in_style():
        figure = drawings(run)[name]()
        if figure is not None:
            lay_out(figure)
    return None if figure is None else written(figure, FORMS)


def _written(run: Run, names: Sequence[str], numbers: int) -> dict[str, Written | None]:
    """The figures whose numbers this process takes."""
    done = {}
    while number := os.read(numbers, 1):
        name = names[number[0]]
        done[name] = _one(run, name)
    return done


@contextmanager
def _not_collecting() -> Iterator[None]:
    """Without the search for cyclic garbage, a seventh of the time; that garbage is 13 MB for seven estimators."""
    collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collected:
            gc.enable()


@contextmanager
def _taken_in_turn(n: int) -> Iterator[int]:
    """A pipe of the bytes 0 to n - 1, out of which whoever reads a byte has taken that number for himself.

    The last are the figures over time, which take longest: they come first.
    """
    numbers, into = os.pipe()
    os.write(into, bytes(reversed(range(n))))
    os.close(into)
    try:
        yield numbers
    finally:
        os.close(numbers)


@contextmanager
def _helping(run: Run, names: Sequence[str], numbers: int, helpers: int) -> Iterator[list[Connection]]:
    """Where the answers of so many forks come from; none of them is left when the block ends, however it does."""
    context = get_context("fork")
    answers, started = [], list[ForkProcess]()
    try:
        for _ in range(helpers):
            answer, into = context.Pipe(duplex=False)
            process = context.Process(target=_help, args=(run, names, numbers, answer, into), daemon=True)
            with _interrupts_held_back():
                process.start()
            into.close()
            started.append(process)
            answers.append(answer)
        yield answers
    finally:
        for process in started:
            process.kill()
            process.join()
        for answer in answers:
            answer.close()


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """They come when the block ends: in the functions that Python calls around a fork, an exception is swallowed."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _help(run: Run, names: Sequence[str], numbers: int, answer: Connection, into: Connection) -> None:
    """In the fork. Interrupting is the parent's business; where the parent is gone, nobody reads, and sending fails."""
    answer.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
    into.send(_written(run, names, numbers))
