"""The pipeline of a diagnosis of raw inertial data: units, odometry, start, path, pixel noise, sensors."""

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import plural

from ..conventions.extrinsics_check import usual_rig
from ..conventions.units import Units, rescaled
from ..inertial_initialization.inertial_path import InertialPath, inertial_path
from ..inertial_initialization.initial_state import Start, inertial_start
from ..noise.calibration_fit import fit_windows
from ..odometry.stereo_odometry import Odometry, odometry
from ..tracks.recording_faults import unusable
from ..tracks.track_segments import repeated
from .baseline_unit import baseline_unit
from .imu_spikes import without_spikes
from .monocular.pipeline import diagnose_monocular
from .result import InertialDiagnosis
from .sensor_axes import in_imu_axes, sensor_axes
from .sensor_calibration import sensor_checks
from .units import imu_units, rescaled_samples

BEGINNING = 3.0
"""s, length of the beginning whose odometry is compared with that of the whole recording"""
MIN_BEGINNING = 5
"""smallest number of intervals in the beginning"""


def diagnose_inertial(sequence: Sequence, processes: int = 1) -> InertialDiagnosis:
    """Estimates units, start, path, pixel noise and sensor errors from the recording alone, without its truth."""
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            return diagnose_monocular(sequence) if sequence.monocular else _diagnose(sequence, processes)
    except (np.linalg.LinAlgError, ValueError, FloatingPointError, RuntimeError) as error:
        return InertialDiagnosis(sequence, sequence, f"its computation failed ({type(error).__name__}: {error})")


def found_start(sequence: Sequence, pixel: float, seen: Odometry | None) -> tuple[Start, InertialPath]:
    """Start and path of a recording that is not diagnosed, in SI units, for a pixel sigma of `pixel` px.

    `seen` is its odometry, if already computed. Raises ValueError with the reason if no start is found.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        assert sequence.imu is not None
        seen = odometry(sequence) if seen is None else seen
        imu = imu_intervals(sequence.imu, sequence.t)
        start = inertial_start(sequence, seen, imu, pixel)
        if start is None:
            raise ValueError(no_start(seen))
        return start, inertial_path(sequence, seen, imu, start)


def no_start(seen: Odometry) -> str:
    """Reason why no start is found, a clause."""
    known = int(seen.known.sum())
    return (
        f"the start of raw inertial data needs frames whose motion the cameras show, and there are too few at the "
        f"beginning ({plural(known, 'interval')} of {len(seen.known):,} in all)"
    )


def _diagnose(recorded: Sequence, processes: int) -> InertialDiagnosis:
    reason = unusable(recorded)
    if reason:
        return InertialDiagnosis(recorded, recorded, reason)
    usual = usual_rig(recorded)
    seen = odometry(usual)
    units = imu_units(recorded, seen)
    sequence, spikes = without_spikes(rescaled_samples(recorded, units))
    axes = sensor_axes(sequence, seen)
    sequence = in_imu_axes(sequence, axes)
    baseline = baseline_unit(sequence, seen)
    sequence = rescaled(sequence, Units(baseline=baseline.factor, extrinsic=baseline.extrinsic))
    assert sequence.imu is not None
    imu = imu_intervals(sequence.imu, sequence.t)
    if baseline.doubt:
        return InertialDiagnosis(sequence, recorded, baseline.doubt, units, axes, baseline, imu, spikes=spikes)
    if usual is not recorded:  # the first odometry had the camera at the IMU
        seen = odometry(sequence)
    found = InertialDiagnosis(
        sequence,
        recorded,
        units=units,
        axes=axes,
        baseline=baseline,
        imu=imu,
        odometry=seen,
        repeated=repeated(sequence),
        spikes=spikes,
    )
    first = inertial_start(sequence, seen, imu, max(seen.pixel_sigma, np.finfo(float).tiny))
    if first is None:
        return replace(found, failure_reason=no_start(seen))
    path = inertial_path(sequence, seen, imu, first)
    fit = fit_windows(sequence, seen, path.twist(sequence), processes)
    pixel = seen.pixel_sigma * path.inflation if fit is None else fit.sigmas.pixel
    start = inertial_start(sequence, seen, imu, pixel * misfit_of_beginning(sequence, seen, path))
    return replace(found, start=start, path=path, fit=fit, sensors=sensor_checks(sequence, seen, path, start))


def misfit_of_beginning(sequence: Sequence, seen: Odometry, path: InertialPath) -> float:
    """Ratio (at least 1) of the odometry's misfit at the beginning to that in the whole recording.

    It exceeds 1 if a tracker that started on a moving vehicle lets all tracks lag behind in the first seconds.
    """
    known = np.flatnonzero(seen.known)
    early = sequence.t[known] < sequence.t[0] + BEGINNING
    if int(early.sum()) < MIN_BEGINNING:
        return 1.0
    return max(1.0, float(np.sqrt(np.median(path.whitened[early]) / np.median(path.whitened))))
