"""Changes of acceleration as cameras and accelerometer show them.

The mean specific force of a window, turned to the world, is the acceleration less gravity. Gravity is constant in the
world: changes from one window to the next are without it, as are those of the acceleration that the cameras see.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, so3

from ..odometry.stereo_odometry import Odometry
from .units import mean_forces

WINDOW = 0.3
"""s, over which accelerations are averaged"""
MIN_WINDOWS = 12
FARTHEST = 30.0
"""m/s^2, changes beyond which are wrong motions of the cameras"""
MIN_CORRELATION = 0.5
"""correlation from which on both show the same changes"""


class AccelerationChanges(NamedTuple):
    """Changes over n pairs of neighboring windows, m/s^2, in the axes of frame 0."""

    by_cameras: FloatArray
    """(n, 3) of the acceleration"""
    by_samples: FloatArray
    """(n, 3, 3, 3) of the product of attitude [i, j] and recorded specific force [l], at [n, i, j, l]"""

    def of_force(self, matrix: FloatArray) -> FloatArray:
        """Changes (n, 3) of the specific force if `matrix` (3, 3) rotates recorded axes to those of imu_T_cam."""
        return np.asarray(np.einsum("nijl,jl->ni", self.by_samples, matrix))

    def correlation(self, matrix: FloatArray) -> float:
        """Correlation of the changes with this `matrix`; -1 where one of both has none."""
        x, y = self.by_cameras, self.of_force(matrix)
        size = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
        return float(np.sum(x * y) / size) if size > 0.0 else -1.0


def acceleration_changes(sequence: Sequence, seen: Odometry, scale: float = 1.0) -> AccelerationChanges | None:
    """Changes over all windows that the cameras see as a whole; None with too few of them.

    Translations of the odometry are multiplied by `scale`.
    """
    dt, known = sequence.dt, seen.known
    w = max(1, round(WINDOW / float(np.median(dt))))
    if len(dt) <= 2 * w + 1:
        return None
    step = np.where(known[:, None, None], seen.motion[:, :3, :3], np.eye(3))
    R = np.tile(np.eye(3), (len(dt), 1, 1))
    for k in range(len(dt) - 1):
        R[k + 1] = R[k] @ step[k]
    middle = R @ so3.exp_so3(0.5 * so3.log_so3(step))
    velocity = np.where(known[:, None], scale * seen.motion[:, :3, 3] / dt[:, None], 0.0)
    velocity = (middle @ velocity[:, :, None])[:, :, 0]
    force = middle[:, :, :, None] * mean_forces(sequence)[:, None, None, :]
    time = 0.5 * (sequence.t[1:] + sequence.t[:-1])
    acceleration = (velocity[w:] - velocity[:-w]) / (time[w:] - time[:-w])[:, None]
    total = np.concatenate([np.zeros((1, 3, 3, 3)), np.cumsum(force, axis=0)])
    mean = (total[w + 1 :] - total[: -w - 1]) / (w + 1)
    missing = np.concatenate([[0], np.cumsum(~known)])
    whole = missing[2 * w + 1 :] == missing[: -2 * w - 1]
    by_cameras, by_samples = acceleration[w:] - acceleration[:-w], mean[w:] - mean[:-w]
    use = whole & (np.abs(by_cameras).max(axis=1) < FARTHEST)
    return AccelerationChanges(by_cameras[use], by_samples[use]) if int(use.sum()) >= MIN_WINDOWS else None
