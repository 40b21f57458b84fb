"""Units of raw inertial samples: °/s by the rotations that the cameras see, g by the magnitude of gravity."""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, InputError

from ..conventions.rate_units import DEGREE, doubt_of_rate_unit
from ..conventions.scale_ratio import ScaleRatio, scale_ratio
from ..odometry.stereo_odometry import Odometry

RATES = {DEGREE: "°/s", 1e-3: "mrad/s", 1e-3 * DEGREE: "m°/s"}
FORCES = {9.80665: "g", 9.80665e-3: "mg", 1e-3: "mm/s^2"}
RATE_TOLERANCE, FORCE_TOLERANCE = 0.45, 0.18
"""tolerances of the decadic logarithm of a ratio: factors of 2.8 and 1.5"""
LEAST_GRAVITY = 0.93
"""share of gravity: the median magnitude is no less, except by the error of an accelerometer"""
COUNTS_PER_G = (16384, 8192, 4096, 2048)
"""counts per g of the ranges of usual accelerometers"""
MIN_KNOWN = 20
"""intervals whose rotation the cameras show"""
MAX_RATE = 60.0
"""rad/s, largest median rate of any body: beyond it the unit is °/s even where the cameras show nothing"""


@dataclass(frozen=True, slots=True)
class ImuUnits:
    """Factors that convert the samples to rad/s and m/s^2."""

    rate: float = 1.0
    force: float = 1.0
    ratio: float = np.nan
    """rotations that the cameras see over those of the samples, where both are correlated"""
    magnitude: float = np.nan
    """median specific force as recorded"""


def mean_rates(sequence: Sequence) -> FloatArray:
    """Mean angular velocities (T-1, 3) of the samples between frames, in their unit."""
    return _means(sequence)[0]


def mean_forces(sequence: Sequence) -> FloatArray:
    """Mean specific forces (T-1, 3) of the samples between frames, in their unit."""
    return _means(sequence)[1]


def _means(sequence: Sequence) -> tuple[FloatArray, FloatArray]:
    assert sequence.imu is not None
    cut = imu_intervals(sequence.imu, sequence.t)
    values = np.concatenate([cut.angular_velocity, cut.specific_force], axis=1) * cut.dt[:, None]
    mean = np.add.reduceat(values, cut.starts[:-1], axis=0) / sequence.dt[:, None]
    return mean[:, :3], mean[:, 3:]


def imu_units(sequence: Sequence, seen: Odometry | None) -> ImuUnits:
    """The units of the samples. Raises InputError where no unit explains them."""
    imu = sequence.imu
    assert imu is not None
    magnitude = float(np.median(np.linalg.norm(imu.specific_force, axis=1)))
    force = _unit(magnitude / imu.gravity, (1.0, *FORCES), FORCE_TOLERANCE)
    if force is None or (force != 1.0 and magnitude * force < LEAST_GRAVITY * imu.gravity):
        counts = next((n for n in COUNTS_PER_G if LEAST_GRAVITY <= magnitude / n < 10.0**FORCE_TOLERANCE), None)
        raw = "" if counts is None else f" (raw counts, {counts} per g?)"
        raise InputError(
            f"imu_linear_acceleration: its median magnitude is {magnitude:.4g}{raw}, which is gravity "
            f"({imu.gravity:g} m/s^2) in none of m/s^2, g, mg and mm/s^2; write the specific force as measured, +9.8 "
            "upward at rest"
        )
    found = ScaleRatio(np.nan, known=False)
    if seen is not None and int(seen.known.sum()) >= MIN_KNOWN:
        found = scale_ratio(seen.twist(sequence.dt)[:, 3:], mean_rates(sequence), seen.known, centered=True)
    ratio = found.ratio if found.known else np.nan
    rate = None if np.isnan(ratio) else _unit(1.0 / ratio, (1.0, *RATES), RATE_TOLERANCE)
    if found.known:
        doubt = doubt_of_rate_unit(found, rate or np.nan, RATES.get(rate or 1.0, ""))
        if doubt:
            raise InputError(f"imu_angular_velocity: {doubt}; write rad/s")
    median = float(np.median(np.linalg.norm(imu.angular_velocity, axis=1)))
    if rate is None and median > MAX_RATE:
        rate = next((unit for unit in RATES if median * unit <= MAX_RATE), None)
    return ImuUnits(1.0 if rate is None else rate, force, ratio, magnitude)


def _unit(ratio: float, factors: tuple[float, ...], tolerance: float) -> float | None:
    """The factor to SI that explains a ratio of recorded to true values."""
    return next((f for f in factors if ratio > 0.0 and abs(np.log10(ratio * f)) < tolerance), None)


def rescaled_samples(sequence: Sequence, units: ImuUnits) -> Sequence:
    """The recording with its samples in rad/s and m/s^2."""
    imu = sequence.imu
    assert imu is not None
    if units.rate == 1.0 and units.force == 1.0:
        return sequence
    rate, force = imu.angular_velocity * units.rate, imu.specific_force * units.force
    return replace(sequence, imu=replace(imu, angular_velocity=rate, specific_force=force))


def imu_unit_findings(units: ImuUnits) -> tuple[Finding, ...]:
    """A finding for each wrong unit."""
    found = []
    if units.rate != 1.0:
        text = f"The gyroscope's samples are in {RATES[units.rate]} and not in rad/s: multiplied by {units.rate:.6g}."
        seen = "their size" if np.isnan(units.ratio) else f"the cameras see rotations {units.ratio:.3g} times as large"
        found.append(Finding("angular_velocity_unit", text, 1.0 / units.rate, 1.0, "recorded over true", seen))
    if units.force != 1.0:
        text = (
            f"The accelerometer's samples are in {FORCES[units.force]} and not in m/s^2: multiplied by "
            f"{units.force:.6g}."
        )
        seen = f"median magnitude {units.magnitude:.4g}"
        found.append(Finding("accelerometer_unit", text, 1.0 / units.force, 1.0, "recorded over true", seen))
    return tuple(found)


def require_si(sequence: Sequence, findings: tuple[Finding, ...]) -> None:
    """Raises InputError where a recording that is taken as recorded has `findings` on its units."""
    if findings:
        sentences = " ".join(finding.sentence.split(":")[0] + f" ({finding.certainty})." for finding in findings)
        remedy = "Convert them, or run without --as-recorded, which repairs them"
        raise InputError(f"{sequence.source}: {sentences} {remedy}")
