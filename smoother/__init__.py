"""The reference: the same problem as a factor graph, solved by GTSAM's iSAM2."""

from .isam2 import isam2, isam2_online

__all__ = ["isam2", "isam2_online"]
