"""The noise of an IMU in a YAML file: EuRoC's `sensor.yaml`, Kalibr's `imu.yaml` and its calibrated chain."""

from typing import Any, NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3

from ...imu import ASSUMED_NOISE, STANDARD_GRAVITY, ImuNoise
from ..files.field_checks import positive
from ..files.file_errors import FilePath, reading
from ..files.yaml_file import pose, read_yaml
from .imu_arrays import assumed_noise

KEYS = {
    "gyroscope_density": "gyroscope_noise_density",
    "gyroscope_walk": "gyroscope_random_walk",
    "accelerometer_density": "accelerometer_noise_density",
    "accelerometer_walk": "accelerometer_random_walk",
}
"""keys of EuRoC and Kalibr by the fields of `ImuNoise`"""
GRAVITY = ("gravity_magnitude", "gravity")
NOT_APPLIED = "Its pose in the body is not the identity and is not applied: imu_T_cam has to be that of the IMU itself."


class ImuCalibration(NamedTuple):
    """Noise densities, gravity's magnitude in m/s^2 and, where it is not the body, the IMU's pose in the body."""

    noise: ImuNoise
    gravity: float
    body_T_imu: FloatArray | None = None
    """(4, 4)"""
    assumed: str = ""
    """remark where the noise is not that of the unit"""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks for samples whose pose in the body is not applied."""
        turned = () if self.body_T_imu is None else (NOT_APPLIED,)
        return (self.assumed, *turned) if self.assumed else turned


NO_CALIBRATION = "no imu-calibration is given"


def assumed_calibration(why: str) -> ImuCalibration:
    """Stands in for a calibration that is missing."""
    return ImuCalibration(ASSUMED_NOISE, STANDARD_GRAVITY, assumed=assumed_noise(why))


def calibration_or_assumed(path: FilePath | None, why: str) -> ImuCalibration:
    """Calibration from a YAML file, or without one the assumed calibration. Raises as `read_imu_calibration`."""
    return assumed_calibration(why) if path is None else read_imu_calibration(path)


def read_imu_calibration(path: FilePath) -> ImuCalibration:
    """The noise in a YAML file, at its top level or under `imu0`. Raises InputError naming file and key."""
    with reading(path):
        tree = read_yaml(path)
        unit = tree.get("imu0", tree)
        if not isinstance(unit, dict) or not set(KEYS.values()) & set(unit):
            raise InputError(
                f"it has none of {', '.join(KEYS.values())}; give the file of the IMU, and not that of a camera"
            )
        noise = ImuNoise(**{field: _number(unit, key) for field, key in KEYS.items()})
        found = next((key for key in GRAVITY if key in unit), None)
        gravity = STANDARD_GRAVITY if found is None else positive(found, np.array(_number(unit, found)), "m/s^2")
        return ImuCalibration(noise, gravity, _pose(unit))


def _pose(unit: dict[str, Any]) -> FloatArray | None:
    """EuRoC's T_BS, or the inverse of Kalibr's T_i_b; None where it is absent or the identity."""
    key = next((key for key in ("T_BS", "T_i_b") if unit.get(key) is not None), None)
    if key is None:
        return None
    found = pose(unit[key], key)
    if np.allclose(found, np.eye(4), atol=1e-9):
        return None
    return found if key == "T_BS" else se3.inverse(found)


def _number(unit: dict[str, Any], key: str) -> float:
    if key not in unit:
        raise InputError(f"{key} is missing; write the noise in continuous time, as EuRoC and Kalibr do")
    try:
        return float(unit[key])  # YAML 1.1 has 1e-3 as a text
    except (TypeError, ValueError) as error:
        raise InputError(f"{key}: expected a number, got {str(unit[key])[:60]!r}") from error
