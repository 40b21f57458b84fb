"""Decoupled EKF: the visual-inertial SLAM of the source paper (part c), equations 9, 11, 12 and 13."""

import time

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimators.estimate import Estimate, Event, EventKind, Innovations, Landmarks, Progress, Status
from fgbaseline.data.problem import LandmarkMode, Problem
from fgbaseline.geometry import FloatArray, se3

from .landmark_mapping import map_landmarks
from .landmark_update import IndependentLandmarks
from .motion_model import BodyHistory, motion_model, predicted_history
from .nis import decoupled_nis, three_row_nis
from .pose_update import (
    PoseInnovation,
    pose_innovation,
    pose_posterior,
    standard_form_covariance,
)

SUSPECT_CONDITION = 1.0 / np.sqrt(np.finfo(np.float64).eps)
"""Condition number of the innovation covariance beyond which the rounding of (I - K H) Sigma may exceed its smallest
eigenvalue: eps times the condition against one over the condition."""


def ekf(problem: Problem, progress: Progress | None = None) -> Estimate:
    """EKF SLAM of the source paper, with separate covariances of pose and landmarks.

    Frame 0 updates the landmarks. Each frame k >= 1 predicts with u_(k-1) (equation 9) or the inertial samples since
    frame k-1, updates the pose, and with inertial samples velocity and biases, with landmarks taken as known (13), and
    then updates the landmarks with the pose taken as known (11, 12). With `LandmarkMode.FIXED` landmarks stay as mapped
    along the dead-reckoned path.

    A frame whose printed covariance (I - K H) Sigma is not positive definite, because the innovation covariance is
    numerically singular, becomes an event, and the status is `recovered`.
    """
    if len(problem.observations()) == 0:
        return Estimate.failed("ekf", "no observations", problem.n_frames, len(problem.excluded))
    with threadpool_limits(limits=1, user_api="blas"), np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _run(problem, progress)


def _run(problem: Problem, progress: Progress | None) -> Estimate:
    start = time.perf_counter()
    o = problem.observations()
    rows = problem.feature_row(o.landmark)
    T = problem.n_frames
    in_turn = problem.landmark_mode is LandmarkMode.UPDATED
    if in_turn:
        blocks = IndependentLandmarks(problem, problem.measurement)
    else:
        blocks, _ = map_landmarks(problem, predicted_history(problem).pose)
    measurement, cam_T_imu = problem.measurement, se3.affine_inverse(problem.sequence.imu_T_cam)
    model = motion_model(problem)
    history = BodyHistory(T, model.start)
    seconds = np.zeros(T)
    events: list[Event] = []
    innovations = Innovations.none(T)
    body, covariance = model.start, model.covariance
    failure = ""
    for k, seen in enumerate(o.by_frame(T)):
        frame_start = time.perf_counter()
        row, pixel = rows[seen], o.pixel[seen]
        weight = np.ones(len(row))
        if k > 0:
            prediction = model.predict(k - 1, body)
            body, covariance = prediction.body, prediction.covariance(covariance)
            known = blocks.known[row]
            if known.any():
                innovation = pose_innovation(measurement, cam_T_imu, body.pose, blocks.mean[row[known]], pixel[known])
                innovations.degrees[k] = 3 * len(innovation.residual)
                if measurement.kernel is not None:
                    weight[known] = measurement.kernel.weight(innovation.nis_per_observation(covariance))
                try:
                    posterior = pose_posterior(covariance, innovation, weight[known])
                except np.linalg.LinAlgError as error:
                    failure = f"the pose cannot be updated at frame {k}: {error}"
                    break
                predicted = covariance
                innovations.nis[k] = (
                    three_row_nis(posterior, innovation)
                    if np.all(weight[known] == 1.0)
                    else decoupled_nis(innovation, predicted)
                )
                body, covariance = body.corrected(posterior.correction), posterior.covariance
                if posterior.innovation_condition > SUSPECT_CONDITION:
                    lost = _standard_form_failure(predicted, innovation, weight[known])
                    if lost:
                        events.append(_singular_event(k, posterior.innovation_condition, lost))
        if not (np.isfinite(body.pose).all() and np.isfinite(covariance).all()):
            failure = f"the pose is not finite after the update of frame {k}"
            break
        if in_turn and len(row):
            blocks.update(body.pose, row, pixel, weight)
        history.record(k, body, covariance)
        seconds[k] = time.perf_counter() - frame_start
        if progress is not None:
            progress(k + 1, T)
    status, reason = _status(failure, events, T)
    taken = np.isfinite(history.pose[o.frame, 0, 0])
    known = blocks.known & np.isfinite(blocks.mean).all(axis=1)
    return Estimate(
        name="ekf",
        landmarks=Landmarks(problem.features[known], blocks.mean[known], blocks.covariance()[known]),
        used=problem.scatter_mask(taken),
        status=status,
        reason=reason,
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        events=tuple(events),
        innovations=innovations,
        **history.fields(),
    )


def _standard_form_failure(covariance: FloatArray, innovation: PoseInnovation, weight: FloatArray) -> str:
    """Failure of the standard form (I - K H) Sigma; empty where it stays positive definite."""
    try:
        printed = standard_form_covariance(covariance, innovation, weight)
        smallest = float(np.linalg.eigvalsh(0.5 * (printed + printed.T))[0])
    except np.linalg.LinAlgError:
        return "has no inverse in double precision"
    return "" if smallest > 0.0 else f"leaves (I - K H) Sigma as printed with an eigenvalue of {smallest:.1e}"


def _singular_event(frame: int, condition: float, lost: str) -> Event:
    return Event(
        frame,
        EventKind.SINGULAR_INNOVATION,
        f"H Sigma H^T + V, with a condition number of {condition:.1e} from a landmark near the camera plane, {lost}",
    )


def _status(failure: str, events: list[Event], n_frames: int) -> tuple[Status, str]:
    if failure:
        return Status.FAILED, failure
    if events:
        return Status.RECOVERED, (
            f"the innovation covariance was numerically singular at {len(events)} of {n_frames} frames, "
            f"first at frame {events[0].frame}: the printed equations lose positive definiteness there, "
            "the form used here does not"
        )
    return Status.OK, ""
