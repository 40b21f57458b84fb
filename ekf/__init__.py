"""The documented filter: dead reckoning (equation 9), landmark mapping (10 to 12) and visual-inertial SLAM (13)."""

from .dead_reckoning import dead_reckoning
from .mapping import landmark_mapping
from .slam import ekf

__all__ = ["dead_reckoning", "ekf", "landmark_mapping"]
