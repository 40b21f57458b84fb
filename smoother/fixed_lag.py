"""A fixed-lag smoother: what is known of a pose when the next few seconds have been seen, at a bounded cost a frame."""

import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimate import Estimate, Event, EventKind, Progress, Status
from fgbaseline.data.problem import Problem

from .arrival import GivenUpError, add_recovering
from .arrivals import Arrivals
from .convention import from_first_pose
from .incremental import ISAM2Settings
from .undone import UNDONE
from .window import Window


@dataclass(frozen=True, slots=True)
class FixedLagSettings:
    """How long the window is, and how it is solved."""

    lag: float = 5.0
    """s"""
    isam2: ISAM2Settings = field(default_factory=ISAM2Settings)


def fixed_lag(problem: Problem, progress: Progress | None = None, settings: FixedLagSettings | None = None) -> Estimate:
    """Smoothing over a window that moves along; what leaves it becomes a linear prior on what stays.

    Pose k, its covariance and each landmark are as known at the last frame that had them in the window: from the data
    of up to `lag` seconds after them. Landmarks enter by the same rule as in `isam2`, with their observations in the
    window; one that comes back after it left is a new one to the graph. An indeterminate system costs what it
    costs `isam2`.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        answer = _solve(from_first_pose(problem), progress, settings or FixedLagSettings())
        return answer.moved(problem.initial_pose)


def _solve(problem: Problem, progress: Progress | None, settings: FixedLagSettings) -> Estimate:
    start, T = time.perf_counter(), problem.n_frames
    arrivals = Arrivals(problem, settings.isam2.entry)
    if len(arrivals.observations) == 0:
        return Estimate.failed("fixed-lag", "no observations", T, len(problem.excluded))
    window = Window(problem, arrivals, settings.lag, settings.isam2)
    seconds, dropped, events = np.zeros(T), set[int](), list[Event]()
    for k, observed in enumerate(arrivals.observations.by_frame(T)):
        begin = time.perf_counter()
        arrival = arrivals.next(k, range(observed.start, observed.stop), window.key, dropped, window.oldest)
        window.keep_leaving(float(problem.sequence.t[k]), arrival.seen.keys())
        try:
            cost = add_recovering(window, arrival)
        except GivenUpError as error:
            return Estimate.failed("fixed-lag", str(error), T, len(problem.excluded))
        dropped |= cost.landmarks
        events += cost.events
        arrivals.path[k] = window.pose(k)
        for j in arrivals.observations.landmark[observed].tolist():
            if j in window.key:
                arrivals.position[j] = window.position(j)
        seconds[k] = time.perf_counter() - begin
        if progress is not None:
            progress(k + 1, T)
    window.keep_leaving(np.inf, ())
    events += [Event(T - 1, EventKind.LANDMARK_DROPPED, UNDONE, j) for j in window.lost]
    trouble = [f"{kind} ({n})" for kind, n in sorted(Counter(event.kind for event in events).items())]
    return Estimate(
        name="fixed-lag",
        world_T_imu=window.path,
        covariance=window.covariance,
        landmarks=window.landmarks(),
        used=problem.scatter_mask(window.used),
        status=Status.RECOVERED if trouble else Status.OK,
        reason=f"the system was indeterminate on the way: {', '.join(trouble)}" if trouble else "",
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        events=tuple(events),
    )
