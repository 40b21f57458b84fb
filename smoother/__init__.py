"""Factor-graph smoothers on GTSAM: iSAM2 (the reference), a fixed-lag smoother and batch Levenberg-Marquardt."""

from .batch.estimator import batch
from .fixed_lag.estimator import FixedLagSettings, fixed_lag
from .isam2.estimator import isam2, isam2_online
from .isam2.settings import ISAM2Settings

__all__ = ["FixedLagSettings", "ISAM2Settings", "batch", "fixed_lag", "isam2", "isam2_online"]
