"""Fault of a recording, as reported by the reader or the diagnosis."""

from dataclasses import dataclass

UNITS = frozenset(
    {
        "time_unit",
        "imu_time_unit",
        "angular_velocity_unit",
        "linear_velocity_unit",
        "baseline_unit",
        "extrinsic_unit",
    }
)
"""codes of values in units other than SI"""
OF_THE_FILE = frozenset(
    {
        "repeated_stamps",
        "stamps_rounded",
        "zero_for_unobserved",
        "doubled_samples",
        "frames_without_samples",
        "extrinsic_inverse",
        "intrinsics",
        *UNITS,
    }
)
"""codes of faults of the file, which a run prints with every preset"""

AS_GIVEN = "as given"
"""`Finding.certainty` of a repair that the user specified"""


MEASURES = {
    "rad/s": "median difference of the angular velocity from visual odometry",
    "m/s": "median difference of the linear velocity from visual odometry",
    "m/s^2": "acceleration",
    "rad/s/sqrt(Hz)": "noise density of the gyroscope",
    "m/s^2/sqrt(Hz)": "noise density of the accelerometer",
    "°": "misalignment",
    "px": "disparity offset",
    "s": "time offset",
}
"""physical unit -> quantity of a finding; other units are quantities themselves (`observations`)"""


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault of a recording."""

    code: str
    """identifier for programs, such as `gyro_bias`"""
    sentence: str
    """description with values"""
    before: float
    """a measure of the fault without this repair, in `unit`"""
    after: float
    """the measure with it, after masking; equal to `before` if the fault is not repaired"""
    unit: str
    certainty: str
    """a standard error, a log-likelihood ratio, or 'counted'"""

    @property
    def measure(self) -> str:
        """Quantity of `before` and `after`."""
        return MEASURES.get(self.unit, self.unit)
