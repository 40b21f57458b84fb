"""Kernel weights of the observations in an iSAM2 tree, from residuals at the estimate.

A robust factor of GTSAM has the weight of its residual at the linearization point. Where a pose has been relinearized
and a landmark that it observes has not, this residual may be larger than that at the estimate by several sigmas. The
weight is then too small, and so is the information: by a few percent with raw inertial data, where the tree
relinearizes seldom (docs/mathematics/graph.md). With `ISAM2Settings.weights_at_estimate`, observations in the tree are
therefore Gaussian factors with their kernel weights. An update that relinearizes first renews the weights of the
observations in the last `ISAM2Settings.recent_frames` frames.
"""

from collections.abc import Mapping

import gtsam
import numpy as np

from fgbaseline.data.observations import IntArray

from ..graph.keys import pose_key
from ..graph_builder import GraphBuilder

WEIGHT_TOLERANCE = 0.05
"""change of a kernel weight up to which a factor keeps its weight"""


def changed_weights(
    builder: GraphBuilder, tree: gtsam.ISAM2, key: Mapping[int, int], observed: IntArray
) -> dict[int, float]:
    """Kernel weights of the observations `observed` (n,) at the estimate of the tree, where they differ from
    `builder.weight`, by observation.

    `key` maps a landmark to its key in the tree, which must have their landmarks and frames.
    """
    o = builder.observations.select(observed)
    frames, at_frame = np.unique(o.frame, return_inverse=True)
    landmarks, at_landmark = np.unique(o.landmark, return_inverse=True)
    poses = np.array([tree.calculateEstimatePose3(pose_key(k)).matrix() for k in frames.tolist()]).reshape(-1, 4, 4)
    points = np.array([tree.calculateEstimatePoint3(key[j]) for j in landmarks.tolist()]).reshape(-1, 3)
    world_T_cam = poses @ builder.problem.sequence.imu_T_cam
    weight = builder.problem.measurement.weight_at(world_T_cam[at_frame], points[at_landmark], o.pixel)
    changed = np.abs(weight - builder.weight[observed]) > WEIGHT_TOLERANCE
    return dict(zip(observed[changed].tolist(), weight[changed].tolist(), strict=True))
