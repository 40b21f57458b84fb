"""The simulated drives of a suite: settings of `Simulation`, any of which may be a list or a range to go through."""

from collections.abc import Iterator
from itertools import product
from math import prod
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from fgbaseline.data.simulate import Simulation
from fgbaseline.geometry import InputError

Finite = Annotated[float, Field(allow_inf_nan=False)]
MOST_STEPS = 1000
MOST_DRIVES = 10_000


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Range(_Part):
    """Evenly spaced numbers."""

    start: Annotated[Finite, Field(alias="from")]
    to: Finite
    steps: Annotated[int, Field(ge=2, le=MOST_STEPS)]

    @model_validator(mode="after")
    def _rises(self) -> "Range":
        if self.start >= self.to:
            raise ValueError(f"it goes from {self.start:g} to {self.to:g}; give the smaller number first")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers, both ends among them."""
        return tuple(float(f"{value:.12g}") for value in np.linspace(self.start, self.to, self.steps))


Numbers: TypeAlias = Finite | tuple[Finite, ...] | Range
Path: TypeAlias = Literal["town", "loop", "highway", "handheld"]
World: TypeAlias = Literal["street", "room"]
Interval: TypeAlias = Literal["after", "before", "mean"]
Vector: TypeAlias = tuple[Finite, Finite, Finite]


class Drives(_Part):
    """What `fgbaseline simulate` takes; None for its defaults."""

    path: Path | tuple[Path, ...] | None = None
    world: World | tuple[World, ...] | None = None
    duration: Numbers | None = None
    frame_rate: Numbers | None = None
    sigma_linear: Numbers | None = None
    sigma_angular: Numbers | None = None
    gyro_bias: Vector | None = None
    velocity_scale: Numbers | None = None
    time_offset: Numbers | None = None
    velocity_of_interval: Interval | tuple[Interval, ...] | None = None
    linear_axes: str | tuple[str, ...] | None = None
    angular_axes: str | tuple[str, ...] | None = None
    features_per_frame: Numbers | None = None
    track_length: Numbers | None = None
    nearest: Numbers | None = None
    farthest: Numbers | None = None
    returning_share: Numbers | None = None
    return_after: Numbers | None = None
    blackouts: tuple[tuple[Finite, Finite], ...] | None = None
    sigma_pixel: Numbers | None = None
    row_correlation: Numbers | None = None
    wrong_share: Numbers | None = None
    bursts: tuple[Vector, ...] | None = None
    moving_share: Numbers | None = None


WHOLE = ("gyro_bias", "blackouts", "bursts")
"""settings whose value is itself a list"""


def drives(wanted: Drives) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Every combination: all settings of the drive, and those of them that differ between drives.

    Raises DriveError for a drive that cannot be.
    """
    given = {name: value for name, value in wanted if value is not None}
    choices = {name: _choices(name, value) for name, value in given.items()}
    for name, values in choices.items():
        if not values or len(set(values)) < len(values):
            raise DriveError(name, "a value is named twice; name it once" if values else "the list is empty")
    if prod(map(len, choices.values())) > MOST_DRIVES:
        name = max(choices, key=lambda name: len(choices[name]))
        raise DriveError(name, f"all lists together make more than {MOST_DRIVES} drives; ask for less")
    for values in product(*choices.values()):
        settings = dict(zip(choices, values, strict=True))
        try:
            Simulation(**settings)
        except InputError as error:
            name, _, said = str(error).partition(": ")
            raise DriveError(name, said) from None
        yield settings, {name: value for name, value in settings.items() if len(choices[name]) > 1}


class DriveError(InputError):
    """A setting of a drive that cannot be."""

    def __init__(self, setting: str, sentence: str) -> None:
        super().__init__(f"{setting}: {sentence}")
        self.setting, self.sentence = setting, sentence


def _choices(name: str, value: Any) -> tuple[Any, ...]:
    if isinstance(value, Range):
        return value.values
    return value if isinstance(value, tuple) and name not in WHOLE else (value,)
