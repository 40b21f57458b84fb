"""User-specified repairs, read from a TOML file, in place of the estimates of the diagnosis."""

from collections.abc import Callable
from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, ConfigDict, PlainValidator, ValidationInfo, field_validator

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS, IDENTITY
from fgbaseline.data.formats.files.file_errors import FilePath
from fgbaseline.data.formats.files.toml_file import is_finite_number, read_toml
from fgbaseline.data.time_unit import TimeUnit

AS_RECORDED = "as-recorded"
"""keyword that disables a repair"""
Vector: TypeAlias = tuple[float, float, float]


def read_repairs(path: FilePath) -> "Repairs":
    """The repairs in a TOML file. Raises InputError with file and key path for an invalid value."""
    return read_toml(path, Repairs).content


def _axes(value: object) -> str:
    if value == AS_RECORDED:
        return IDENTITY
    if not isinstance(value, str) or value not in AXIS_CONVENTIONS:
        raise ValueError(
            f"it is none of the 24 right-handed axis conventions; write one such as 'x,-y,-z', or '{AS_RECORDED}'"
        )
    return value


def _vector(most: float, unit: str) -> Callable[[object], Vector]:
    def vector(value: object) -> Vector:
        if value == AS_RECORDED:
            return 0.0, 0.0, 0.0
        numbers = list(value) if isinstance(value, list | tuple) else []
        if len(numbers) != 3 or not all(is_finite_number(number) and abs(number) <= most for number in numbers):
            raise ValueError(f"it should be three numbers of at most {most:g} {unit}, or '{AS_RECORDED}'")
        return float(numbers[0]), float(numbers[1]), float(numbers[2])

    return vector


def _between(low: float, high: float, neutral: float | None = None) -> Callable[[object], float]:
    def number(value: Any) -> float:
        if neutral is not None and value == AS_RECORDED:
            return neutral
        if not is_finite_number(value) or not low <= value <= high:
            word = "" if neutral is None else f", or '{AS_RECORDED}'"
            raise ValueError(f"it should be a number from {low:g} to {high:g}{word}")
        return float(value)

    return number


def _time_unit(value: object) -> float:
    if isinstance(value, str) and value in tuple(TimeUnit):
        return TimeUnit(value).seconds
    try:
        return _between(1e-12, 1e12, 1.0)(value)
    except ValueError as error:
        raise ValueError(f"{error}, or a unit: {', '.join(TimeUnit)}") from error


def _track(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 2 <= value <= 10_000:
        raise ValueError("it should be a whole number from 2 to 10000")
    return value


class _Overrides(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SigmaOverrides(_Overrides):
    """Standard deviations in place of the estimated ones."""

    linear_velocity: Annotated[float, PlainValidator(_between(1e-6, 1e3))] | None = None
    """m/s, of the velocity held over an interval"""
    angular_velocity: Annotated[float, PlainValidator(_between(1e-7, 1e2))] | None = None
    """rad/s, of the rate held over an interval"""
    pixel: Annotated[float, PlainValidator(_between(1e-3, 1e3))] | None = None
    """px, of each of the four rows"""


class MaskOverrides(_Overrides):
    """Thresholds in place of `MaskSettings` and of the adaptive gate."""

    prediction_gate: Annotated[float, PlainValidator(_between(0.01, 1e4))] | None = None
    """px"""
    min_disparity: Annotated[float, PlainValidator(_between(0.0, 1e4))] | None = None
    """px"""
    max_row_mismatch: Annotated[float, PlainValidator(_between(0.0, 1e4))] | None = None
    """px"""
    min_track: Annotated[int, PlainValidator(_track)] | None = None
    """observations"""
    split_tracks: bool | None = None
    """false: of a track that jumps only the longest run takes part"""
    use_copied_frames: bool | None = None
    """true: observations that repeat the frame before take part like any other"""


class UnitOverrides(_Overrides):
    """Factors that convert recorded values to SI; 'as-recorded' for 1."""

    time: Annotated[float, PlainValidator(_time_unit)] | None = None
    """s, or the name of the unit: s, ms, us, ns"""
    angular_velocity: Annotated[float, PlainValidator(_between(1e-12, 1e12, 1.0))] | None = None
    """rad/s"""
    linear_velocity: Annotated[float, PlainValidator(_between(1e-12, 1e12, 1.0))] | None = None
    """m/s"""
    baseline: Annotated[float, PlainValidator(_between(1e-12, 1e12, 1.0))] | None = None
    """m"""
    extrinsic: Annotated[float, PlainValidator(_between(1e-12, 1e12, 1.0))] | None = None
    """m, of the translation of imu_T_cam"""

    def given(self) -> dict[str, float]:
        """The specified factors, by the names of `Units`."""
        return {name.partition("_")[0]: value for name, value in self if value is not None}


class Repairs(_Overrides):
    """Values in place of the estimates of the diagnosis; None keeps the estimate, 'as-recorded' disables a repair."""

    angular_axes: Annotated[str, PlainValidator(_axes)] | None = None
    """convention (`data.axis_conventions`) of the recorded angular velocity"""
    linear_axes: Annotated[str, PlainValidator(_axes)] | None = None
    """convention of the recorded linear velocity"""
    gyro_bias: Annotated[Vector, PlainValidator(_vector(10.0, "rad/s"))] | None = None
    """rad/s, gyroscope bias (its reading at rest) in recorded axes; subtracted"""
    velocity_scale: Annotated[float, PlainValidator(_between(0.01, 100.0, 1.0))] | None = None
    """recorded over true linear velocity; divided by"""
    time_offset_s: Annotated[float, PlainValidator(_between(-1e3, 1e3, 0.0))] | None = None
    """s, delay from the stamp of sample k to the begin of the interval over which it is held"""
    shift_intervals: Annotated[float, PlainValidator(_between(-1e4, 1e4, 0.0))] | None = None
    """shift in intervals between frames"""
    misalignment_deg: Annotated[Vector, PlainValidator(_vector(180.0, "degrees"))] | None = None
    """rotation vector by which imu_T_cam is turned against the velocities, in its own axes; undone"""
    extrinsic_inverted: bool | None = None
    """whether imu_T_cam was recorded as its inverse; inverted before anything else is found"""
    replace_outliers: bool | None = None
    """false: velocity samples that contradict the cameras and their neighbors are used as recorded"""
    disparity_offset_px: Annotated[float, PlainValidator(_between(-100.0, 100.0, 0.0))] | None = None
    """px by which every recorded uR is too large, and every disparity too small; subtracted from uR"""
    units: UnitOverrides = UnitOverrides()
    sigma: SigmaOverrides = SigmaOverrides()
    mask: MaskOverrides = MaskOverrides()

    @field_validator("shift_intervals")
    @classmethod
    def _one_shift(cls, value: float | None, info: ValidationInfo) -> float | None:
        if value is not None and info.data.get("time_offset_s") is not None:
            raise ValueError("time_offset_s says the same in seconds; give one of the two")
        return value
