"""Pose covariances of other programs, converted to the right perturbation [v, w]."""

import numpy as np

from fgbaseline.geometry import FloatArray


def pose_covariances(numbers: FloatArray, world_R_body: FloatArray) -> FloatArray:
    """Covariances (n, 6, 6) of the right perturbation [v, w], m and rad, of poses with rotations (n, 3, 3).

    `numbers` are such matrices already, or (n, 36) as in ROS: row by row, position and rotation, both along the axes
    of the world; or (n, 12) as OpenVINS writes them: the upper triangles of the rotation's (in the body) and of the
    position's (in the world), without what correlates both.
    """
    if numbers.ndim == 3:
        return numbers
    n = len(numbers)
    body_R_world = np.swapaxes(world_R_body, 1, 2)
    if numbers.shape[1] == 12:
        result = np.zeros((n, 6, 6))
        result[:, 3:, 3:] = _symmetric(numbers[:, :6])
        result[:, :3, :3] = body_R_world @ _symmetric(numbers[:, 6:]) @ world_R_body
        return result
    turn = np.zeros((n, 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = body_R_world
    return np.asarray(turn @ numbers.reshape(n, 6, 6) @ np.swapaxes(turn, 1, 2))


def _symmetric(upper: FloatArray) -> FloatArray:
    """Symmetric matrices (n, 3, 3) with the upper triangles (n, 6), row by row."""
    matrix = np.empty((len(upper), 3, 3))
    for k, (i, j) in enumerate(((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))):
        matrix[:, i, j] = matrix[:, j, i] = upper[:, k]
    return matrix
