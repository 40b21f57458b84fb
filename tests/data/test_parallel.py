"""What forks of this process share is what one process does, whatever becomes of them."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import FrameType

import pytest

from fgbaseline.data.parallel import background_map

FORKS = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely")


def children() -> set[str]:
    """The processes that this one has started and that are left."""
    return set(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())


@pytest.mark.parametrize("processes", [1, 2, 3, 20])
def test_results_come_in_the_order_of_their_numbers_and_no_fork_is_left(processes: int) -> None:
    before = children() if sys.platform == "linux" else set()
    with background_map(lambda i: i * i, 10, processes) as join:
        assert join() == [i * i for i in range(10)]
    assert sys.platform != "linux" or children() <= before


def test_there_may_be_nothing_to_share() -> None:
    with background_map(lambda i: i, 0, 2) as join:
        assert join() == []


@FORKS
def test_a_fork_works_while_this_process_does_something_else() -> None:
    came, write_end = os.pipe()
    with background_map(lambda _: os.write(write_end, b"!"), 1, 2) as join:
        assert os.read(came, 1) == b"!"
        assert join() == [1]


@FORKS
def test_the_job_of_a_killed_fork_is_done_by_the_parent() -> None:
    here = os.getpid()

    def die(number: int) -> int:
        if os.getpid() != here:
            os._exit(9)
        return number

    with background_map(die, 5, 3) as join:
        assert join() == list(range(5))


@FORKS
def test_an_exception_in_a_fork_is_raised_once_in_the_parent(capfd: pytest.CaptureFixture[str]) -> None:
    def fail(number: int) -> int:
        raise ValueError(f"no {number}")

    with background_map(fail, 1, 2) as join, pytest.raises(ValueError, match="no 0"):
        join()
    assert capfd.readouterr().err == ""


@FORKS
def test_a_fork_whose_parent_was_killed_ends() -> None:
    """What it computes fits into no pipe, so it would wait for a reader for ever."""
    script = """
import os, signal, time
from fgbaseline.data.parallel import background_map

def large(_):
    time.sleep(0.5)
    return bytes(10_000_000)

with background_map(large, 1, 2):
    os.kill(os.getpid(), signal.SIGKILL)
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
        with pytest.raises(KeyboardInterrupt), background_map(lambda i: i, 2, 2) as join:
            join()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert due == []
