"""Figures drawn by several processes are those that one draws."""

import os
import sys
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import pytest

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.reports import figures

from ..builders.runs import answer, run_of, scene
from ..builders.synthetic import plain_problem


@cache
def small_run() -> Run:
    problem = plain_problem(scene())
    return run_of(problem, answer(problem, "ekf"))


def drawn_by(processes: int) -> dict[str, figures.EncodedFigure]:
    with figures.drawn_in_background(small_run(), processes) as drawn:
        return drawn()


@cache
def drawn_by_one() -> dict[str, figures.EncodedFigure]:
    return drawn_by(1)


def test_one_process_writes_what_draw_draws() -> None:
    drawn = figures.draw(small_run())
    assert list(drawn) == list(drawn_by_one())
    name = "paths_overlaid"
    assert drawn_by_one()[name].title == drawn[name].get_label()
    assert drawn_by_one()[name].files == {form: figures.encoded(drawn[name], form) for form in ("png", "svg")}


def test_three_processes_write_the_same_bytes_in_the_same_order() -> None:
    shared = drawn_by(3)
    assert list(shared) == list(drawn_by_one())
    assert shared == drawn_by_one()


def open_fonts() -> dict[int, int]:
    """Descriptor -> position of each font file that this process has open."""
    fonts = [int(link.name) for link in Path("/proc/self/fd").iterdir() if link.resolve().suffix == ".ttf"]
    return {fd: os.lseek(fd, 0, os.SEEK_CUR) for fd in fonts}


@pytest.mark.skipif(sys.platform != "linux", reason="figures are drawn in forks on Linux only")
def test_a_fork_reads_no_font_file_of_its_parent() -> None:
    drawn_by_one()
    for fd in open_fonts():
        os.lseek(fd, 7, os.SEEK_SET)
    before = open_fonts()
    assert before
    fork = get_context("fork").Process(target=drawn_by, args=(1,))
    fork.start()
    fork.join()
    assert fork.exitcode == 0
    assert open_fonts() == before
