"""GTSAM factors of raw inertial data: preintegrated samples between frames, and the initial state.

The preintegration is GTSAM's on the Galilean group (`PreintegratedCombinedMeasurementsG`): it is exact for pieces of
constant angular velocity and specific force, as `geometry.strapdown` is, and has the same covariance. GTSAM's default
`PreintegratedCombinedMeasurements` keeps the attitude constant over a piece. That tilts the specific force by half of
the piece's rotation: 0.02 m/s^2 at 0.5 rad/s and 100 Hz.
"""

import gtsam
import numpy as np

from fgbaseline.data.problem.inertial import LEAST_WALK, ImuIntervals, InertialStart
from fgbaseline.geometry import FloatArray, se3, strapdown

from .frame_states import FrameStates
from .gtsam_conversions import STATE_ORDER, bias_from_gtsam, bias_to_gtsam, reorder_tangent
from .keys import state_keys

INTEGRATION_VARIANCE = 1e-20
"""m^2/s, density of GTSAM's integration noise of the position, in place of zero: the integration is exact"""
FIXED_SIGMA = 1e-6
"""m/s, rad/s and m/s^2: sigma that replaces zero for a velocity or bias of known value"""
FIXED_POSE_FACTOR = 10.0
"""factor on `FactorBuilder.fixed_pose_sigmas`: the sigmas that replace zero for a fixed pose, with inertial data.
Velocity and biases of frame 0 are determined relative to that pose. Cholesky loses digits by the square of such a
sigma, which must therefore not be too small."""


class InertialFactors:
    """Builds the factors of the samples and the initial state of a problem."""

    def __init__(
        self, imu: ImuIntervals, start: InertialStart, initial_pose: FloatArray, fixed_pose_sigmas: FloatArray
    ) -> None:
        """`fixed_pose_sigmas` (6,) replace zero for a fixed pose: rotation (rad), translation (m), GTSAM's order."""
        self._imu, self.start, self._initial_pose = imu, start, initial_pose
        self._fixed_sigmas = np.concatenate([FIXED_POSE_FACTOR * fixed_pose_sigmas, np.full(9, FIXED_SIGMA)])
        self._params: dict[bytes, gtsam.PreintegrationCombinedParams] = {}

    def preintegrated(self, k: int, bias: FloatArray) -> gtsam.PreintegratedCombinedMeasurementsG:
        """Preintegrated samples from frame k to k + 1 at biases (6,): gyroscope rad/s, then accelerometer m/s^2."""
        at = self._imu.pieces(k)
        result = gtsam.PreintegratedCombinedMeasurementsG(self._params_of(k), bias_to_gtsam(bias))
        pieces = zip(
            self._imu.specific_force[at], self._imu.angular_velocity[at], self._imu.dt[at].tolist(), strict=True
        )
        for force, rate, dt in pieces:
            result.integrateMeasurement(force, rate, dt)
        return result

    def _params_of(self, k: int) -> gtsam.PreintegrationCombinedParams:
        """GTSAM's preintegration parameters (gravity, noise) of interval k, cached by its few different densities."""
        densities = self._imu.densities[k]
        key = densities.tobytes()
        if key not in self._params:
            gyroscope, gyroscope_walk, accelerometer, accelerometer_walk = densities.tolist()
            params = gtsam.PreintegrationCombinedParams(self._imu.gravity_vector)
            params.setIntegrationCovariance(INTEGRATION_VARIANCE * np.eye(3))
            params.setGyroscopeCovariance(gyroscope**2 * np.eye(3))
            params.setAccelerometerCovariance(accelerometer**2 * np.eye(3))
            params.setBiasOmegaCovariance(max(gyroscope_walk, LEAST_WALK * gyroscope) ** 2 * np.eye(3))
            params.setBiasAccCovariance(max(accelerometer_walk, LEAST_WALK * accelerometer) ** 2 * np.eye(3))
            self._params[key] = params
        return self._params[key]

    def motion(self, k: int, samples: gtsam.PreintegratedCombinedMeasurementsG) -> gtsam.GalileanCombinedImuFactor:
        """Factor of the preintegrated samples from frame k to k + 1."""
        (x, v, b), (next_x, next_v, next_b) = state_keys(k, True), state_keys(k + 1, True)
        return gtsam.GalileanCombinedImuFactor(x, v, next_x, next_v, b, next_b, samples)

    def start_prior(self) -> gtsam.CustomFactor:
        """Prior of the state of frame 0, correlations included."""
        start = self.start
        return self.state_prior(0, self._initial_pose, start.velocity, start.bias, start.covariance)

    def fixed_pose(self, k: int, states: FrameStates) -> gtsam.CustomFactor:
        """Prior of the state of frame k with its pose fixed."""
        covariance = np.zeros((strapdown.STATE, strapdown.STATE))
        covariance[6:, 6:] = states.given_pose(k)
        return self.state_prior(k, states.world_T_imu[k], states.velocity[k], states.bias[k], covariance)

    def state_prior(
        self, k: int, pose: FloatArray, velocity: FloatArray, bias: FloatArray, covariance: FloatArray
    ) -> gtsam.CustomFactor:
        """Prior of the state of frame k: pose (4, 4), velocity (3,) in world axes, m/s, biases (6,), rad/s and m/s^2.

        `covariance` (15, 15) is that of [translation, rotation, velocity, gyroscope bias, accelerometer bias], the pose
        by its right perturbation. This is a CustomFactor because GTSAM has no joint prior of pose, velocity and bias.
        A LinearContainerFactor keeps the Jacobian of its linearization point, which is wrong once roll and pitch of the
        initial state are corrected.
        """
        matrix = reorder_tangent(covariance) + np.diag(self._fixed_sigmas**2)
        noise = gtsam.noiseModel.Gaussian.Covariance(matrix)
        pose_T_world, keys = se3.inverse(pose), state_keys(k, True)

        def error(_: gtsam.CustomFactor, values: gtsam.Values, jacobians: gtsam.JacobianVector | None) -> FloatArray:
            x, v, b = keys
            twist = se3.log(pose_T_world @ values.atPose3(x).matrix())
            if jacobians is not None:
                slope = np.eye(strapdown.STATE, order="F")
                slope[:6, :6] = reorder_tangent(se3.inverse_right_jacobian(twist))
                jacobians[0], jacobians[1], jacobians[2] = slope[:, :6], slope[:, 6:9], slope[:, 9:]
            bias_error = bias_from_gtsam(values.atConstantBias(b)) - bias
            return np.concatenate([twist, values.atPoint3(v) - velocity, bias_error])[STATE_ORDER]

        return gtsam.CustomFactor(noise, keys, error)
