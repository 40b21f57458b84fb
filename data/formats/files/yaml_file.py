"""YAML files of calibrations: keys, OpenCV's matrices and poses."""

from typing import Any

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from .field_checks import extrinsic
from .file_errors import FilePath, regular_file

MOST_BYTES = 2**20
FEW_DIGITS = 1e-3
"""largest deviation from a rotation that the digits of a file explain"""


def read_yaml(path: FilePath) -> dict[str, Any]:
    """The keys of a YAML file, with OpenCV's matrices as arrays. Raises InputError (without the name: `reading`)."""
    import yaml

    class Loader(yaml.SafeLoader):  # type: ignore[misc]
        pass

    def matrix(loader: Any, node: Any) -> Any:
        values = loader.construct_mapping(node, deep=True)
        return np.array(values["data"], dtype=np.float64).reshape(int(values["rows"]), int(values["cols"]))

    Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", matrix)
    file = regular_file(path)
    if file.stat().st_size > MOST_BYTES:
        raise InputError("it is larger than 1 MiB, and no calibration; check the file")
    try:
        text = file.read_bytes().decode("utf-8-sig")
        # OpenCV writes %YAML:1.0, which is no directive of YAML
        tree = yaml.load("\n".join(line for line in text.splitlines() if not line.startswith("%")), Loader)
    except (yaml.YAMLError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"it is not YAML ({' '.join(str(error).split())[:120]})") from error
    if not isinstance(tree, dict):
        raise InputError("it has no keys; give the calibration of cameras or IMU, in the form of EuRoC or Kalibr")
    return tree


def pose(value: Any, key: str) -> FloatArray:
    """Pose (4, 4) in a YAML file: nested lists, or EuRoC's `data`. Raises InputError naming the key."""
    values = value.get("data") if isinstance(value, dict) else value
    try:
        matrix = np.array(values, dtype=np.float64).reshape(4, 4)
    except (TypeError, ValueError):
        raise InputError(f"{key}: expected a 4x4 matrix, got {str(values)[:60]}") from None
    R = matrix[:3, :3]
    if np.isfinite(matrix).all() and np.linalg.det(R) > 0.0 and np.abs(R @ R.T - np.eye(3)).max() < FEW_DIGITS:
        R = so3.nearest_rotations(R[None])[0]
    return extrinsic(key, R, matrix[:3, 3])
