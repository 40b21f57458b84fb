"""The same problem as a factor graph, solved by GTSAM: iSAM2 (the reference), a fixed lag, and the whole as a batch."""

from .batch import batch
from .fixed_lag import FixedLagSettings, fixed_lag
from .incremental import ISAM2Settings
from .reference import isam2, isam2_online

__all__ = ["FixedLagSettings", "ISAM2Settings", "batch", "fixed_lag", "isam2", "isam2_online"]
