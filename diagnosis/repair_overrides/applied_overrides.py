"""Application of user-specified repairs to a diagnosis."""

from dataclasses import replace

import numpy as np

from fgbaseline.data.axis_conventions import axes_matrix
from fgbaseline.data.problem import NoiseSettings
from fgbaseline.geometry import InputError

from ..body_velocity.pipeline import diagnose
from ..body_velocity.result import Diagnosis
from ..body_velocity.velocity_calibration import calibrate_with_axes
from ..conventions.axes import Axes
from ..noise.calibration_fit import CalibrationFit
from ..noise.correlated_noise import Inflation
from ..repairs.repaired_sequence import TrackRepairs
from ..tracks.observation_mask import MaskSettings
from ..window_adjustment.residuals import MISALIGNMENT, N_CALIBRATION, OFFSET, SCALE
from .settings import Repairs

SAME = 1e-3
"""intervals, by which a shift may differ without another fit"""


def with_overrides(diagnosis: Diagnosis, repairs: Repairs) -> Diagnosis:
    """The diagnosis with the values of `repairs` in place of its estimates.

    Axes and shift are applied before bias, misalignment and noise are estimated, which depend on them. Where nothing
    could be estimated, the rest is the default `NoiseSettings` and no fault. Raises InputError for a shift beyond the
    recording.
    """
    apart = ("sigma", "mask", "units", "extrinsic_inverted", "replace_outliers")
    given = frozenset(name for name, value in repairs if name not in apart and value is not None)
    if not given and repairs.sigma == type(repairs.sigma)():
        return diagnosis
    shift = _shift(diagnosis, repairs)
    angular = _turned(diagnosis.angular, repairs.angular_axes)
    linear = _turned(diagnosis.linear, repairs.linear_axes)
    changed = (angular.name, linear.name) != (diagnosis.angular.name, diagnosis.linear.name)
    changed |= shift is not None and abs(shift - diagnosis.shift) > SAME
    if changed and diagnosis.fit is not None and diagnosis.odometry is not None:
        found = calibrate_with_axes(
            diagnosis.sequence,
            diagnosis.odometry,
            angular,
            linear,
            diagnosis.repeated,
            shift,
            outliers=diagnosis.outliers,
        )
        found = replace(found, units=diagnosis.units, recorded=diagnosis.recorded, inversion=diagnosis.inversion)
    else:
        shift = diagnosis.shift if shift is None else shift
        found = replace(diagnosis, angular=angular, linear=linear, shift=shift)
    return replace(found, fit=_fit(found, repairs), overrides=given)


def with_given_units(diagnosis: Diagnosis, repairs: Repairs) -> Diagnosis:
    """The diagnosis with units, direction of the extrinsic and treatment of outliers of `repairs`, computed anew where
    they differ."""
    units, inverted, replaced = repairs.units.given(), repairs.extrinsic_inverted, repairs.replace_outliers is not False
    same = not diagnosis.units.doubt and all(getattr(diagnosis.units, name) == units[name] for name in units)
    same &= inverted in (None, diagnosis.inverted) and (replaced or diagnosis.outliers is None)
    if not same:
        recorded = diagnosis.recorded or diagnosis.sequence
        diagnosis = diagnose(recorded, units=units, inverted=inverted, replace_outliers=replaced)
    return replace(diagnosis, units=replace(diagnosis.units, given=frozenset(units)))


def _shift(diagnosis: Diagnosis, repairs: Repairs) -> float | None:
    """Intervals."""
    shift = repairs.shift_intervals
    if repairs.time_offset_s is not None:
        shift = repairs.time_offset_s / float(np.median(diagnosis.sequence.dt))
    if shift is not None and abs(shift) >= diagnosis.sequence.n_frames - 1:
        name = "shift_intervals" if repairs.time_offset_s is None else "time_offset_s"
        raise InputError(
            f"{name}: velocities shifted by {shift:g} intervals leave the recording, which has "
            f"{diagnosis.sequence.n_frames - 1}; give less"
        )
    return shift


def _turned(axes: Axes, name: str | None) -> Axes:
    return axes if name is None else replace(axes, name=name)


def _fit(found: Diagnosis, repairs: Repairs) -> CalibrationFit:
    fit = found.fit or CalibrationFit(
        NoiseSettings(),
        np.zeros(N_CALIBRATION),
        np.full(N_CALIBRATION, np.inf),
        0,
        Inflation(),
        NoiseSettings(),
        np.empty((0, 6)),
    )
    calibration, deviation = fit.calibration.copy(), fit.deviation.copy()
    if repairs.gyro_bias is not None:
        calibration[:3], deviation[:3] = axes_matrix(found.angular.name) @ repairs.gyro_bias, 0.0
    if repairs.velocity_scale is not None:
        calibration[SCALE], deviation[SCALE] = repairs.velocity_scale - 1.0, 0.0
    if repairs.misalignment_deg is not None:
        calibration[MISALIGNMENT], deviation[MISALIGNMENT] = np.deg2rad(repairs.misalignment_deg), 0.0
    if repairs.disparity_offset_px is not None:
        calibration[OFFSET], deviation[OFFSET] = repairs.disparity_offset_px, 0.0
    sigmas = replace(fit.sigmas, **repairs.sigma.model_dump(exclude_none=True))
    return replace(fit, sigmas=sigmas, calibration=calibration, deviation=deviation)


def mask_settings(repairs: Repairs) -> tuple[MaskSettings, TrackRepairs]:
    """Mask settings and track repairs with the values of `repairs`."""
    mask, default = repairs.mask, MaskSettings()
    given = mask.model_dump(exclude_none=True, include={"min_disparity", "max_row_mismatch", "min_track"})
    tracks = TrackRepairs(
        gate=mask.prediction_gate, split=mask.split_tracks is not False, mask_copies=mask.use_copied_frames is not True
    )
    return replace(default, **given), tracks


def override_sentences(repairs: Repairs) -> tuple[str, ...]:
    """The user-specified values, one sentence each."""
    values = repairs.model_dump(exclude_none=True)
    flat = {name: value for name, value in values.items() if not isinstance(value, dict)}
    flat |= {f"{table}.{name}": value for table in ("units", "sigma", "mask") for name, value in values[table].items()}
    return tuple(f"user-specified: {name} = {_text(value)}" for name, value in flat.items())


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(f'{number:g}' for number in value)}]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"
