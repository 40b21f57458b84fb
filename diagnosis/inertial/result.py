"""The result of a diagnosis of raw inertial data."""

from dataclasses import dataclass, field

import numpy as np

from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.problem import NoiseSettings
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.data.sequence import Sequence

from ..inertial_initialization.inertial_path import InertialPath
from ..inertial_initialization.initial_state import Start
from ..noise.calibration_fit import CalibrationFit
from ..odometry.stereo_odometry import Odometry
from ..repairs.repaired_sequence import RepairedTracks
from .baseline_unit import BaselineUnit
from .imu_spikes import Spikes
from .monocular.initial_state import MonocularStart
from .sensor_axes import SensorAxes
from .sensor_calibration import SensorChecks
from .units import ImuUnits


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class InertialDiagnosis(Displayed):
    """Start, path, noise and faults of a recording with raw inertial samples."""

    sequence: Sequence
    """recording in rad/s, m/s^2 and m, in the axes of imu_T_cam"""
    recorded: Sequence
    failure_reason: str = ""
    """reason for which no start is found, in a sentence without its full stop; empty otherwise"""
    units: ImuUnits = field(default_factory=ImuUnits)
    axes: SensorAxes = field(default_factory=SensorAxes)
    baseline: BaselineUnit = field(default_factory=BaselineUnit)
    imu: ImuIntervals | None = None
    odometry: Odometry | None = None
    repeated: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    """(T-1,) intervals whose tracks are copies"""
    spikes: tuple[Spikes, ...] = ()
    start: Start | None = None
    path: InertialPath | None = None
    fit: CalibrationFit | None = None
    sensors: SensorChecks | None = None
    """checks of gyroscope and accelerometer against the cameras"""
    tracks: RepairedTracks | None = None
    """split tracks of one camera; None for stereo, whose mask needs the path"""
    monocular: MonocularStart | None = None
    """initialization of one camera; None for stereo"""

    @property
    def pixel(self) -> float:
        """px, noise of each row; assumed where it is not found."""
        if self.monocular is not None:
            return self.monocular.pixel
        return NoiseSettings().pixel if self.fit is None else self.fit.sigmas.pixel

    @property
    def pixel_found(self) -> bool:
        """Whether the noise is found in the recording."""
        return self.fit is not None or (self.monocular is not None and self.monocular.window is not None)
