"""What an estimator costs beside time: the memory of its process while it works."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fgbaseline.data import Progress

RESET_PEAK = "5"
"""what makes Linux forget the peak so far (man 5 proc, clear_refs)"""
Tell = Callable[[str, int, int], None]
"""told of every frame: estimator, frames done, frames there are"""


class CostWatch:
    """Around the work of estimators, one at a time: notes the peak memory of each, and tells of progress."""

    def __init__(self, tell: Tell) -> None:
        self.peak_mb: dict[str, float] = {}
        """by estimator: the largest resident memory of the process while it worked, MB; missing where the system does
        not tell"""
        self._tell = tell

    @contextmanager
    def __call__(self, name: str) -> Iterator[Progress]:
        """The `Watch` of `solve_all`."""
        self._tell(name, 0, 0)
        forgotten = _forget_peak()
        yield lambda done, total, /: self._tell(name, done, total)
        if forgotten and (peak := _peak_mb()) is not None:
            self.peak_mb[name] = peak


def _forget_peak() -> bool:
    try:
        Path("/proc/self/clear_refs").write_text(RESET_PEAK)
    except OSError:
        return False
    return True


def _peak_mb() -> float | None:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024 / 1e6
    return None
