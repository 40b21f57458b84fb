"""A diagnosis with what somebody knows better in place of what it found, and how that is told and written."""

from dataclasses import replace

import numpy as np

from fgbaseline.geometry import InputError

from .axes import axes_matrix
from .diagnose import Diagnosis, diagnose
from .diagnose.axes import Axes
from .diagnose.diagnosis import explained
from .diagnose.fit import Fit
from .diagnose.inflation import Inflation
from .diagnose.repair import TrackRepairs
from .diagnose.window_terms import OFFSET, SCALE, SHARED, TURN, Sigmas
from .repairs import Repairs
from .track_mask import MaskSettings

ASSUMED = Sigmas(pixel=1.5, linear=0.3, angular=0.03)
"""px, m/s and rad/s: the noise that stands in where a recording could not be diagnosed"""
SAME = 1e-3
"""intervals, by which a shift may differ without another fit"""


def overridden(diagnosis: Diagnosis, repairs: Repairs) -> Diagnosis:
    """The diagnosis that has the given values where `repairs` has some.

    Axes and shift are given before bias, misalignment and noise are found, which depend on them. Where nothing could be
    found, the rest is `ASSUMED` noise and no fault. Raises InputError for a shift beyond the recording.
    """
    apart = ("sigma", "mask", "units", "extrinsic_inverted")
    given = frozenset(name for name, value in repairs if name not in apart and value is not None)
    if not given and repairs.sigma == type(repairs.sigma)():
        return diagnosis
    shift = _shift(diagnosis, repairs)
    angular = _turned(diagnosis.angular, repairs.angular_axes)
    linear = _turned(diagnosis.linear, repairs.linear_axes)
    changed = (angular.name, linear.name) != (diagnosis.angular.name, diagnosis.linear.name)
    changed |= shift is not None and abs(shift - diagnosis.shift) > SAME
    if changed and diagnosis.fit is not None and diagnosis.odometry is not None:
        found = explained(diagnosis.sequence, diagnosis.odometry, angular, linear, diagnosis.repeated, shift)
        found = replace(found, units=diagnosis.units, recorded=diagnosis.recorded, inversion=diagnosis.inversion)
    else:
        shift = diagnosis.shift if shift is None else shift
        found = replace(diagnosis, angular=angular, linear=linear, shift=shift)
    return replace(found, fit=_fit(found, repairs), by_hand=given)


def as_given(diagnosis: Diagnosis, repairs: Repairs) -> Diagnosis:
    """The diagnosis of the recording in the units, and with the extrinsic, that are given."""
    units, inverted = repairs.units.given(), repairs.extrinsic_inverted
    same = not diagnosis.units.doubt and all(getattr(diagnosis.units, name) == units[name] for name in units)
    if not (same and inverted in (None, diagnosis.inverted)):
        diagnosis = diagnose(diagnosis.recorded or diagnosis.sequence, units=units, inverted=inverted)
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


def _fit(found: Diagnosis, repairs: Repairs) -> Fit:
    fit = found.fit or Fit(
        ASSUMED, np.zeros(SHARED), np.full(SHARED, np.inf), 0, Inflation(), ASSUMED, np.empty((0, 6))
    )
    shared, deviation = fit.shared.copy(), fit.deviation.copy()
    if repairs.gyro_bias is not None:
        shared[:3], deviation[:3] = axes_matrix(found.angular.name) @ repairs.gyro_bias, 0.0
    if repairs.velocity_scale is not None:
        shared[SCALE], deviation[SCALE] = repairs.velocity_scale - 1.0, 0.0
    if repairs.misalignment_deg is not None:
        shared[TURN], deviation[TURN] = np.deg2rad(repairs.misalignment_deg), 0.0
    if repairs.disparity_offset_px is not None:
        shared[OFFSET], deviation[OFFSET] = repairs.disparity_offset_px, 0.0
    sigma = repairs.sigma
    sigmas = Sigmas(
        pixel=fit.sigmas.pixel if sigma.pixel is None else sigma.pixel,
        linear=fit.sigmas.linear if sigma.linear_velocity is None else sigma.linear_velocity,
        angular=fit.sigmas.angular if sigma.angular_velocity is None else sigma.angular_velocity,
    )
    return replace(fit, sigmas=sigmas, shared=shared, deviation=deviation)


def mask_settings(repairs: Repairs) -> tuple[MaskSettings, TrackRepairs]:
    """What an observation must satisfy, and what is done to tracks."""
    mask, default = repairs.mask, MaskSettings()
    given = {
        name: value
        for name in ("min_disparity", "max_row_mismatch", "min_track")
        if (value := getattr(mask, name)) is not None
    }
    tracks = TrackRepairs(
        gate=mask.prediction_gate, split=mask.split_tracks is not False, mask_copies=mask.use_copied_frames is not True
    )
    return replace(default, **given), tracks


def told(repairs: Repairs) -> tuple[str, ...]:
    """What was set by hand, one sentence each."""
    values = repairs.model_dump(exclude_none=True)
    flat = {name: value for name, value in values.items() if not isinstance(value, dict)}
    flat |= {f"{table}.{name}": value for table in ("units", "sigma", "mask") for name, value in values[table].items()}
    return tuple(f"set by hand: {name} = {_text(value)}" for name, value in flat.items())


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(f'{number:g}' for number in value)}]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"
