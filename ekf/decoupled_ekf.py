"""Decoupled EKF: the visual-inertial SLAM of the source paper (part c), equations 9, 11, 12 and 13."""

import time

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimate import Estimate, Event, EventKind, Innovations, Landmarks, Progress, Status
from fgbaseline.data.motion import dead_reckoned_path
from fgbaseline.data.problem import LandmarkMode, Problem
from fgbaseline.geometry import FloatArray, se3

from .landmark_mapping import map_landmarks
from .landmark_update import IndependentLandmarks
from .nis import decoupled_nis, three_row_nis
from .pose_update import (
    PoseInnovation,
    pose_innovation,
    pose_posterior,
    predicted_covariance,
    standard_form_covariance,
)

SUSPECT_CONDITION = 1.0 / np.sqrt(np.finfo(np.float64).eps)
"""Condition number of the innovation covariance beyond which the rounding of (I - K H) Sigma may exceed its smallest
eigenvalue: eps times the condition against one over the condition."""


def ekf(problem: Problem, progress: Progress | None = None) -> Estimate:
    """EKF SLAM of the source paper, with separate covariances of pose and landmarks.

    Frame 0 updates the landmarks. Frame k >= 1 predicts with u_(k-1) (equation 9), updates the pose with the current
    landmarks (13), then the landmarks with the updated pose (11, 12). `LandmarkMode.FIXED` skips the landmark updates.

    A frame becomes an event, and the status `recovered`, where the covariance as printed is no longer positive
    definite because the innovation covariance is numerically singular.
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
        blocks, _ = map_landmarks(problem, dead_reckoned_path(problem.increment, problem.initial_pose))
    measurement, cam_T_imu = problem.measurement, se3.affine_inverse(problem.sequence.imu_T_cam)
    steps = se3.exp(problem.increment)
    poses = np.full((T, 4, 4), np.nan)
    covariances = np.full((T, 6, 6), np.nan)
    seconds = np.zeros(T)
    events: list[Event] = []
    innovations = Innovations.none(T)
    pose, covariance = problem.initial_pose, problem.initial_covariance
    failure = ""
    for k, seen in enumerate(o.by_frame(T)):
        frame_start = time.perf_counter()
        row, pixel = rows[seen], o.pixel[seen]
        weight = np.ones(len(row))
        if k > 0:
            pose = pose @ steps[k - 1]
            covariance = predicted_covariance(covariance, steps[k - 1], problem.increment_covariance[k - 1])
            known = blocks.known[row]
            if known.any():
                innovation = pose_innovation(measurement, cam_T_imu, pose, blocks.mean[row[known]], pixel[known])
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
                pose, covariance = pose @ se3.exp_one(posterior.correction), posterior.covariance
                if posterior.innovation_condition > SUSPECT_CONDITION:
                    lost = _standard_form_failure(predicted, innovation, weight[known])
                    if lost:
                        events.append(_singular_event(k, posterior.innovation_condition, lost))
        if not (np.isfinite(pose).all() and np.isfinite(covariance).all()):
            failure = f"the pose is not finite after the update of frame {k}"
            break
        if in_turn and len(row):
            blocks.update(pose, row, pixel, weight)
        poses[k], covariances[k] = pose, covariance
        seconds[k] = time.perf_counter() - frame_start
        if progress is not None:
            progress(k + 1, T)
    status, reason = _status(failure, events, T)
    taken = np.isfinite(poses[o.frame, 0, 0])
    known = blocks.known & np.isfinite(blocks.mean).all(axis=1)
    return Estimate(
        name="ekf",
        world_T_imu=poses,
        covariance=covariances,
        landmarks=Landmarks(problem.features[known], blocks.mean[known], blocks.covariance()[known]),
        used=problem.scatter_mask(taken),
        status=status,
        reason=reason,
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        events=tuple(events),
        innovations=innovations,
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
