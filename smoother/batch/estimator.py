"""Estimator `batch`: Levenberg-Marquardt on the full graph from two initial values; the lower cost is used."""

import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace

import gtsam
import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimators.estimate import Estimate, Event, EventKind, Landmarks, Progress, Status
from fgbaseline.data.problem import Problem
from fgbaseline.data.velocity_increments import dead_reckoned_path

from ..graph.cheirality import CHEIRALITY_VIOLATION, cheirality_violations
from ..graph.frame_states import FrameStates
from ..graph.gtsam_conversions import landmarks_from_values, poses_from_values
from ..graph.keys import landmark_key
from ..initialization.inertial_windows import inertial_states
from ..initialization.initial_values import determined_observations, restricted_problem, select_landmarks
from ..initialization.landmark_initialization import InitializationCriterion
from ..initialization.windowed_initialization import optimize_in_windows
from ..isam2.estimator import isam2
from .full_graph import full_graph
from .levenberg_marquardt import LocalMinimum, optimize_from_estimate, optimize_from_path

DEAD_RECKONING, ISAM2 = "dead reckoning", "isam2's solution"
SAME_COST = 1e-4
"""relative difference of two costs up to which both starts found the same minimum"""


def batch(
    problem: Problem,
    progress: Progress | None = None,
    given: Mapping[str, Estimate] | None = None,
    *,
    from_dead_reckoning: bool = True,
) -> Estimate:
    """Minimum of the graph of iSAM2, by Levenberg-Marquardt from dead reckoning and from the solution of iSAM2.

    The observations are those that iSAM2 used, so that costs are comparable. If iSAM2 failed, they are those of the
    landmarks determined along dead reckoning, which is then the only start. An event reports both costs.
    `from_dead_reckoning=False` leaves out that descent, a third of the time of iSAM2 or more, unless iSAM2 failed.

    `given` may hold the answer of `isam2` to this problem; otherwise it is computed, and `by_products` has it with
    `isam2-online`. The time excludes iSAM2.
    """
    answer = (given or {}).get("isam2")
    by_products: dict[str, Estimate] = {}
    if answer is None:
        answer = isam2(problem, progress)
        by_products = {"isam2": answer, **answer.by_products}
    elif progress is not None:
        progress(problem.n_frames, problem.n_frames)
    with threadpool_limits(limits=1, user_api="blas"):
        both = from_dead_reckoning or answer.status is Status.FAILED
        return replace(_solve(problem, answer, both=both), by_products=by_products)


def _solve(problem: Problem, answer: Estimate, *, both: bool) -> Estimate:
    start = time.perf_counter()
    T, failed = problem.n_frames, answer.status is Status.FAILED
    around = _dead_reckoned(problem, windows=False) if failed else FrameStates.of_estimate(answer)
    used = determined_observations(problem, around.world_T_imu, InitializationCriterion()) if failed else answer.used
    events: list[Event] = []
    while used.any():
        kept = restricted_problem(problem, used)
        graph = full_graph(kept, around)
        minima = _minima(graph, kept, None if failed else answer, events, both=both)
        if not minima:
            break
        best = min(minima, key=lambda minimum: minimum.cost)
        states = FrameStates.unknown(kept)
        states.take_all(best.values)
        landmarks = landmarks_from_values(best.values, _keys(kept))
        gone = cheirality_violations(kept, kept.observations(), states.world_T_imu, landmarks)
        if not gone:
            landmarks = _marginals(graph, kept, best, states, events)
            status, reason = _status(answer, events)
            estimate = Estimate(
                name="batch",
                world_T_imu=states.world_T_imu,
                landmarks=landmarks,
                used=used,
                status=status,
                reason=reason,
                seconds_total=time.perf_counter() - start,
                events=(*events, _costs(minima, T - 1, both=both)),
            )
            return states.added_to(estimate)
        # A cheirality violation has no gradient and a meaningless residual: costs with it are not comparable.
        events += [Event(T - 1, EventKind.LANDMARK_DROPPED, CHEIRALITY_VIOLATION, j) for j in gone]
        used = used & ~np.isin(problem.sequence.observations.landmark, gone)
    return Estimate.failed("batch", "no landmark is determined, or no descent ended", T, len(used))


