"""Files, keys and columns of an exported problem; docs/export.md describes them."""

from typing import Final

SCHEMA: Final = "fgbaseline/problem/1"
"""incremented when a key or column is renamed, removed or changes its meaning"""
ARRAYS = "problem.npz"
SCALARS = "problem.json"
FRAMES, INCREMENTS, OBSERVATIONS, LANDMARKS = "frames.csv", "increments.csv", "observations.csv", "landmarks.csv"
SAMPLES = "imu.csv"
"""file of a problem with raw inertial data, which has no increments"""

TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
FRAME_COLUMNS = ("frame", "t", *TWIST)
COVARIANCE_COLUMNS = tuple(f"c{i}{j}" for i in range(6) for j in range(6))
INCREMENT_COLUMNS = ("frame", "dt", *TWIST, *COVARIANCE_COLUMNS)
SAMPLE_COLUMNS = ("t", "wx", "wy", "wz", "ax", "ay", "az")
OBSERVATION_COLUMNS = ("frame", "landmark", "uL", "vL", "uR", "vR", "excluded")
LANDMARK_COLUMNS = ("id", "observations", "prior_x", "prior_y", "prior_z")
