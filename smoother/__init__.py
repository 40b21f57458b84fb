"""The reference: the same problem as a factor graph, solved by GTSAM's iSAM2."""

from .reference import isam2, isam2_online

__all__ = ["isam2", "isam2_online"]
