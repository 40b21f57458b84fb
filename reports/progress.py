"""Progress on standard error: a bar with frames per second on a terminal, plain lines elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeAlias

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from fgbaseline.data import Progress as FrameProgress


class _Speed(ProgressColumn):
    """Frames per second, averaged over the last seconds."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:,.0f} frames/s", style="cyan")


class BarReporter:
    """Progress on a terminal."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)

    def print_line(self, text: str) -> None:
        """Prints a line above the bars."""
        self._console.print(text, markup=False, highlight=False)

    @contextmanager
    def estimator(self, name: str) -> Iterator[FrameProgress]:
        """Shows a bar for one estimator; yields the function that takes its frames done and in total."""
        columns = (TextColumn("{task.description:>16}", markup=False), BarColumn(), MofNCompleteColumn(), _Speed())
        with Progress(*columns, TimeRemainingColumn(), console=self._console) as bar:
            task = bar.add_task(name, total=None)
            yield lambda done, total, /: bar.update(task, completed=done, total=total)


class LineReporter:
    """Progress in a file or a pipe: a line at the start of an estimator, every ten seconds, and at its end."""

    INTERVAL = 10.0

    def print_line(self, text: str) -> None:
        """Prints a line."""
        print(text, file=sys.stderr, flush=True)

    @contextmanager
    def estimator(self, name: str) -> Iterator[FrameProgress]:
        """Prints lines for one estimator; yields the function that takes its frames done and in total."""
        start = printed = time.monotonic()
        self.print_line(f"{name}: started")

        def progress(done: int, total: int, /) -> None:
            nonlocal printed
            now = time.monotonic()
            if now - printed >= self.INTERVAL:
                printed = now
                self.print_line(f"{name}: frame {done} of {total}, {done / (now - start):.0f} frames/s")

        yield progress
        self.print_line(f"{name}: finished after {time.monotonic() - start:.1f} s")


Reporter: TypeAlias = BarReporter | LineReporter


def reporter() -> Reporter:
    """The reporter for this standard error."""
    return BarReporter() if sys.stderr.isatty() else LineReporter()
