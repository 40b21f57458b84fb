"""The filters: dead reckoning, landmark mapping, the documented decoupled EKF, and EKF-SLAM with one joint state."""

from .dead_reckoning import dead_reckoning
from .decoupled_ekf import ekf
from .joint.estimators import joint_ekf, joint_ekf_bias, joint_ekf_first_estimate, joint_ekf_textbook, joint_ekf_ungated
from .joint.gyro_bias import GyroBiasPrior
from .joint.landmark_representation import LandmarkRepresentation
from .joint.settings import JointSettings, Linearization
from .landmark_mapping import landmark_mapping

__all__ = [
    "GyroBiasPrior",
    "JointSettings",
    "LandmarkRepresentation",
    "Linearization",
    "dead_reckoning",
    "ekf",
    "joint_ekf",
    "joint_ekf_bias",
    "joint_ekf_first_estimate",
    "joint_ekf_textbook",
    "joint_ekf_ungated",
    "landmark_mapping",
]
