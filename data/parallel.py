"""Work shared with forks of this process, each taking the next piece that nobody has taken.

Forks have the run and all that is imported, and need nothing sent; only Linux forks safely, elsewhere this process does
everything. What a fork fails at, or had taken when it died, is done here again: so an error is this process' own.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import ForkProcess
from typing import TypeVar

T = TypeVar("T")
INTERRUPTS = (signal.SIGINT, signal.SIGTERM)


def cores() -> int:
    """That this process may use, as far as `shared` can make use of them."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1


@contextmanager
def shared(work: Callable[[int], T], n: int, processes: int) -> Iterator[Callable[[], list[T]]]:
    """Begins `work` of the numbers 0 to n - 1 (at most 256) in `processes` - 1 forks, the last numbers first.

    What it gives takes part until nothing is left, and answers with all results, in the order of their numbers. Before
    that there is time for something else. No fork is left when the block ends, however it does.
    """
    helpers = min(processes - 1, n) if sys.platform == "linux" else 0
    with _taken_in_turn(n) as numbers, _helping(work, numbers, helpers) as answers:

        def gathered() -> list[T]:
            done = _done(work, numbers)
            for answer in answers:
                with suppress(EOFError):  # it died, or failed
                    done |= answer.recv()
            return [done[i] if i in done else work(i) for i in range(n)]

        yield gathered


def _done(work: Callable[[int], T], numbers: int) -> dict[int, T]:
    """What this process does of it."""
    done = {}
    while number := os.read(numbers, 1):
        done[number[0]] = work(number[0])
    return done


@contextmanager
def _taken_in_turn(n: int) -> Iterator[int]:
    """A pipe of the bytes n - 1 to 0, out of which whoever reads a byte has taken that number for himself."""
    numbers, into = os.pipe()
    os.write(into, bytes(reversed(range(n))))
    os.close(into)
    try:
        yield numbers
    finally:
        os.close(numbers)


@contextmanager
def _helping(work: Callable[[int], T], numbers: int, helpers: int) -> Iterator[list[Connection]]:
    """Where the answers of so many forks come from."""
    answers, started = [], list[ForkProcess]()
    try:
        for _ in range(helpers):
            context = get_context("fork")
            answer, into = context.Pipe(duplex=False)
            process = context.Process(target=_help, args=(work, numbers, answer, into))
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


def _help(work: Callable[[int], T], numbers: int, answer: Connection, into: Connection) -> None:
    """In the fork. Interrupting is the parent's business; where the parent is gone, nobody reads, and sending fails."""
    answer.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
    with suppress(Exception):
        into.send(_done(work, numbers))
