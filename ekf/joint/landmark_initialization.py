"""New landmarks of the joint state from one observation each, back-projected from the current pose estimate."""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.measurement_model import back_projected

from .landmark_representation import chart, coordinates_of
from .monocular.inverse_depth_prior import inverse_depths, scene_depth
from .settings import JointSettings, Linearization
from .state import CommonError, JointState


class NewLandmarks(NamedTuple):
    """n new landmarks, in the order of the arguments of `JointState.initialize`."""

    chart: FloatArray
    """(4, 4) of all"""
    xi: FloatArray
    """(n, 3) coordinates in the chart"""
    by_pose: FloatArray
    """(n, 3, 6) derivatives of the error of xi by that of the pose"""
    covariance: FloatArray
    """(n, 3, 3) of the error of xi by the pixel noise alone"""
    common: CommonError | None
    """error that all share, with one camera"""


def new_landmarks(
    problem: Problem, settings: JointSettings, state: JointState, cam_T_imu: FloatArray, measured: FloatArray
) -> NewLandmarks:
    """Landmarks from measured rows (n, r), px, of one observation each.

    The limit of an update with an uninformative prior: with delta the error of the pose, e that of the coordinates and
    n that of the pixels, 0 = H_pose delta + H_xi e + n gives e = -H_xi^-1 (H_pose delta + n). One camera lacks a third
    row; a pseudo-measurement of the inverse depth takes its place, the mean of the scene (`inverse_depth_prior`), whose
    error all new landmarks share.
    """
    n, r = measured.shape
    camera, model = problem.sequence.camera, problem.measurement
    world_T_cam = state.pose @ problem.sequence.imu_T_cam
    prior = problem.inverse_depth_prior if model.monocular else None
    scene = None if prior is None else scene_depth(prior, state, cam_T_imu)
    points = back_projected(camera, measured, np.nan if scene is None else scene.mean) @ world_T_cam.T
    new_chart = chart(settings.coordinates, world_T_cam)
    xi = coordinates_of(new_chart, points)
    pose = state.predicted.pose if settings.linearization is Linearization.FIRST_ESTIMATE else state.pose
    predicted = predict(camera, cam_T_imu, pose, xi @ new_chart[:, :3].T + new_chart[:, 3])
    H_xi = (predicted.point_jacobian().reshape(r * n, 4) @ new_chart[:, :3]).reshape(n, r, 3)
    H_pose, variance, common = predicted.pose_jacobian(), model.row_variance, None
    if scene is not None:
        _, by_pose, by_xi = inverse_depths(pose, cam_T_imu, np.broadcast_to(new_chart, (n, 4, 4)), xi)
        H_pose, H_xi = (np.concatenate(H, axis=1) for H in ((H_pose, by_pose[:, None]), (H_xi, by_xi[:, None])))
        variance = np.append(variance, (scene.spread * scene.mean) ** 2)
    inverse = np.linalg.inv(H_xi)
    if scene is not None:
        common = CommonError(np.asarray(scene.mean * inverse[:, :, r]), scene.covariance, scene.variance)
    covariance = (inverse * variance) @ np.swapaxes(inverse, 1, 2)
    return NewLandmarks(new_chart, xi, -inverse @ H_pose, covariance, common)
