"""An exception of GTSAM or numpy anywhere in a run is a failed estimate with its cause, and does not escape."""

import gtsam
import numpy as np
import pytest

from fgbaseline import smoother
from fgbaseline.data import Status
from fgbaseline.smoother.graph_builder import GraphBuilder

from ..builders.synthetic import Scene, plain_problem

PROBLEM = plain_problem(Scene(frames=6, n_points=8).sequence())


def by_gtsam(*_: object) -> None:
    gtsam.Values().atPose3(7)


def by_numpy(*_: object) -> None:
    np.linalg.inv(np.zeros((2, 2)))


@pytest.mark.parametrize("name", ["isam2", "fixed-lag"])
@pytest.mark.parametrize(("broken", "reason"), [(by_gtsam, "GTSAM failed: "), (by_numpy, "numpy failed: Singular")])
def test_a_failure_in_the_middle_is_a_failed_estimate_with_its_cause(
    name: str, broken: object, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve = {"isam2": smoother.isam2, "fixed-lag": smoother.fixed_lag}[name]
    assert solve(PROBLEM).status is Status.OK
    monkeypatch.setattr(GraphBuilder, "observed_landmarks" if name == "isam2" else "frame_update", broken)
    answer = solve(PROBLEM)
    assert answer.status is Status.FAILED
    assert answer.reason.startswith(reason)
    assert "\n" not in answer.reason
