"""Parallel map with forks of this process, each of which takes the next open item.

Forks share memory and imports, so that nothing is sent to them. Only Linux forks safely; elsewhere this process does
all items. Items of a fork that fails or dies are computed here again, so that an error is raised in this process.
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
    """The number of cores of this process that `background_map` can use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1


@contextmanager
def background_map(work: Callable[[int], T], n: int, processes: int) -> Iterator[Callable[[], list[T]]]:
    """Starts `work` on the numbers 0 to n - 1 (at most 256) in `processes` - 1 forks, the last numbers first.

    The yielded function joins the work until it is done, and returns all results in the order of their numbers. This
    process may do something else first. All forks have ended when the block ends, also by an exception.
    """
    helpers = min(processes - 1, n) if sys.platform == "linux" else 0
    with _work_queue(n) as numbers, _workers(work, numbers, helpers) as answers:

        def join() -> list[T]:
            done = _done(work, numbers)
            for answer in answers:
                with suppress(EOFError):  # it died, or failed
                    done |= answer.recv()
            return [done[i] if i in done else work(i) for i in range(n)]

        yield join


def _done(work: Callable[[int], T], numbers: int) -> dict[int, T]:
    """Results by number of the items that this process takes."""
    done = {}
    while number := os.read(numbers, 1):
        done[number[0]] = work(number[0])
    return done


@contextmanager
def _work_queue(n: int) -> Iterator[int]:
    """A pipe of the bytes n - 1 to 0; a process takes the number that it reads."""
    numbers, into = os.pipe()
    os.write(into, bytes(reversed(range(n))))
    os.close(into)
    try:
        yield numbers
    finally:
        os.close(numbers)


@contextmanager
def _workers(work: Callable[[int], T], numbers: int, helpers: int) -> Iterator[list[Connection]]:
    """The pipes of results of so many forks."""
    answers, started = [], list[ForkProcess]()
    try:
        for _ in range(helpers):
            context = get_context("fork")
            answer, into = context.Pipe(duplex=False)
            process = context.Process(target=_worker, args=(work, numbers, answer, into))
            with _interrupts_blocked():
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
def _interrupts_blocked() -> Iterator[None]:
    """Interrupts delayed to the end of the block: Python swallows exceptions in its hooks around a fork."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _worker(work: Callable[[int], T], numbers: int, answer: Connection, into: Connection) -> None:
    """The body of a fork. The parent handles interrupts; where the parent is gone, sending fails."""
    answer.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
    with suppress(Exception):
        into.send(_done(work, numbers))
