"""Settings of iSAM2, for the whole graph and for the fixed-lag window."""

from dataclasses import dataclass, field, replace

import gtsam
import numpy as np

from fgbaseline.data.problem import Problem

from ..graph.keys import thresholds
from ..initialization.landmark_initialization import InitializationCriterion

WILDFIRE_THRESHOLD = 1e-5
"""Changes below it (rad, and m for baselines from half a meter on) are not propagated through the Bayes tree. The
default of GTSAM, 1e-3, leaves an error of 0.1 mm in the online estimate and saves no time."""


PARALLAX_SUFFICES = 0.2
"""largest deviation of a landmark over its distance, with one camera: a parallax of five of its own sigmas. Depth is
the inverse of parallax: the second-order term, which a linearized graph loses, is this share of the sigma."""
ONE_CAMERA_SKIP = 1
"""updates from one relinearization to the next, with one camera: initial depths, and with them the path, are far off"""


@dataclass(frozen=True, slots=True)
class ISAM2Settings:
    """Settings of iSAM2; only `initialization` changes the optimum of the graph."""

    relinearize_position: float = 0.04
    """threshold of a pose's translation, in baselines: points move in the image by at most this share of disparity"""
    relinearize_rotation: float = 0.002
    """threshold of a pose's rotation, rad"""
    relinearize_velocity: float = 0.2
    """threshold of a velocity, m/s. With raw inertial data the factors are close to linear in velocities and biases. A
    change of one bias changes all of them, so that narrow thresholds relinearize the whole chain at every update."""
    relinearize_gyroscope_bias: float = 0.01
    """threshold of a gyroscope bias, rad/s"""
    relinearize_accelerometer_bias: float = 0.2
    """threshold of an accelerometer bias, m/s^2"""
    relinearize_landmark: float = 0.002
    """threshold of a landmark, as a share of its distance"""
    relinearize_skip: int = 3
    """updates from one relinearization to the next; the fixed-lag smoother relinearizes at each"""
    relinearize_all_skip: int = 3
    """updates from one relinearization of the whole tree to the next; between them only recent variables are
    relinearized"""
    recent_frames: int = 10
    """frames since its last observation up to which a variable is recent"""
    weights_at_estimate: bool = False
    """whether kernel weights in the tree are from residuals at the estimate (`kernel_weights`), or by GTSAM"""
    initialization: InitializationCriterion = field(default_factory=InitializationCriterion)
    relinearize_at_end: bool = True
    """whether Gauss-Newton steps over the whole graph follow the last frame"""
    qr: bool = False
    """whether QR replaces Cholesky: three times slower, and robust to pivots of very unequal size"""
    tree_frames: int = 600
    """number of frames in the tree at which the older ones are marginalized into a linear prior"""
    kept_frames: int = 200
    """number of last frames that are kept; so are all earlier frames that continuing tracks begin in"""

    def params(self, baseline: float) -> gtsam.ISAM2Params:
        """GTSAM parameters for a rig with this baseline (m)."""
        params = gtsam.ISAM2Params()
        params.setRelinearizeThreshold(
            thresholds(
                np.repeat([self.relinearize_rotation, self.relinearize_position], 3),
                np.full(3, self.relinearize_velocity),
                np.repeat([self.relinearize_accelerometer_bias, self.relinearize_gyroscope_bias], 3),
                self.relinearize_landmark,
                baseline,
            )
        )
        params.enableRelinearization = False  # only at updates that force it
        params.setOptimizationParams(gtsam.ISAM2GaussNewtonParams(WILDFIRE_THRESHOLD * min(2.0 * baseline, 1.0)))
        params.setFactorization("QR" if self.qr else "CHOLESKY")
        return params

    @classmethod
    def of(cls, problem: Problem) -> "ISAM2Settings":
        """Default settings for a problem.

        With raw inertial data every frame changes earlier poses by more than the thresholds, so that each update would
        relinearize the whole tree. The tree is therefore shorter, and relinearized less often.
        """
        if problem.imu is None:
            return cls()
        inertial = cls(
            relinearize_skip=5, relinearize_all_skip=20, tree_frames=100, kept_frames=40, weights_at_estimate=True
        )
        if not problem.sequence.monocular:
            return inertial
        parallax = InitializationCriterion(max_relative_deviation=PARALLAX_SUFFICES)
        skip = ONE_CAMERA_SKIP
        return replace(inertial, relinearize_skip=skip, relinearize_all_skip=skip, initialization=parallax)
