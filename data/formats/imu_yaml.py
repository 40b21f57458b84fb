"""The noise of an IMU in a YAML file: EuRoC's `sensor.yaml`, Kalibr's `imu.yaml` and its calibrated chain."""

from typing import Any, NamedTuple

import numpy as np

from fgbaseline.geometry import InputError

from ..imu import STANDARD_GRAVITY, ImuNoise
from .fields import positive
from .named_file import FilePath, reading, regular_file

KEYS = {
    "gyroscope_density": "gyroscope_noise_density",
    "gyroscope_walk": "gyroscope_random_walk",
    "accelerometer_density": "accelerometer_noise_density",
    "accelerometer_walk": "accelerometer_random_walk",
}
"""those of EuRoC and Kalibr, by the fields of `ImuNoise`"""
GRAVITY = ("gravity_magnitude", "gravity")
MOST_BYTES = 2**20


class ImuCalibration(NamedTuple):
    """Noise densities, and gravity's magnitude in m/s^2."""

    noise: ImuNoise
    gravity: float
    remarks: tuple[str, ...]


def read_imu_calibration(path: FilePath) -> ImuCalibration:
    """The noise in a YAML file, at its top level or under `imu0`. Raises InputError naming file and key."""
    with reading(path):
        tree = _tree(path)
        if not isinstance(tree, dict):
            raise InputError("it has no keys; give EuRoC's sensor.yaml of the IMU, or Kalibr's imu.yaml")
        unit = tree.get("imu0", tree)
        if not isinstance(unit, dict) or not set(KEYS.values()) & set(unit):
            raise InputError(
                f"it has none of {', '.join(KEYS.values())}; give the file of the IMU, and not that of a camera"
            )
        noise = ImuNoise(**{field: _number(unit, key) for field, key in KEYS.items()})
        found = next((key for key in GRAVITY if key in unit), None)
        gravity = STANDARD_GRAVITY if found is None else positive(found, np.array(_number(unit, found)), "m/s^2")
        return ImuCalibration(noise, gravity, tuple(_remarks(unit)))


def _tree(path: FilePath) -> Any:
    import yaml

    file = regular_file(path)
    if file.stat().st_size > MOST_BYTES:
        raise InputError("it is larger than 1 MiB, and no calibration; check the file")
    try:
        text = file.read_bytes().decode("utf-8-sig")
        # OpenCV writes %YAML:1.0, which is no directive of YAML
        return yaml.safe_load("\n".join(line for line in text.splitlines() if not line.startswith("%")))
    except (yaml.YAMLError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise InputError(f"it is no YAML ({' '.join(str(error).split())[:120]})") from error


def _number(unit: dict[str, Any], key: str) -> float:
    if key not in unit:
        raise InputError(f"{key} is missing; write the noise in continuous time, as EuRoC and Kalibr do")
    try:
        return float(unit[key])  # YAML 1.1 has 1e-3 as a text
    except (TypeError, ValueError) as error:
        raise InputError(f"{key}: expected a number, got {str(unit[key])[:60]!r}") from error


def _remarks(unit: dict[str, Any]) -> list[str]:
    """A remark where the samples are not those of the body to which the calibration refers."""
    pose = unit.get("T_BS", unit.get("T_i_b"))
    values = pose.get("data") if isinstance(pose, dict) else pose
    try:
        matrix = np.array(values, dtype=np.float64).reshape(4, 4)
    except (TypeError, ValueError):
        return []
    if np.allclose(matrix, np.eye(4), atol=1e-9):
        return []
    return ["Its pose in the body is not the identity and is not applied: imu_T_cam has to be that of the IMU itself."]
