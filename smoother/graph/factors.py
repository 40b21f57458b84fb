"""GTSAM factors of a problem, with the noise models that the filters have.

`StereoPoint2` has the rows (uL, uR, v) of `geometry.measurement_model`, with their variances; one camera has (uL, v).
"""

import math
from collections.abc import Iterable

import gtsam
import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, HuberKernel, StereoCamera, se3

from .frame_states import FrameStates
from .gtsam_conversions import reorder_tangent
from .inertial_factors import InertialFactors
from .keys import pose_key

FIXED_POSE_SIGMA = 1e-6
"""sigma of a fixed pose, in unit lengths of the camera and rad: not zero, so that Cholesky can be used"""


class FactorBuilder:
    """Builds the GTSAM factors of one problem; GTSAM linearizes them, with Jacobians of its own."""

    def __init__(self, problem: Problem) -> None:
        camera = problem.sequence.camera
        self.problem = problem
        pinhole = (camera.fu, camera.fv, 0.0, camera.cu, camera.cv)
        self._left = gtsam.Cal3_S2(*pinhole)
        self._stereo = gtsam.Cal3_S2Stereo(*pinhole, camera.baseline) if isinstance(camera, StereoCamera) else None
        self.imu_P_cam = gtsam.Pose3(problem.sequence.imu_T_cam)
        self._row_sigmas = np.sqrt(problem.measurement.row_variance)
        self._gaussian_noise = gtsam.noiseModel.Diagonal.Sigmas(self._row_sigmas)
        self.pixel_noise = under_kernel(self._gaussian_noise, problem.kernel)
        self.steps = se3.exp(problem.increment)
        self.step_covariance = reorder_tangent(problem.increment_covariance)
        self.inertial = (
            None
            if problem.imu is None or problem.start is None
            else InertialFactors(problem.imu, problem.start, problem.initial_pose, self.fixed_pose_sigmas)
        )

    @property
    def fixed_pose_sigmas(self) -> FloatArray:
        """Sigmas (6,) of a fixed pose in GTSAM's order: rotation, rad, then translation, m."""
        return FIXED_POSE_SIGMA * np.repeat([1.0, self.problem.sequence.camera.unit_length], 3)

    def start_prior(self) -> gtsam.NonlinearFactor:
        """Prior factor of frame 0."""
        return self.pose_prior() if self.inertial is None else self.inertial.start_prior()

    def motion(self, frame: int, states: FrameStates) -> gtsam.NonlinearFactor:
        """Factor of the motion from `frame` to the next; samples are integrated with the frame's biases."""
        if self.inertial is None:
            return self.between(frame)
        return self.inertial.motion(frame, self.inertial.preintegrated(frame, states.bias[frame]))

    def fixed_state(self, frame: int, states: FrameStates) -> gtsam.NonlinearFactor:
        """Prior factor that fixes the pose of a frame; velocity and biases have their covariance given that pose."""
        if self.inertial is not None:
            return self.inertial.fixed_pose(frame, states)
        fixed = gtsam.noiseModel.Diagonal.Sigmas(self.fixed_pose_sigmas)
        return gtsam.PriorFactorPose3(pose_key(frame), gtsam.Pose3(states.world_T_imu[frame]), fixed)

    def pose_prior(self) -> gtsam.PriorFactorPose3:
        """Prior factor of the pose of frame 0."""
        covariance = reorder_tangent(self.problem.initial_covariance) + np.diag(self.fixed_pose_sigmas**2)
        noise = gtsam.noiseModel.Gaussian.Covariance(covariance)
        return gtsam.PriorFactorPose3(pose_key(0), gtsam.Pose3(self.problem.initial_pose), noise)

    def between(self, frame: int) -> gtsam.BetweenFactorPose3:
        """Between factor of the increment from `frame` to the next."""
        noise = gtsam.noiseModel.Gaussian.Covariance(self.step_covariance[frame])
        step = gtsam.Pose3(self.steps[frame])
        return gtsam.BetweenFactorPose3(pose_key(frame), pose_key(frame + 1), step, noise)

    def observation(
        self, frame: int, key: int, rows: Iterable[float], weight: float | None = None
    ) -> gtsam.NonlinearFactor:
        """Factor of the rows (r,), px, of an observation of the landmark `key`: uL, uR, v, or uL, v of one camera.

        With a `weight` in place of the kernel it is Gaussian, with this factor on its information. It does not throw
        where the point is behind the camera: residual and Jacobian then say nothing (`cheirality`).
        """
        if weight is None:
            noise = self.pixel_noise
        elif weight == 1.0:
            noise = self._gaussian_noise
        else:
            noise = gtsam.noiseModel.Diagonal.Sigmas(self._row_sigmas / math.sqrt(weight))
        pose, no_throw = pose_key(frame), (False, False)
        if self._stereo is None:
            pixel = np.array([*rows])
            return gtsam.GenericProjectionFactorCal3_S2(pixel, noise, pose, key, self._left, *no_throw, self.imu_P_cam)
        point = gtsam.StereoPoint2(*rows)
        return gtsam.GenericStereoFactor3D(point, noise, pose, key, self._stereo, *no_throw, self.imu_P_cam)

    def landmark_prior(self, landmark: int, key: int) -> gtsam.PriorFactorPoint3:
        """Prior factor of the landmark of index `landmark` in the sequence, a variable `key` of the graph."""
        prior = self.problem.landmark_prior
        assert prior is not None
        row = int(np.searchsorted(self.problem.features, landmark))
        noise = gtsam.noiseModel.Gaussian.Covariance(prior.covariance)
        return gtsam.PriorFactorPoint3(key, prior.mean[row], noise)


def under_kernel(gaussian: gtsam.noiseModel.Base, kernel: HuberKernel | None) -> gtsam.noiseModel.Base:
    """Noise model of the rows of an observation, under the problem's kernel."""
    if kernel is None:
        return gaussian
    huber = gtsam.noiseModel.mEstimator.Huber.Create(kernel.threshold)
    return gtsam.noiseModel.Robust.Create(huber, gaussian)
