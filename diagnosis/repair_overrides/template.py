"""The estimates of a diagnosis as a TOML file of repairs to edit."""

from collections.abc import Iterator

import numpy as np

from fgbaseline.data.problem import NoiseSettings
from fgbaseline.geometry import FloatArray

from ..body_velocity.result import Diagnosis
from ..conventions.axes import Axes
from ..repairs.repaired_sequence import repair
from ..repairs.significance import significant_bias, significant_misalignment, significant_offset, significant_scale
from ..tracks.observation_mask import MaskSettings


def repairs_text(diagnosis: Diagnosis) -> str:
    """The text of a file for `read_repairs`: the values of the calibrated problem, with their uncertainties."""
    return "\n".join(_lines(diagnosis)) + "\n"


def _lines(diagnosis: Diagnosis) -> Iterator[str]:
    mask, sigmas = MaskSettings(), diagnosis.sigmas or NoiseSettings()
    yield f"# Repairs of {diagnosis.sequence.name.splitlines()[0]}, as the diagnosis found them, for run --repairs."
    yield "# A key that is left out is left to the diagnosis; 'as-recorded' in place of a value turns its repair off."
    if diagnosis.failure_reason:
        yield f"# Nothing could be found out: {' '.join(diagnosis.failure_reason.split())}."
    yield ""
    yield f"extrinsic_inverted = {str(diagnosis.inverted).lower()}  # of imu_T_cam, before anything else"
    yield "replace_outliers = true  # velocity samples that contradict cameras and neighbors; false: as recorded"
    yield f'angular_axes = "{diagnosis.angular.name}"  # {_seen(diagnosis.angular)}'
    yield f'linear_axes = "{diagnosis.linear.name}"  # {_seen(diagnosis.linear)}'
    bias, deviation = significant_bias(diagnosis), diagnosis.gyro_bias_deviation
    known = _found(bias, diagnosis.gyro_bias, deviation)
    yield f"gyro_bias = {_vector(bias)}  # rad/s at rest, in recorded axes{known}"
    scale, uncertain = diagnosis.velocity_scale
    used = significant_scale(diagnosis)
    yield f"velocity_scale = {used:.6g}  # recorded over true; found {scale:.4f} +- {uncertain:.4f}"
    yield f"shift_intervals = {diagnosis.shift:.6g}  # or time_offset_s; {_timing(diagnosis)}"
    angle, (found, deviation) = significant_misalignment(diagnosis), diagnosis.misalignment
    known = _found(np.rad2deg(angle), np.rad2deg(found), np.rad2deg(deviation))
    yield f"misalignment_deg = {_vector(np.rad2deg(angle))}  # rotation vector of imu_T_cam{known}"
    offset, uncertain = diagnosis.disparity_offset
    used = significant_offset(diagnosis)
    yield f"disparity_offset_px = {used:.6g}  # of every uR; found {offset:.3f} +- {uncertain:.3f}"
    yield ""
    yield "[units]"
    units = diagnosis.units
    yield (
        "# time is given by --time-unit"
        if diagnosis.sequence.time_unit_given
        else f"time = {units.time:.15g}  # s, or s, ms, us, ns in quotes"
    )
    yield f"angular_velocity = {units.angular:.15g}  # rad/s"
    yield f"linear_velocity = {units.linear:.15g}  # m/s"
    yield f"baseline = {units.baseline:.15g}  # m"
    yield f"extrinsic = {units.extrinsic:.15g}  # m, of the translation of imu_T_cam"
    yield ""
    yield "[sigma]"
    yield f"linear_velocity = {sigmas.linear_velocity:.6g}  # m/s"
    yield f"angular_velocity = {sigmas.angular_velocity:.6g}  # rad/s"
    yield f"pixel = {sigmas.pixel:.6g}  # px"
    yield ""
    yield "[mask]"
    yield f"prediction_gate = {repair(diagnosis, mask).gate:.6g}  # px, of an observation from the one before"
    yield f"min_disparity = {mask.min_disparity:g}  # px"
    yield f"max_row_mismatch = {mask.max_row_mismatch:g}  # px"
    yield f"min_track = {mask.min_track}  # observations"
    yield "split_tracks = true  # false: of a track that jumps only the longest run takes part"
    yield "use_copied_frames = false"


def _seen(axes: Axes) -> str:
    seen = [name for name, is_seen in zip("xyz", axes.determined, strict=True) if is_seen]
    return "all axes are seen" if len(seen) == 3 else f"seen by the cameras: {', '.join(seen) or 'none'}"


def _timing(diagnosis: Diagnosis) -> str:
    timing, dt = diagnosis.timing, float(np.median(diagnosis.sequence.dt))
    if not timing.identifiable:
        return "not identifiable"
    return f"found {timing.shift / dt:.3f} +- {timing.deviation / dt:.3f}"


def _found(used: FloatArray, found: FloatArray, deviation: FloatArray) -> str:
    value = "" if np.array_equal(used, found) else f"; found {_vector(found, 3)}"
    if not np.isfinite(deviation).all():
        return "; not identifiable"
    return f"{value}; standard errors {_vector(deviation, 2)}"


def _vector(values: FloatArray, digits: int = 6) -> str:
    return f"[{', '.join(f'{value + 0.0:.{digits}g}' for value in values)}]"
