"""Estimator `fixed-lag`: each pose from the data up to a few seconds after it, at a bounded cost per frame."""

import time
from dataclasses import dataclass, field

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimators.estimate import Estimate, Event, EventKind, Progress, Status
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from ..errors import FAILURES, failure_reason
from ..frame_update import add_with_recovery, recovery_reason
from ..graph.cheirality import CHEIRALITY_VIOLATION
from ..graph.gtsam_conversions import in_solver_frame
from ..graph_builder import GraphBuilder
from ..isam2.settings import ISAM2Settings
from .window import FixedLagWindow


@dataclass(frozen=True, slots=True)
class FixedLagSettings:
    """Length of the window and settings of its solver."""

    lag: float = 5.0
    """s"""
    isam2: ISAM2Settings = field(default_factory=ISAM2Settings)

    @classmethod
    def of(cls, problem: Problem) -> "FixedLagSettings":
        """Default settings for a problem: with one camera, the parallax of `isam2` for landmarks."""
        return cls(isam2=ISAM2Settings.of(problem)) if problem.sequence.monocular else cls()


def fixed_lag(problem: Problem, progress: Progress | None = None, settings: FixedLagSettings | None = None) -> Estimate:
    """Fixed-lag smoothing: variables that leave the window are marginalized into a linear prior.

    Pose k, its covariance and each landmark are estimated from the data of up to `lag` seconds after them. Landmarks
    are initialized as in `isam2`, with their observations in the window. A marginalized landmark that is observed again
    is initialized as a new one. Indeterminate systems are handled as in `isam2`.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        posed, world_T_solver = in_solver_frame(problem)
        return _solve(posed, progress, settings or FixedLagSettings.of(problem)).transformed(world_T_solver)


def _solve(problem: Problem, progress: Progress | None, settings: FixedLagSettings) -> Estimate:
    start, T = time.perf_counter(), problem.n_frames
    builder = GraphBuilder(problem, settings.isam2.initialization)
    if len(builder.observations) == 0:
        return Estimate.failed("fixed-lag", "no observations", T, len(problem.excluded))
    window, seconds = FixedLagWindow(problem, builder, settings.lag, settings.isam2), np.zeros(T)
    try:
        events = _run(builder, window, seconds, progress)
    except FAILURES as error:
        return Estimate.failed("fixed-lag", failure_reason(error), T, len(problem.excluded))
    events += [Event(T - 1, EventKind.LANDMARK_DROPPED, CHEIRALITY_VIOLATION, j) for j in window.lost]
    reason = recovery_reason(events)
    estimate = Estimate(
        name="fixed-lag",
        world_T_imu=window.states.world_T_imu,
        landmarks=window.landmarks(),
        used=problem.scatter_mask(window.used),
        status=Status.RECOVERED if reason else Status.OK,
        reason=reason,
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        events=tuple(events),
    )
    return window.states.added_to(estimate)


def _run(builder: GraphBuilder, window: FixedLagWindow, seconds: FloatArray, progress: Progress | None) -> list[Event]:
    """Run over all frames; fill `seconds` (T,) and return the events. Raises one of FAILURES."""
    T, t = len(seconds), builder.problem.sequence.t
    dropped, events = set[int](), list[Event]()
    for k, observed in enumerate(builder.observations.by_frame(T)):
        begin = time.perf_counter()
        update = builder.frame_update(k, range(observed.start, observed.stop), window.key, dropped, window.oldest)
        window.store_marginalized(float(t[k]), update.tracked.keys())
        cost = add_with_recovery(window, update)
        dropped |= cost.landmarks
        events += cost.events
        window.take_newest(builder.online)
        for j in builder.observations.landmark[observed].tolist():
            if j in window.key:
                builder.landmark_position[j] = window.position(j)
        seconds[k] = time.perf_counter() - begin
        if progress is not None:
            progress(k + 1, T)
    window.store_marginalized(np.inf, ())
    return events
