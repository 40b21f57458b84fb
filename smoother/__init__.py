"""The same problem as a factor graph, solved by GTSAM: iSAM2, the reference, and batch Levenberg-Marquardt."""

from .batch import batch
from .reference import isam2, isam2_online

__all__ = ["batch", "isam2", "isam2_online"]
