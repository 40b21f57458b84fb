"""The pipeline of a diagnosis with one camera: units, axes, mask of tracks, start, sensors."""

from dataclasses import replace

from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence

from ...conventions.extrinsics_check import unconfirmed_position
from ...odometry.monocular_odometry import monocular_odometry
from ...tracks.recording_faults import unusable
from ...tracks.track_segments import repeated
from ..imu_spikes import without_spikes
from ..result import InertialDiagnosis
from ..sensor_axes import in_imu_axes
from ..sensor_calibration import sensor_checks
from ..units import imu_units, rescaled_samples
from .initial_state import monocular_start
from .sensor_axes import monocular_axes
from .track_mask import monocular_tracks, used


def diagnose_monocular(recorded: Sequence) -> InertialDiagnosis:
    """Estimates units, axes, mask, start, pixel noise and sensor errors of a recording with one camera."""
    reason = unusable(recorded) or unconfirmed_position(recorded)
    if reason:
        return InertialDiagnosis(recorded, recorded, reason)
    seen = monocular_odometry(recorded)
    units = imu_units(recorded, seen)
    sequence, spikes = without_spikes(rescaled_samples(recorded, units))
    tracks = monocular_tracks(sequence)
    axes = monocular_axes(used(sequence, tracks), seen)
    sequence = in_imu_axes(sequence, axes)
    assert sequence.imu is not None
    imu = imu_intervals(sequence.imu, sequence.t)
    found = InertialDiagnosis(
        sequence,
        recorded,
        units=units,
        axes=axes,
        imu=imu,
        odometry=seen,
        repeated=repeated(sequence),
        spikes=spikes,
        tracks=tracks,
    )
    try:
        start = monocular_start(used(sequence, tracks), imu)
    except ValueError as error:
        return replace(found, failure_reason=str(error), sensors=sensor_checks(sequence, seen))
    sensors = sensor_checks(sequence, seen, start=start.start)
    return replace(found, start=start.start, monocular=start, sensors=sensors)
