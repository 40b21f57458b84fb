"""The arrays of a small recording of the course's later form, for tests of readers and for `make fuzz`."""

from typing import Any

import numpy as np


def course_arrays(*, truth: bool = False) -> dict[str, Any]:
    """6 frames, 5 landmarks, 7 observations; with `truth` also the poses, the landmarks and the up vector."""
    random = np.random.default_rng(2)
    features = np.full((4, 5, 6), -1.0)
    for landmark, frame in ((0, 0), (0, 1), (1, 1), (2, 3), (4, 3), (4, 4), (4, 5)):
        features[:, landmark, frame] = random.uniform(0.0, 600.0, 4)
    arrays = {
        "time_stamps": 1.3e9 + 0.1 * np.arange(6)[None, :],
        "linear_velocity": random.normal(size=(3, 6)),
        "angular_velocity": random.normal(size=(3, 6)),
        "K": np.array([[500.0, 0.0, 320.0], [0.0, 510.0, 240.0], [0.0, 0.0, 1.0]]),
        "b": np.array(0.5),
        "imu_T_cam": np.array([[0.0, 0, 1, 1.5], [1, 0, 0, 0.2], [0, 1, 0, -0.6], [0, 0, 0, 1]]),
        "features": features,
    }
    if truth:
        arrays |= {
            "ground_truth": np.tile(np.eye(4), (6, 1, 1)),
            "landmarks": random.normal(size=(3, 5)),
            "up_imu": np.array([0.0, 0.0, 1.0]),
        }
    return arrays
