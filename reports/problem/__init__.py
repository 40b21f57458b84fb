"""The problem that a recording poses by the settings of a run; default estimators."""

DEFAULT_ESTIMATORS = ("dead-reckoning", "ekf", "isam2", "isam2-online")
ONE_CAMERA_ESTIMATORS = ("dead-reckoning", "joint-ekf", "isam2", "isam2-online")
"""default estimators with one camera; `ekf` is none of them, as it initializes landmarks by disparity"""
BATCH_OBSERVATIONS = 65_000
"""observations of a problem up to which `batch` is a default too: its descent from the solution of isam2 takes less
than a fifth of the time of isam2 (0.15 to 0.18 on the KITTI drives of 9,500 and 42,500)"""


def names_in(text: str | None) -> tuple[str, ...]:
    """Names in a text, separated by commas; blanks around names and empty names are removed."""
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())
