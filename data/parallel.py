"""Parallel map in forks of this process, with dynamic scheduling.

Forks share memory and imports, so that no arguments are sent. Only Linux forks safely; elsewhere this process computes
all items. Items of a fork that fails or dies are computed again here, so that an exception is raised in this process.
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
    """Maps `work` over 0 to n - 1 (at most 256) in the background, in `processes` - 1 forks, last numbers first.

    The yielded function joins the work and returns all results in order. The caller may do something else first. All
    forks have ended when the block ends, also by an exception.
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
    """Results of the items that this process takes from the queue `numbers` (a file descriptor), by number."""
    done = {}
    while number := os.read(numbers, 1):
        done[number[0]] = work(number[0])
    return done


@contextmanager
def _work_queue(n: int) -> Iterator[int]:
    """Queue of the items: a pipe of the bytes n - 1 to 0, of which a process reads one at a time."""
    numbers, into = os.pipe()
    os.write(into, bytes(reversed(range(n))))
    os.close(into)
    try:
        yield numbers
    finally:
        os.close(numbers)


@contextmanager
def _workers(work: Callable[[int], T], numbers: int, helpers: int) -> Iterator[list[Connection]]:
    """Pipes with the results of the forks."""
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
    """Interrupts blocked until the end of the block, because Python swallows exceptions in its fork hooks."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _worker(work: Callable[[int], T], numbers: int, answer: Connection, into: Connection) -> None:
    """Body of a fork. The parent handles interrupts; if the parent has ended, sending fails silently."""
    answer.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
    with suppress(Exception):
        into.send(_done(work, numbers))
