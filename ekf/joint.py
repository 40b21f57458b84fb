"""The joint filter as an estimator: EKF-SLAM with one state, and every covariance in it."""

import time

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimate import Estimate, Event, EventKind, GyroBias, Progress, Status
from fgbaseline.data.problem import Problem

from .joint_filter import JointFilter
from .joint_settings import JointSettings
from .joint_state import BIAS, POSE

BIAS_BLOCK = slice(POSE, POSE + BIAS)


def joint_ekf(problem: Problem, progress: Progress | None = None, settings: JointSettings | None = None) -> Estimate:
    """One state: the pose, the gyroscope's bias where the settings ask for it, and every landmark, with all
    cross-covariances.

    A landmark is initialized at its first observation (or at the problem's prior) and marginalized once
    `JointSettings.unseen_frames` frames in a row have not seen it. For tracks without longer gaps the poses are exactly
    those of the filter that keeps every landmark. A landmark that comes back later is a new one. Marginalized landmarks
    keep the value and covariance of that moment.
    """
    if len(problem.observations()) == 0:
        return Estimate.failed("joint-ekf", "no observations", problem.n_frames, len(problem.excluded))
    with threadpool_limits(limits=1, user_api="blas"), np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _run(problem, progress, settings or JointSettings())


def _run(problem: Problem, progress: Progress | None, settings: JointSettings) -> Estimate:
    start = time.perf_counter()
    T = problem.n_frames
    joint = JointFilter(problem, settings)
    poses = np.full((T, 4, 4), np.nan)
    covariances = np.full((T, 6, 6), np.nan)
    bias = GyroBias(np.full((T, BIAS), np.nan), np.full((T, BIAS, BIAS), np.nan))
    seconds = np.zeros(T)
    failure = ""
    for k, seen in enumerate(problem.observations().by_frame(T)):
        frame_start = time.perf_counter()
        joint.add_frame(k, seen)
        covariance = joint.state.P[:POSE, :POSE]
        if not (np.isfinite(joint.state.pose).all() and np.isfinite(covariance).all()):
            failure = f"the pose is not finite after the update of frame {k}"
            break
        poses[k], covariances[k] = joint.state.pose, covariance
        if settings.gyro_bias is not None:
            bias.mean[k], bias.covariance[k] = joint.state.bias, joint.state.P[BIAS_BLOCK, BIAS_BLOCK]
        seconds[k] = time.perf_counter() - frame_start
        if progress is not None:
            progress(k + 1, T)
    if settings.gyro_bias is not None:
        joint.events += _told(bias)
    if not failure:
        joint.finish()
    status, reason = _verdict(failure, joint, T)
    return Estimate(
        name="joint-ekf",
        world_T_imu=poses,
        covariance=covariances,
        landmarks=joint.map.landmarks(problem.features),
        used=problem.scatter_mask(joint.used),
        status=status,
        reason=reason,
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        events=tuple(joint.events),
        innovations=joint.innovations,
        gyro_bias=None if settings.gyro_bias is None else bias,
    )


def _told(bias: GyroBias) -> list[Event]:
    """What was found of the bias, at the last frame that has an answer."""
    answered = np.flatnonzero(np.isfinite(bias.mean).all(axis=1))
    if len(answered) == 0:
        return []
    k = int(answered[-1])
    found = zip(bias.mean[k], np.sqrt(np.diagonal(bias.covariance[k])), strict=True)
    text = ", ".join(f"{mean:+.4f} ± {deviation:.4f}" for mean, deviation in found)
    return [Event(k, EventKind.GYROSCOPE_BIAS, f"at rest the gyroscope reads ({text}) rad/s on the IMU's axes")]


def _verdict(failure: str, joint: JointFilter, n_frames: int) -> tuple[Status, str]:
    if failure:
        return Status.FAILED, failure
    trouble = {
        EventKind.FRAME_DISAGREES: "most observations disagreed with the prediction, which took no part",
        EventKind.COVARIANCE_LOST: "the joint covariance was no longer positive definite",
        EventKind.STATE_FULL: f"the state was full: {joint.waited} observations were not used",
    }
    told = []
    for kind, what in trouble.items():
        frames = sorted({event.frame for event in joint.events if event.kind == kind})
        if frames:
            told.append(f"at {len(frames)} of {n_frames} frames, first at frame {frames[0]}, {what}")
    return (Status.RECOVERED, "; ".join(told)) if told else (Status.OK, "")
