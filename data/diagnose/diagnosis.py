"""What is wrong with a recording, found from the recording alone."""

from dataclasses import dataclass, field

import numpy as np

from fgbaseline.geometry import FloatArray

from ..axes import IDENTITY, axes_matrix
from ..motion import Shift, held_twist
from ..observations import BoolArray
from ..sequence import Sequence
from .axes import Axes, angular_axes, linear_axes
from .fit import Fit, fit_windows, half_cost
from .links import repeated
from .odometry import Odometry
from .timing import Timing, timing
from .units import Units
from .whole_shift import whole_shift
from .window_terms import OFFSET, TURN, Sigmas

MIN_INTERVALS = 20
"""of which the cameras must tell the motion"""
SNAP = 0.15
"""intervals: a shift this near to a usual one (`Shift`) is taken for it"""


@dataclass(frozen=True, eq=False, slots=True)
class Diagnosis:
    """The state of a recording; `findings.findings_of` puts it into sentences."""

    sequence: Sequence
    cannot_tell: str = ""
    """why nothing could be found out, in a sentence; empty if it could"""
    odometry: Odometry | None = None
    angular: Axes = field(default_factory=lambda: Axes(IDENTITY, (False,) * 3, 0.0, np.nan, np.nan))
    linear: Axes = field(default_factory=lambda: Axes(IDENTITY, (False,) * 3, 0.0, np.nan, np.nan))
    timing: Timing = field(default_factory=lambda: Timing(0.0, np.inf, identifiable=False))
    shift: float = Shift.AFTER
    """intervals, the shift that the calibrated problem uses"""
    fit: Fit | None = None
    repeated: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    """(T-1,) intervals whose tracks are copies"""
    by_hand: frozenset[str] = frozenset()
    """names of `Repairs` that somebody set: taken as they are, however small or uncertain"""
    units: Units = field(default_factory=Units)
    """by which the recorded values were multiplied"""
    recorded: Sequence | None = None
    """as it was recorded; `sequence` is in SI units and has the extrinsic that fits"""
    inversion: tuple[float, float] | None = None
    """rad/s, median error of the rates before and after inverting imu_T_cam; None where it is the right way round"""

    @property
    def inverted(self) -> bool:
        """Whether imu_T_cam was recorded as its inverse."""
        return self.inversion is not None

    @property
    def gyro_bias(self) -> FloatArray:
        """(3,) rad/s, what the gyroscope reads at rest, in recorded axes."""
        return np.zeros(3) if self.fit is None else self.angular.matrix.T @ self.fit.shared[:3]

    @property
    def gyro_bias_deviation(self) -> FloatArray:
        """(3,) rad/s, in recorded axes."""
        return np.full(3, np.inf) if self.fit is None else np.abs(self.angular.matrix.T) @ self.fit.deviation[:3]

    @property
    def velocity_scale(self) -> tuple[float, float]:
        """Recorded over seen linear velocity, and its standard error."""
        if self.fit is None:
            return 1.0, np.inf
        return 1.0 + float(self.fit.shared[3]), float(self.fit.deviation[3])

    @property
    def misalignment(self) -> tuple[FloatArray, FloatArray]:
        """(3,) rad, the rotation vector by which imu_T_cam is off, in its own axes, and its standard errors."""
        if self.fit is None:
            return np.zeros(3), np.full(3, np.inf)
        return self.fit.shared[TURN], self.fit.deviation[TURN]

    @property
    def disparity_offset(self) -> tuple[float, float]:
        """px by which every recorded disparity is too small, and its standard error."""
        return (
            (0.0, np.inf) if self.fit is None else (float(self.fit.shared[OFFSET]), float(self.fit.deviation[OFFSET]))
        )

    @property
    def sigmas(self) -> Sigmas | None:
        """Noise of pixels and velocities; None where it could not be found."""
        return None if self.fit is None else self.fit.sigmas


def velocities_explained(sequence: Sequence, seen_by_cameras: Odometry, processes: int) -> Diagnosis:
    """What the cameras say of the velocities of a recording in SI units."""
    copies = repeated(sequence)
    known = seen_by_cameras.known
    if known.sum() < MIN_INTERVALS:
        reason = f"the cameras tell the motion of only {int(known.sum())} of {len(known)} intervals"
        return Diagnosis(sequence, reason, seen_by_cameras, repeated=copies)
    angular, linear = _axes_of(sequence, seen_by_cameras)
    return explained(sequence, seen_by_cameras, angular, linear, copies, processes=processes)


def _axes_of(sequence: Sequence, seen_by_cameras: Odometry) -> tuple[Axes, Axes]:
    """The conventions of angular and linear velocity."""
    seen, recorded, known = (
        seen_by_cameras.twist(sequence.dt),
        held_twist(sequence, Shift.MIDDLE),
        seen_by_cameras.known,
    )
    angular = angular_axes(seen[:, 3:], recorded[:, 3:], known)
    return angular, linear_axes(
        seen[:, :3], recorded[:, :3], seen[:, 3:], known, angular.name, sequence.camera.baseline
    )


def explained(
    sequence: Sequence,
    seen_by_cameras: Odometry,
    angular: Axes,
    linear: Axes,
    copies: BoolArray,
    given_shift: float | None = None,
    processes: int = 1,
) -> Diagnosis:
    """Delay, bias, scale, misalignment and noise of velocities in these axes; a shift that is given is taken."""
    seen, known = seen_by_cameras.twist(sequence.dt), seen_by_cameras.known
    dt = float(np.median(sequence.dt))
    when = timing(seen[:, 3:], sequence.angular_velocity[:-1] @ angular.matrix.T, known, dt)

    def twist(shift: float) -> FloatArray:
        return turned(held_twist(sequence, shift), linear.name, angular.name)

    fit = None
    if not when.identifiable and given_shift is None:
        fit = fit_windows(sequence, seen_by_cameras, twist(Shift.AFTER), processes)
        white = None if fit is None else fit.white
        if white is not None:

            def cost(shift: float) -> float:
                return half_cost(sequence, seen_by_cameras, twist(shift), white, processes)

            when = whole_shift(cost, dt) or when
    found = _usual(when.shift / dt) if when.identifiable else float(Shift.AFTER)
    shift = found if given_shift is None else given_shift
    if fit is None or shift != Shift.AFTER:
        fit = fit_windows(sequence, seen_by_cameras, twist(shift), processes)
    reason = "" if fit is not None else "no stretch of the recording has enough tracks to tell noise from error"
    return Diagnosis(sequence, reason, seen_by_cameras, angular, linear, when, shift, fit, copies)


def turned(twist: FloatArray, linear: str, angular: str) -> FloatArray:
    """Twists (n, 6) in the axes of imu_T_cam of recorded ones, each velocity in its own convention."""
    return np.concatenate([twist[:, :3] @ axes_matrix(linear).T, twist[:, 3:] @ axes_matrix(angular).T], axis=1)


def _usual(shift: float) -> float:
    nearest = min(Shift, key=lambda usual: abs(shift - usual))
    return float(nearest) if abs(shift - nearest) < SNAP else shift
