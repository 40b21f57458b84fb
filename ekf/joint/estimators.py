"""EKF-SLAM estimators with one joint state: `joint_ekf` and its named variants."""

import time
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.estimators.estimate import Estimate, Event, EventKind, GyroBias, Progress, Status
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FgbaselineError

from ..motion_model import POSE, BodyHistory
from .filter import JointFilter
from .gyro_bias import BIAS, GyroBiasPrior
from .landmark_representation import LandmarkRepresentation
from .settings import JointSettings, Linearization

BIAS_BLOCK = slice(POSE, POSE + BIAS)


def joint_ekf(problem: Problem, progress: Progress | None = None, settings: JointSettings | None = None) -> Estimate:
    """EKF-SLAM with one joint state: pose, optional gyroscope bias and landmarks, with all cross-covariances.

    With raw inertial samples the state has velocity and both biases. A landmark is initialized at its first observation
    (or at the problem's prior) and marginalized once `JointSettings.unseen_frames` consecutive frames have not observed
    it. For tracks without longer gaps the poses equal those of the filter that keeps every landmark. A landmark
    observed again later is initialized as a new one. Marginalized landmarks keep their estimate and covariance.

    Raises FgbaselineError for `gyro_bias` in the settings of a problem with raw inertial samples, and for one camera
    without inverse depth or its prior.
    """
    settings = settings or JointSettings.of(problem)
    if problem.imu is not None and settings.gyro_bias is not None:
        raise FgbaselineError(
            "joint-ekf-bias takes body velocities only: with raw inertial samples joint-ekf estimates both biases"
        )
    if problem.sequence.monocular:
        _require_inverse_depth(problem, settings)
    if len(problem.observations()) == 0:
        return Estimate.failed("joint-ekf", "no observations", problem.n_frames, len(problem.excluded))
    with threadpool_limits(limits=1, user_api="blas"), np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _run(problem, progress, settings)


def joint_ekf_bias(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Joint filter that also estimates the gyroscope bias, `Estimate.gyro_bias`, of body velocities.

    Raises FgbaselineError for raw inertial samples.
    """
    settings = JointSettings(gyro_bias=GyroBiasPrior())
    return replace(joint_ekf(problem, progress, settings), name="joint-ekf-bias")


def joint_ekf_textbook(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Textbook EKF-SLAM: points in the world, Jacobians at the latest estimate, no gate of single observations."""
    return replace(joint_ekf(problem, progress, JointSettings.textbook()), name="joint-ekf-textbook")


def joint_ekf_first_estimate(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Joint filter with first-estimate Jacobians in place of the invariant correction."""
    settings = replace(JointSettings.of(problem), linearization=Linearization.FIRST_ESTIMATE)
    return replace(joint_ekf(problem, progress, settings), name="joint-ekf-first-estimate")


def joint_ekf_ungated(problem: Problem, progress: Progress | None = None) -> Estimate:
    """Joint filter without a gate of single observations.

    The kernel down-weights outliers; a frame most of which disagrees is still rejected.
    """
    settings = replace(JointSettings.of(problem), gate=None)
    return replace(joint_ekf(problem, progress, settings), name="joint-ekf-ungated")


def _require_inverse_depth(problem: Problem, settings: JointSettings) -> None:
    """Raises FgbaselineError for settings that one camera does not support."""
    if settings.coordinates is LandmarkRepresentation.WORLD:
        raise FgbaselineError(
            "joint-ekf-textbook needs a stereo camera: from one view a point in the world has no position to start at"
        )
    if problem.inverse_depth_prior is None:
        raise FgbaselineError("joint-ekf: with one camera it needs the problem's inverse_depth_prior, which is missing")


def _run(problem: Problem, progress: Progress | None, settings: JointSettings) -> Estimate:
    start = time.perf_counter()
    T = problem.n_frames
    joint = JointFilter(problem, settings)
    history = BodyHistory(T, joint.motion.start)
    seconds = np.zeros(T)
    failure = ""
    for k, observed in enumerate(problem.observations().by_frame(T)):
        frame_start = time.perf_counter()
        joint.process_frame(k, observed)
        body, n = joint.state.body, joint.state.n_body
        covariance = joint.state.P[:n, :n]
        if not (np.isfinite(body.pose).all() and np.isfinite(covariance).all()):
            failure = f"the pose is not finite after the update of frame {k}"
            break
        history.record(k, body, covariance)
        seconds[k] = time.perf_counter() - frame_start
        if progress is not None:
            progress(k + 1, T)
    bias = None
    if settings.gyro_bias is not None:
        bias = GyroBias(history.additive, np.ascontiguousarray(history.covariance[:, BIAS_BLOCK, BIAS_BLOCK]))
        joint.events += _bias_events(bias)
    if not failure:
        joint.finish()
    status, reason = _status(failure, joint, T)
    return Estimate(
        name="joint-ekf",
        landmarks=joint.map.landmarks(problem.features),
        used=problem.scatter_mask(joint.used),
        status=status,
        reason=reason,
        seconds=seconds,
        seconds_total=time.perf_counter() - start,
        events=tuple(joint.events),
        innovations=joint.innovations,
        gyro_bias=bias,
        **history.fields(),
    )


def _bias_events(bias: GyroBias) -> list[Event]:
    """Event with the bias estimate (rad/s, 1-sigma) of the last frame that has one."""
    answered = np.flatnonzero(np.isfinite(bias.mean).all(axis=1))
    if len(answered) == 0:
        return []
    k = int(answered[-1])
    found = zip(bias.mean[k], np.sqrt(np.diagonal(bias.covariance[k])), strict=True)
    text = ", ".join(f"{mean:+.4f} ± {deviation:.4f}" for mean, deviation in found)
    return [Event(k, EventKind.GYROSCOPE_BIAS, f"gyroscope bias ({text}) rad/s in the axes of the IMU")]


def _status(failure: str, joint: JointFilter, n_frames: int) -> tuple[Status, str]:
    if failure:
        return Status.FAILED, failure
    trouble = {
        EventKind.FRAME_DISAGREES: "most observations disagreed with the prediction, and the frame was rejected",
        EventKind.COVARIANCE_LOST: "the joint covariance was no longer positive definite",
        EventKind.STATE_FULL: f"the state was full: {joint.n_deferred} observations were not used",
    }
    remarks = []
    for kind, what in trouble.items():
        frames = sorted({event.frame for event in joint.events if event.kind == kind})
        if frames:
            remarks.append(f"at {len(frames)} of {n_frames} frames, first at frame {frames[0]}, {what}")
    return (Status.RECOVERED, "; ".join(remarks)) if remarks else (Status.OK, "")
