"""The filters: dead reckoning (equation 9), landmark mapping (10 to 12), the documented SLAM (13) and the joint one."""

from .dead_reckoning import dead_reckoning
from .gyro_bias import GyroBiasPrior
from .joint import joint_ekf
from .joint_settings import JointSettings, Linearisation
from .joint_variants import joint_ekf_bias, joint_ekf_first_estimate, joint_ekf_textbook, joint_ekf_ungated
from .landmark_chart import Coordinates
from .mapping import landmark_mapping
from .slam import ekf

__all__ = [
    "Coordinates",
    "GyroBiasPrior",
    "JointSettings",
    "Linearisation",
    "dead_reckoning",
    "ekf",
    "joint_ekf",
    "joint_ekf_bias",
    "joint_ekf_first_estimate",
    "joint_ekf_textbook",
    "joint_ekf_ungated",
    "landmark_mapping",
]
