"""QR solves the whole problem where Cholesky would lose a frame; otherwise it is not used."""

import numpy as np
import pytest

from fgbaseline import smoother
from fgbaseline.data import Status
from fgbaseline.smoother.errors import IndeterminateSystemError
from fgbaseline.smoother.frame_update import FrameUpdate
from fgbaseline.smoother.isam2.incremental_smoother import IncrementalSmoother
from fgbaseline.smoother.isam2.settings import ISAM2Settings

from ..builders.synthetic import Scene, plain_problem

PROBLEM = plain_problem(Scene().sequence())


def failing(monkeypatch: pytest.MonkeyPatch, frame: int, qr_too: bool) -> list[int]:
    """Lets every solution of a frame with observations fail, and keeps the frames that were tried."""
    add, tried = IncrementalSmoother.add, []

    def add_or_fail(self: IncrementalSmoother, update: FrameUpdate, dropped: object) -> None:
        tried.append(update.frame)
        qr = self.solver.tree.params().getFactorization() == "QR"
        if update.frame == frame and (update.tracked or update.new_landmarks) and (qr_too or not qr):
            raise IndeterminateSystemError(None, "made up")
        add(self, update, dropped)  # type: ignore[arg-type]

    monkeypatch.setattr(IncrementalSmoother, "add", add_or_fail)
    return tried


def test_qr_finds_the_same_answer() -> None:
    quick, qr = smoother.isam2(PROBLEM), smoother.isam2(PROBLEM, settings=ISAM2Settings(qr=True))
    assert quick.status is qr.status is Status.OK
    np.testing.assert_allclose(qr.world_T_imu, quick.world_T_imu, atol=1e-7)
    assert "solved by QR" not in {event.kind for event in (*quick.events, *qr.events)}


def test_a_frame_that_cholesky_would_lose_is_solved_by_qr_and_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = smoother.isam2(PROBLEM)
    tried = failing(monkeypatch, 5, qr_too=False)
    estimate = smoother.isam2(PROBLEM)
    assert estimate.status is Status.OK
    assert [event.frame for event in estimate.events if event.kind == "solved by QR"] == [5]
    np.testing.assert_array_equal(estimate.used, expected.used)
    np.testing.assert_allclose(estimate.world_T_imu, expected.world_T_imu, atol=1e-7)
    assert tried.count(0) == 2


def test_a_frame_that_neither_solver_can_solve_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, 5, qr_too=True)
    estimate = smoother.isam2(PROBLEM)
    assert estimate.status is Status.RECOVERED
    assert "1 frame's observations dropped" in estimate.reason
    assert not estimate.used[PROBLEM.sequence.observations.frame == 5].any()
