"""Settings of iSAM2, for the whole graph and for the fixed-lag window."""

from dataclasses import dataclass, field

import gtsam

from ..graph.keys import thresholds
from ..initialization.landmark_initialization import InitializationCriterion

WILDFIRE_THRESHOLD = 1e-5
"""rad, and m for a baseline of half a metre or more: smaller changes of a solution are not carried on through the tree.
GTSAM has one threshold for both, by default 1e-3: that leaves 0.1 mm in what is known online, and gains no time"""


@dataclass(frozen=True, slots=True)
class ISAM2Settings:
    """How the graph is solved; only `initialization` moves its optimum."""

    relinearize_position: float = 0.04
    """baselines of the rig, of a pose: what is seen moves by no more than this share of its disparity"""
    relinearize_rotation: float = 0.002
    """rad, of a pose"""
    relinearize_landmark: float = 0.002
    """as a share of its distance"""
    relinearize_skip: int = 3
    """updates from one that relinearizes what is beyond its threshold to the next; a fixed-lag smoother does at each"""
    initialization: InitializationCriterion = field(default_factory=InitializationCriterion)
    relinearize_at_end: bool = True
    """Gauss-Newton over the whole graph after the last frame; without it the answer is what the increments led to"""
    qr: bool = False
    """QR in place of Cholesky: three times slower, and at ease with pivots of very unequal size"""
    tree_frames: int = 600
    """frames that the tree may be over before those behind the last `kept_frames` leave it for a prior; those before
    them, as far back as a track reaches that is alive, stay"""
    kept_frames: int = 200

    def params(self, baseline: float) -> gtsam.ISAM2Params:
        """The same in GTSAM's terms, for a rig with this baseline (m)."""
        params = gtsam.ISAM2Params()
        params.setRelinearizeThreshold(
            thresholds(self.relinearize_position, self.relinearize_rotation, self.relinearize_landmark, baseline)
        )
        params.relinearizeSkip = self.relinearize_skip
        params.setOptimizationParams(gtsam.ISAM2GaussNewtonParams(WILDFIRE_THRESHOLD * min(2.0 * baseline, 1.0)))
        params.setFactorization("QR" if self.qr else "CHOLESKY")
        return params
