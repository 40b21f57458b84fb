"""Progress on standard error: a bar with frames per second on a terminal, plain lines elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from fgbaseline.data import Progress as FrameProgress


class Reporter(Protocol):
    """Tells a person how far a run has come."""

    def say(self, text: str) -> None:
        """One line on what happens next."""
        ...

    def estimator(self, name: str) -> AbstractContextManager[FrameProgress]:
        """Around the work of one estimator; gives what is told of every frame."""
        ...


class _Speed(ProgressColumn):
    """Frames per second, averaged over the last seconds."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:,.0f} frames/s", style="cyan")


class BarReporter:
    """For a terminal."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)

    def say(self, text: str) -> None:
        """A line above the bars."""
        self._console.print(text, markup=False, highlight=False)

    @contextmanager
    def estimator(self, name: str) -> Iterator[FrameProgress]:
        """A bar for one estimator."""
        columns = (TextColumn("{task.description:>16}", markup=False), BarColumn(), MofNCompleteColumn(), _Speed())
        with Progress(*columns, TimeRemainingColumn(), console=self._console) as bar:
            task = bar.add_task(name, total=None)
            yield lambda done, total, /: bar.update(task, completed=done, total=total)


class LineReporter:
    """For a file or a pipe: a line when an estimator starts, every ten seconds, and when it has ended."""

    INTERVAL = 10.0

    def say(self, text: str) -> None:
        """A line."""
        print(text, file=sys.stderr, flush=True)

    @contextmanager
    def estimator(self, name: str) -> Iterator[FrameProgress]:
        """Lines for one estimator."""
        start = told = time.monotonic()
        self.say(f"{name}: started")

        def progress(done: int, total: int, /) -> None:
            nonlocal told
            now = time.monotonic()
            if now - told >= self.INTERVAL:
                told = now
                self.say(f"{name}: frame {done} of {total}, {done / (now - start):.0f} frames/s")

        yield progress
        self.say(f"{name}: ended after {time.monotonic() - start:.1f} s")


def reporter() -> Reporter:
    """The one that fits standard error."""
    return BarReporter() if sys.stderr.isatty() else LineReporter()
