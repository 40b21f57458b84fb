"""The contents of `diagnosis.json`: a diagnosis as a plain dict."""

from dataclasses import asdict
from importlib.metadata import version
from typing import Any

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.geometry import FloatArray

from ..body_velocity.result import Diagnosis
from ..conventions.axes import Axes
from .track_statistics import TrackStatistics, track_statistics
from .velocity_findings import findings_of, not_identifiable

SCHEMA = "fgbaseline/diagnosis/1"
"""incremented when a key is renamed, removed or changes its meaning; new keys do not change it"""


def to_json(
    diagnosis: Diagnosis, tracks: TrackStatistics | None = None, findings: tuple[Finding, ...] | None = None
) -> dict[str, Any]:
    """The contents of `diagnosis.json`, whose keys docs/diagnosis.md describes: numbers, texts, lists and dicts.

    None stands for a value that is not finite, with its reason under `notes`. `tracks` and `findings` are computed
    where they are not given.
    """
    tracks = tracks or track_statistics(diagnosis)
    findings = findings_of(diagnosis, tracks) if findings is None else findings
    report = header(diagnosis.sequence) | {
        "cannot_tell": diagnosis.failure_reason or None,
        "findings": [asdict(finding) for finding in findings],
        "not_identifiable": list(not_identifiable(diagnosis)),
    }
    report |= _velocities(diagnosis) | _noise(diagnosis) | _tracks(tracks)
    notes: dict[str, str] = {}
    clean: dict[str, Any] = _without_nan(
        report, "", notes, diagnosis.failure_reason or "the recording does not determine it"
    )
    if clean["cannot_tell"] is None:
        notes["cannot_tell"] = "everything was determined, except for what not_identifiable lists"
    return clean | {"notes": notes}


def header(sequence: Sequence) -> dict[str, Any]:
    """Schema, version, and size of the recording: the first keys of `diagnosis.json`."""
    return {
        "schema": SCHEMA,
        "version": version("fgbaseline"),
        "sequence": {
            "name": sequence.name,
            "frames": sequence.n_frames,
            "duration_s": float(sequence.t[-1] - sequence.t[0]),
            "observations": len(sequence.observations),
            "tracks": len(np.unique(sequence.observations.landmark)),
        },
    }


def _velocities(diagnosis: Diagnosis) -> dict[str, Any]:
    scale, scale_deviation = diagnosis.velocity_scale
    timing, dt = diagnosis.timing, float(np.median(diagnosis.sequence.dt))
    angle, angle_deviation = diagnosis.misalignment
    fitted, when = diagnosis.fit is not None, timing.identifiable
    return {
        "axes": {
            "angular_velocity": diagnosis.angular.matrix.tolist(),
            "linear_velocity": diagnosis.linear.matrix.tolist(),
            "angular": _axes(diagnosis.angular, fitted),
            "linear": _axes(diagnosis.linear, fitted),
        },
        "gyro_bias": _if(fitted, diagnosis.gyro_bias),
        "gyro_bias_std": _if(fitted, diagnosis.gyro_bias_deviation),
        "velocity_scale": scale if fitted else np.nan,
        "velocity_scale_std": scale_deviation,
        "time_offset_s": timing.shift if when else np.nan,
        "time_offset_std_s": timing.deviation if when else np.nan,
        "time_offset_frames": timing.shift / dt if when else np.nan,
        "interval": {"shift": diagnosis.shift, "name": _interval_name(diagnosis.shift)},
        "misalignment_deg": _if(fitted, np.rad2deg(angle)),
        "misalignment_std_deg": _if(fitted, np.rad2deg(angle_deviation)),
        "disparity_offset_px": diagnosis.disparity_offset[0] if fitted else np.nan,
        "disparity_offset_std_px": diagnosis.disparity_offset[1],
    }


def _interval_name(shift: float) -> str:
    return next((usual.name.lower() for usual in Shift if usual == shift), "shifted")


def _axes(axes: Axes, fitted: bool) -> dict[str, Any]:
    return {
        "convention": axes.name,
        "identifiable": list(axes.determined),
        "lead": axes.margin if fitted else np.nan,
        "median_error_before": axes.before,
        "median_error_after": axes.after,
    }


def _noise(diagnosis: Diagnosis) -> dict[str, Any]:
    fit = diagnosis.fit
    sigma = {
        "linear_velocity": np.nan if fit is None else fit.sigmas.linear_velocity,
        "angular_velocity": np.nan if fit is None else fit.sigmas.angular_velocity,
        "pixel": np.nan if fit is None else fit.sigmas.pixel,
        "pixel_white": np.nan if fit is None else fit.white.pixel,
        "pixel_inflation": np.nan if fit is None else fit.inflation.pixel,
        "pixel_inflation_of_single_tracks": np.nan if fit is None else fit.inflation.halves,
        "velocity_inflation": np.nan if fit is None else fit.inflation.velocity,
        "windows": 0 if fit is None else fit.windows,
    }
    return {"sigma": sigma}


def _tracks(tracks: TrackStatistics) -> dict[str, Any]:
    matches, wrong = int(tracks.matches.sum()), int(tracks.wrong.sum())
    return {
        # frame k: matches from frame k - 1 to it
        "wrong_matches": [np.nan, *tracks.wrong_share.tolist()],
        "tracks": {
            "wrong_share": wrong / matches if matches else np.nan,
            "wrong_share_after": tracks.wrong_after if matches else np.nan,
            "burst_intervals": np.flatnonzero(tracks.burst).tolist(),
            "copied_observations": tracks.copied,
            "disparity_not_positive": tracks.not_positive,
            "disparity_tiny": tracks.tiny,
            "row_mismatch": tracks.rows,
            "moving": tracks.moving,
            "moving_after": tracks.moving_after,
            "frames_with_few_features": np.flatnonzero(tracks.few).tolist(),
            "gaps": tracks.gaps.tolist(),
        },
    }


def _if(fitted: bool, values: FloatArray) -> list[float]:
    return [float(value) if fitted else np.nan for value in values]


def _without_nan(tree: Any, path: str, notes: dict[str, str], reason: str) -> Any:
    """The tree with None in place of what is no finite number, and why in `notes` (once for a list of numbers)."""
    if isinstance(tree, dict):
        return {key: _without_nan(value, f"{path}.{key}".lstrip("."), notes, reason) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_without_nan(value, path, notes, reason) for value in tree]
    if isinstance(tree, float) and not np.isfinite(tree):
        notes[path] = REASONS.get(path, reason)
        return None
    return float(tree) if isinstance(tree, np.floating) else tree


REASONS = {
    "wrong_matches": "frame 0 has no frame before it, and over some intervals the cameras do not determine the motion",
    "time_offset_s": "a time offset needs turns that cameras and velocities both show",
    "time_offset_std_s": "a time offset needs turns that cameras and velocities both show",
    "time_offset_frames": "a time offset needs turns that cameras and velocities both show",
}
