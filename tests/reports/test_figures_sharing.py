"""Figures drawn by several processes are those that one draws."""

from functools import cache

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