def _status(answer: Estimate, events: list[Event]) -> tuple[Status, str]:
    trouble = [f"{kind} ({n})" for kind, n in sorted(Counter(event.kind for event in events).items())]
    if answer.status is Status.FAILED:
        trouble.insert(0, f"isam2 failed, so there is no start ({answer.reason})")
    return (Status.RECOVERED, ", ".join(trouble)) if trouble else (Status.OK, "")


def _dead_reckoned(problem: Problem, *, windows: bool = True) -> FrameStates:
    """States by the motion, corrected by the images window by window, as they always are with raw inertial data."""
    if problem.imu is not None:
        return inertial_states(problem)
    path = dead_reckoned_path(problem.increment, problem.initial_pose)
    states = FrameStates.unknown(problem)
    states.world_T_imu = optimize_in_windows(problem, path) if windows else path
    return states


def _minima(
    graph: gtsam.NonlinearFactorGraph, kept: Problem, answer: Estimate | None, events: list[Event], *, both: bool
) -> list[LocalMinimum]:
    """Minima of the descents, from dead reckoning with `both`; one that GTSAM aborts is an event."""
    starts: list[Callable[[], LocalMinimum]] = []
    if both:
        starts.append(lambda: optimize_from_path(graph, kept, DEAD_RECKONING, _dead_reckoned(kept)))
    if answer is not None:
        landmarks = select_landmarks(answer.landmarks, np.unique(kept.observations().landmark))
        states = FrameStates.of_estimate(answer)
        starts.append(lambda: optimize_from_estimate(graph, ISAM2, states, landmarks))
    minima = []
    for descend in starts:
        try:
            minima.append(descend())
        except RuntimeError as error:
            events.append(Event(kept.n_frames - 1, EventKind.DESCENT_FAILED, str(error).strip().partition("\n")[0]))
    return [minimum for minimum in minima if np.isfinite(minimum.cost)]


def _costs(minima: list[LocalMinimum], last: int, *, both: bool) -> Event:
    """Event with the costs from all starts."""
    costs = " and ".join(f"{minimum.cost:,.8g} from a start at {minimum.start}" for minimum in minima)
    if not both:
        return Event(last, EventKind.STARTED_AT_ISAM2, f"no second start was requested; the final cost is {costs}")
    if len(minima) == 1:
        return Event(
            last,
            EventKind.ONE_START,
            f"the final cost is {costs}; a second start failed",
        )
    low, high = sorted(minimum.cost for minimum in minima)
    share = high / low - 1.0 if low > 0 else float("inf")
    one, other = (poses_from_values(minimum.values, range(last + 1))[:, :3, 3] for minimum in minima)
    rmse = float(np.sqrt(np.mean(np.sum((one - other) ** 2, axis=1))))
    apart = f"they differ by {share:.1e} of it, the trajectories by {rmse:.2g} m (RMSE)"
    if share <= SAME_COST:
        return Event(last, EventKind.SAME_COST, f"the cost is {costs}: {apart}")
    return Event(last, EventKind.DIFFERENT_COSTS, f"the cost is {costs}: {apart}; the lower one counts")


def _marginals(
    graph: gtsam.NonlinearFactorGraph, kept: Problem, best: LocalMinimum, states: FrameStates, events: list[Event]
) -> Landmarks:
    """Landmarks with their covariances; those of the states are set."""
    keys = _keys(kept)
    try:
        covariance = states.take_marginals(kept, graph, best.values)
    except RuntimeError:
        last = kept.n_frames - 1
        events.append(Event(last, EventKind.NO_COVARIANCES, "the system is indeterminate at its solution"))
        return landmarks_from_values(best.values, keys)
    return landmarks_from_values(best.values, keys, covariance)


def _keys(problem: Problem) -> dict[int, int]:
    return {int(j): landmark_key(int(j)) for j in np.unique(problem.observations().landmark)}
