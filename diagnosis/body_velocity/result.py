"""The result of a diagnosis: estimated faults and noise of a recording."""

from dataclasses import dataclass, field

import numpy as np

from fgbaseline.data.axis_conventions import IDENTITY
from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.problem import NoiseSettings
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.geometry import FloatArray

from ..conventions.axes import Axes
from ..conventions.units import Units
from ..conventions.velocity_time_offset import VelocityTimeOffset
from ..noise.calibration_fit import CalibrationFit
from ..odometry.stereo_odometry import Odometry
from ..window_adjustment.residuals import MISALIGNMENT, OFFSET
from .velocity_outliers import VelocityOutliers


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Diagnosis(Displayed):
    """Estimated faults and noise of a recording; `findings_of` reports them in sentences."""

    sequence: Sequence
    failure_reason: str = ""
    """reason for which nothing could be estimated, in a sentence; empty otherwise"""
    odometry: Odometry | None = None
    angular: Axes = field(default_factory=lambda: Axes(IDENTITY, (False,) * 3, 0.0, np.nan, np.nan))
    linear: Axes = field(default_factory=lambda: Axes(IDENTITY, (False,) * 3, 0.0, np.nan, np.nan))
    timing: VelocityTimeOffset = field(default_factory=lambda: VelocityTimeOffset(0.0, np.inf, identifiable=False))
    shift: float = Shift.AFTER
    """intervals, time offset of the velocities that the calibrated problem uses"""
    fit: CalibrationFit | None = None
    repeated: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    """(T-1,) intervals whose tracks are copies"""
    overrides: frozenset[str] = frozenset()
    """names of user-specified `Repairs`: applied as they are, however small or uncertain"""
    units: Units = field(default_factory=Units)
    """factors by which the recorded values were multiplied"""
    recorded: Sequence | None = None
    """sequence as recorded; `sequence` has SI units, the extrinsic in the right direction, and velocities without
    outliers"""
    outliers: VelocityOutliers | None = None
    """velocity samples that are replaced in `sequence`; None without any"""
    inversion: tuple[float, float] | None = None
    """rad/s, median error of the rates before and after inverting imu_T_cam; None where it is not inverted"""

    @property
    def inverted(self) -> bool:
        """Whether imu_T_cam was recorded as its inverse."""
        return self.inversion is not None

    @property
    def gyro_bias(self) -> FloatArray:
        """Gyroscope bias (3,), rad/s in recorded axes: the reading at rest."""
        return np.zeros(3) if self.fit is None else self.angular.matrix.T @ self.fit.calibration[:3]

    @property
    def gyro_bias_deviation(self) -> FloatArray:
        """Standard errors (3,) of `gyro_bias`, rad/s in recorded axes."""
        return np.full(3, np.inf) if self.fit is None else np.abs(self.angular.matrix.T) @ self.fit.deviation[:3]

    @property
    def velocity_scale(self) -> tuple[float, float]:
        """Ratio of the recorded linear velocity to that of the odometry, and its standard error."""
        if self.fit is None:
            return 1.0, np.inf
        return 1.0 + float(self.fit.calibration[3]), float(self.fit.deviation[3])

    @property
    def misalignment(self) -> tuple[FloatArray, FloatArray]:
        """Rotation vector (3,) of the error of imu_T_cam, rad in IMU axes, and its standard errors (3,)."""
        if self.fit is None:
            return np.zeros(3), np.full(3, np.inf)
        return self.fit.calibration[MISALIGNMENT], self.fit.deviation[MISALIGNMENT]

    @property
    def disparity_offset(self) -> tuple[float, float]:
        """Amount in px by which every recorded disparity is too small, and its standard error."""
        return (
            (0.0, np.inf)
            if self.fit is None
            else (float(self.fit.calibration[OFFSET]), float(self.fit.deviation[OFFSET]))
        )

    @property
    def sigmas(self) -> NoiseSettings | None:
        """Noise of pixels and velocities; None where it could not be estimated."""
        return None if self.fit is None else self.fit.sigmas
