"""Where Cholesky would cost a frame, the whole is solved by QR; where it does not, nobody pays for that."""

import numpy as np
import pytest

from fgbaseline import smoother
from fgbaseline.data import Status
from fgbaseline.smoother.errors import IndeterminateSystemError
from fgbaseline.smoother.frame_update import Arrival
from fgbaseline.smoother.isam2.incremental_smoother import IncrementalSmoother
from fgbaseline.smoother.isam2.settings import ISAM2Settings

from ..builders.synthetic import Scene, plain_problem

PROBLEM = plain_problem(Scene().sequence())


def failing(monkeypatch: pytest.MonkeyPatch, frame: int, careful_too: bool) -> list[int]:
    """Lets every solution of a frame with observations fail, and keeps the frames that were tried."""
    add, tried = IncrementalSmoother.add, []

    def add_or_fail(self: IncrementalSmoother, arrival: Arrival, given_up: object) -> None:
        tried.append(arrival.frame)
        careful = self.solver.tree.params().getFactorization() == "QR"
        if arrival.frame == frame and (arrival.seen or arrival.entries) and (careful_too or not careful):
            raise IndeterminateSystemError(None, "made up")
        add(self, arrival, given_up)  # type: ignore[arg-type]

    monkeypatch.setattr(IncrementalSmoother, "add", add_or_fail)
    return tried


def test_qr_finds_the_same_answer() -> None:
    quick, careful = smoother.isam2(PROBLEM), smoother.isam2(PROBLEM, settings=ISAM2Settings(careful=True))
    assert quick.status is careful.status is Status.OK
    np.testing.assert_allclose(careful.world_T_imu, quick.world_T_imu, atol=1e-7)
    assert "solved by QR" not in {event.kind for event in (*quick.events, *careful.events)}


def test_a_frame_that_cholesky_would_cost_is_kept_by_qr_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = smoother.isam2(PROBLEM)
    tried = failing(monkeypatch, 5, careful_too=False)
    estimate = smoother.isam2(PROBLEM)
    assert estimate.status is Status.OK
    assert [event.frame for event in estimate.events if event.kind == "solved by QR"] == [5]
    np.testing.assert_array_equal(estimate.used, expected.used)
    np.testing.assert_allclose(estimate.world_T_imu, expected.world_T_imu, atol=1e-7)
    assert tried.count(0) == 2


def test_what_neither_can_solve_costs_the_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, 5, careful_too=True)
    estimate = smoother.isam2(PROBLEM)
    assert estimate.status is Status.RECOVERED
    assert "frame without observations (1)" in estimate.reason
    assert not estimate.used[PROBLEM.sequence.observations.frame == 5].any()
