"""Prediction of a new frame's state from the one before: by the increment, or by the raw inertial samples."""

from typing import NamedTuple

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray

from ..graph.factors import FactorBuilder
from ..graph.frame_states import FrameStates
from ..graph.gtsam_conversions import bias_to_gtsam, reorder_tangent
from ..graph.inertial_factors import InertialFactors


class Prediction(NamedTuple):
    """State of a frame as the motion predicts it."""

    pose: FloatArray
    """(4, 4) world_T_imu"""
    covariance: FloatArray
    """(6, 6) of its right perturbation [v, w], with the pose before fixed"""
    factor: gtsam.NonlinearFactor
    """factor of the motion"""


def predict_state(factors: FactorBuilder, states: FrameStates, k: int) -> Prediction:
    """Predict frame k >= 1; velocity and biases are set in `states`, where frame k - 1 is known."""
    if factors.inertial is not None:
        return _inertial(factors.inertial, states, k)
    pose = states.world_T_imu[k - 1] @ factors.steps[k - 1]
    return Prediction(pose, factors.problem.increment_covariance[k - 1], factors.between(k - 1))


def _inertial(factors: InertialFactors, states: FrameStates, k: int) -> Prediction:
    """Prediction by GTSAM; its covariance is to first order in the length of the interval."""
    samples = factors.preintegrated(k - 1, states.bias[k - 1])
    before = gtsam.NavState(gtsam.Pose3(states.world_T_imu[k - 1]), states.velocity[k - 1])
    after = samples.predict(before, bias_to_gtsam(states.bias[k - 1]))
    states.velocity[k], states.bias[k] = after.velocity(), states.bias[k - 1]
    pose, dt = after.pose().matrix(), samples.deltaTij()
    by_state = np.zeros((6, 9))  # of velocity, gyroscope bias, accelerometer bias
    by_state[:3, :3] = dt * pose[:3, :3].T
    by_state[3:, 3:6] = -dt * np.eye(3)
    by_state[:3, 6:] = -0.5 * dt**2 * np.eye(3)
    noise = reorder_tangent(samples.residualCovariance())[:6, :6]
    covariance = noise + by_state @ states.given_pose(k - 1) @ by_state.T
    return Prediction(pose, covariance, factors.motion(k - 1, samples))
