"""Raw samples of an inertial measurement unit: gyroscope, accelerometer, noise densities and gravity."""

from dataclasses import dataclass, fields

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from .display import Displayed
from .value_range import measurable

STANDARD_GRAVITY = 9.81
"""m/s^2, where a recording does not state it"""


DENSITIES = (1e-9, 1e3)
"""smallest noise density and largest density or walk of any inertial sensor"""


@dataclass(frozen=True, slots=True)
class ImuNoise:
    """Noise of an IMU in continuous time, as EuRoC's `sensor.yaml` and Kalibr's `imu.yaml` have it.

    measured = true + bias + white noise; the biases are random walks. Raises InputError for a density out of
    `DENSITIES`, and for a walk that is negative or larger.
    """

    gyroscope_density: float
    """rad/s/sqrt(Hz)"""
    gyroscope_walk: float
    """rad/s^2/sqrt(Hz)"""
    accelerometer_density: float
    """m/s^2/sqrt(Hz)"""
    accelerometer_walk: float
    """m/s^3/sqrt(Hz)"""

    @property
    def densities(self) -> FloatArray:
        """Densities and random walks (4,), in the order of the fields."""
        return np.array([getattr(self, field.name) for field in fields(self)])

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            least, most = DENSITIES[0] if field.name.endswith("density") else 0.0, DENSITIES[1]
            if not least <= value <= most:
                raise InputError(f"imu_noise: {field.name} is {value!r}, expected a number from {least:g} to {most:g}")


ASSUMED_NOISE = ImuNoise(1e-3, 1e-5, 2e-2, 1e-3)
"""noise of a vibrating MEMS unit of medium grade, for recordings that do not state their noise"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ImuSamples(Displayed):
    """M raw samples in the IMU's frame, in the clock of the frames. Raises InputError where they cannot be used."""

    t: FloatArray
    """(M,) time stamps, s, strictly increasing"""
    angular_velocity: FloatArray
    """(M, 3) rad/s"""
    specific_force: FloatArray
    """(M, 3) m/s^2; at rest it is +gravity upward"""
    noise: ImuNoise
    gravity: float = STANDARD_GRAVITY
    """magnitude, m/s^2"""

    def __post_init__(self) -> None:
        M = len(self.t)
        if M < 2:
            raise InputError(f"imu_time_stamps: raw inertial data needs at least 2 samples, this one has {M}")
        for name, array in (
            ("angular_velocity", self.angular_velocity),
            ("linear_acceleration", self.specific_force),
        ):
            if array.shape != (M, 3):
                raise InputError(f"imu_{name}: expected 3 values for each of the {M} samples, got shape {array.shape}")
            finite = measurable(array).all(axis=1)
            if not finite.all():
                k = int(np.argmin(finite))
                raise InputError(f"imu_{name}: sample {k} is not finite: {array[k].tolist()}")
        rising = np.diff(self.t) > 0.0
        if not (np.isfinite(self.t).all() and rising.all()):
            k = int(np.argmin(rising))
            raise InputError(
                f"imu_time_stamps: stamps must rise, but sample {k + 1} ({float(self.t[k + 1])!r} s) is not after "
                f"sample {k} ({float(self.t[k])!r} s)"
            )
        if not (np.isfinite(self.gravity) and self.gravity > 0.0):
            raise InputError(f"gravity: expected a positive magnitude in m/s^2, got {self.gravity!r}")
        for array in (self.t, self.angular_velocity, self.specific_force):
            array.flags.writeable = False

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:  # constructed again, so that a copy is read-only too
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def period(self) -> float:
        """Median interval between samples, s."""
        return float(np.median(np.diff(self.t)))
