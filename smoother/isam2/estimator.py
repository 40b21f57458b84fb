"""Estimators `isam2` (the reference) and `isam2-online`, from one run of iSAM2."""

import time
from dataclasses import replace

import gtsam
import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimators.estimate import Estimate, Event, EventKind, Landmarks, Progress, Status
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from ..errors import FAILURES, failure_reason
from ..frame_update import recovery_reason
from ..graph.frame_states import FrameStates
from ..graph.gauss_newton import GaussNewtonResult, gauss_newton
from ..graph.gtsam_conversions import in_solver_frame, landmarks_from_values
from .incremental_smoother import FrameLostError, IncrementalSmoother
from .settings import ISAM2Settings


def isam2(problem: Problem, progress: Progress | None = None, settings: ISAM2Settings | None = None) -> Estimate:
    """Incremental smoothing with iSAM2 (Kaess et al., 2012): the estimate of every pose uses the whole recording.

    A landmark is initialized once its geometry is determined, with all its observations. Where the system is
    indeterminate, its landmark or the frame's observations are dropped, with an event; the status is then
    `recovered`. `by_products["isam2-online"]` is pose k as estimated from data up to k.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        centered, world_T_solver = in_solver_frame(problem)
        return _solve(centered, progress, settings or ISAM2Settings.of(problem)).transformed(world_T_solver)


def isam2_online(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Pose k as estimated from data up to frame k by the run of `isam2`: the causal counterpart of a filter.

    `by_products["isam2"]` is the run's final answer.
    """
    final = isam2(problem, progress)
    if final.status is Status.FAILED:
        return Estimate.failed("isam2-online", final.reason, problem.n_frames, len(problem.excluded))
    return _with_by_product(final.by_products["isam2-online"], final)


def _solve(problem: Problem, progress: Progress | None, settings: ISAM2Settings) -> Estimate:
    start = time.perf_counter()
    T = problem.n_frames
    if len(problem.observations()) == 0:
        return Estimate.failed("isam2", "no observations", T, len(problem.excluded))
    seconds = np.zeros(T)
    try:
        smoother = _run(problem, settings, seconds, progress)
        smoother.settle()
        graph, values = _final_solution(smoother, settings.relinearize_at_end)
    except FAILURES as error:
        return Estimate.failed("isam2", failure_reason(error), T, len(problem.excluded))
    states, landmarks = _marginals(smoother, graph, values)
    events = (*smoother.events, *_never_determined(smoother))
    reason = recovery_reason(events)
    used = problem.scatter_mask(smoother.used())
    online = Estimate(
        name="isam2-online",
        world_T_imu=smoother.builder.online.world_T_imu,
        landmarks=smoother.online_landmarks(),
        used=used,
        status=Status.RECOVERED if reason else Status.OK,
        reason=reason,
        seconds=seconds,
        seconds_total=float(seconds.sum()),
        events=events,
    )
    final = replace(online, name="isam2", landmarks=landmarks, seconds_total=time.perf_counter() - start)
    return _with_by_product(states.added_to(final), smoother.builder.online.added_to(online))


def _run(
    problem: Problem, settings: ISAM2Settings, seconds: FloatArray, progress: Progress | None
) -> IncrementalSmoother:
    """Run over all frames; with QR from the start where Cholesky would lose the observations of a frame."""
    quick = IncrementalSmoother(problem, settings)
    try:
        quick.run(seconds, progress)
        return quick
    except (FrameLostError, *FAILURES):
        if settings.qr or problem.landmark_prior is not None:
            raise
    where = quick.n_frames
    smoother = IncrementalSmoother(problem, replace(settings, qr=True))
    smoother.run(seconds, progress)
    # The causal estimates of the frames before the failure are those of the first run, by Cholesky.
    smoother.builder.online.replace_before(where, quick.builder.online)
    smoother.events.append(
        Event(where, EventKind.SOLVED_BY_QR, "Cholesky failed at this frame: pivots of very unequal size")
    )
    return smoother


def _with_by_product(estimate: Estimate, other: Estimate) -> Estimate:
    return replace(estimate, by_products={other.name: replace(other, by_products={})})


def _final_solution(
    smoother: IncrementalSmoother, relinearize: bool
) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
    """The whole graph and its solution, relinearized or not, without cheirality violations."""
    graph, values = smoother.release()
    while True:
        values, failure = gauss_newton(graph, values) if relinearize else GaussNewtonResult(values)
        if not smoother.drop_cheirality_violations(graph, values):
            break
    if failure:
        last = smoother.problem.n_frames - 1
        smoother.events.append(
            Event(last, EventKind.RELINEARIZATION_FAILED, f"{failure}; the solution before that step is kept")
        )
    return graph, values


def _marginals(
    smoother: IncrementalSmoother, graph: gtsam.NonlinearFactorGraph, values: gtsam.Values
) -> tuple[FrameStates, Landmarks]:
    """States with their covariances, NaN where there are none; the landmarks with theirs."""
    states = FrameStates.unknown(smoother.problem)
    states.take_all(values)
    try:
        covariance = states.take_marginals(smoother.problem, graph, values)
    except RuntimeError:
        last = smoother.problem.n_frames - 1
        smoother.events.append(Event(last, EventKind.NO_COVARIANCES, "the system is indeterminate at its solution"))
        return states, landmarks_from_values(values, smoother.key)
    return states, landmarks_from_values(values, smoother.key, covariance)


def _never_determined(smoother: IncrementalSmoother) -> list[Event]:
    kind, why = EventKind.LANDMARK_NEVER_DETERMINED, "its observations never determined its position"
    return [Event(frame, kind, why, landmark) for landmark, frame in smoother.builder.uninitialized.last_seen()]
