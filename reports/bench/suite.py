"""The suite file, in TOML: sequences, simulated drives, estimators, and the settings to sweep."""

from collections.abc import Iterator
from itertools import product
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from fgbaseline.data.formats import BodyFrame
from fgbaseline.data.formats.files.toml_file import TomlFile, read_toml
from fgbaseline.data.simulate import Simulation
from fgbaseline.diagnosis.repair_overrides.settings import SigmaOverrides
from fgbaseline.geometry import InputError

from ..problem.settings import RunSettings
from ..results.parts import Finite, Part

Page: TypeAlias = Literal["none", "tables", "figures"]
Preset: TypeAlias = Literal["calibrated", "documented"]
Features: TypeAlias = Annotated[int, Field(ge=1)] | Literal["all"]
Noise: TypeAlias = Literal["estimated", "assumed"] | SigmaOverrides
Share: TypeAlias = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Seed: TypeAlias = Annotated[int, Field(ge=0)]
Landmarks: TypeAlias = Literal["in-turn", "held"]
MOST_SEEDS, MOST_STEPS, MOST_DRIVES = 10_000, 1000, 10_000
Item = TypeVar("Item")
OneOrMore: TypeAlias = Item | Annotated[tuple[Item, ...], Field(min_length=1)]
"""a value, or a list of values"""


class Range(Part):
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
        """The numbers, including both ends."""
        return tuple(float(f"{value:.12g}") for value in np.linspace(self.start, self.to, self.steps))


Numbers: TypeAlias = Finite | tuple[Finite, ...] | Range
Shape: TypeAlias = Literal["town", "loop", "highway", "handheld"]
World: TypeAlias = Literal["street", "room"]
Interval: TypeAlias = Literal["after", "before", "mean"]
Vector: TypeAlias = tuple[Finite, Finite, Finite]


class Drives(Part):
    """Options of `fgbaseline simulate`; None for its defaults."""

    path: Shape | tuple[Shape, ...] | None = None
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


def _name(text: str) -> str:
    if not text.strip() or not text.isprintable() or any(c in text for c in "/\\*?[]"):
        raise ValueError("it must have no slashes, brackets and wildcards; write another name")
    return text


Name: TypeAlias = Annotated[str, AfterValidator(_name)]


class Seeds(Part):
    """Consecutive seeds."""

    count: Annotated[int, Field(ge=1, le=MOST_SEEDS)]
    first: Seed = 0


class Entry(Part):
    """One or more recordings, or simulated drives."""

    name: Name | None = None
    """name of drives, or of a single recording; other recordings have the names of their files"""
    files: OneOrMore[str] | None = None
    """paths or globs; relative ones from the suite's folder, or from --data"""
    leave_out: str | tuple[str, ...] = ()
    """globs of files to exclude from `files`"""
    truth: str | None = None
    truth_frame: BodyFrame | None = None
    repairs: str | None = None
    """TOML file of user-specified repairs"""
    simulate: Drives | None = None
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] | Seeds | None = None
    """seeds of the drives; None for the single seed 0"""

    @model_validator(mode="after")
    def _is_something(self) -> "Entry":
        if (self.files is None) == (self.simulate is None):
            raise ValueError("a sequence is either recorded or simulated; give files or simulate")
        if self.simulate is not None:
            for key in ("truth", "truth_frame", "repairs", "leave_out"):
                if getattr(self, key):
                    raise ValueError(f"{key} is for recordings, not for simulated drives; leave it out")
        elif self.seeds is not None:
            raise ValueError("seeds are for simulated drives, not for recordings; leave them out")
        if (self.truth is None) != (self.truth_frame is None):
            raise ValueError('truth and truth_frame, the body of its poses ("camera" or "imu"), go together; give both')
        if isinstance(self.seeds, tuple) and len(set(self.seeds)) < len(self.seeds):
            raise ValueError("a seed is given twice; give it once")
        return self

    @property
    def patterns(self) -> tuple[str, ...]:
        """The patterns of `files`, one or several."""
        return several(self.files) if self.files is not None else ()

    @property
    def seed_numbers(self) -> tuple[int, ...]:
        """All seeds."""
        if isinstance(self.seeds, Seeds):
            return tuple(range(self.seeds.first, self.seeds.first + self.seeds.count))
        return (0,) if self.seeds is None else self.seeds


class Sweep(Part):
    """Settings of the runs; every combination of the listed values is run."""

    preset: OneOrMore[Preset] = "calibrated"
    features: OneOrMore[Features] | None = None
    """None for the preset's default"""
    noise: OneOrMore[Noise] | None = None
    """noise of the calibrated preset: estimated from the recording (default), assumed, or given standard deviations"""
    landmarks: OneOrMore[Landmarks] | None = None
    """landmark mode of the documented preset"""
    held_out: OneOrMore[Share] = 0.0


class Suite(Part):
    """A suite of benchmark runs."""

    name: Name
    estimators: Annotated[tuple[str, ...], Field(min_length=1)] = RunSettings().estimators
    page: Page = "tables"
    """report of each run: none, with tables only, or with figures"""
    sweep: Sweep = Sweep()
    sequence: Annotated[tuple[Entry, ...], Field(min_length=1)]


def several(value: Item | tuple[Item, ...]) -> tuple[Item, ...]:
    """A single value or a tuple, as a tuple."""
    return value if isinstance(value, tuple) else (value,)


def read_suite(path: Path) -> TomlFile[Suite]:
    """Reads a suite file. Raises InputError with the file, the key path and the allowed values."""
    return read_toml(path, Suite)


WHOLE = ("gyro_bias", "blackouts", "bursts")
"""settings whose value is itself a list"""


def drives(wanted: Drives) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Yields every combination: all settings of a drive, and those of them that differ between drives.

    Raises DriveError for invalid settings.
    """
    given = {name: value for name, value in wanted if value is not None}
    choices = {name: _choices(name, value) for name, value in given.items()}
    for name, values in choices.items():
        if not values or len(set(values)) < len(values):
            raise DriveError(name, "a value is given twice; give it once" if values else "the list is empty")
    if prod(map(len, choices.values())) > MOST_DRIVES:
        name = max(choices, key=lambda name: len(choices[name]))
        raise DriveError(name, f"all lists together give more than {MOST_DRIVES} drives; shorten one")
    for values in product(*choices.values()):
        settings = dict(zip(choices, values, strict=True))
        try:
            Simulation(**settings)
        except InputError as error:
            name, _, said = str(error).partition(": ")
            raise DriveError(name, said) from None
        yield settings, {name: value for name, value in settings.items() if len(choices[name]) > 1}


class DriveError(InputError):
    """An invalid setting of a drive."""

    def __init__(self, setting: str, sentence: str) -> None:
        super().__init__(f"{setting}: {sentence}")
        self.setting, self.sentence = setting, sentence


def _choices(name: str, value: Any) -> tuple[Any, ...]:
    if isinstance(value, Range):
        return value.values
    return value if isinstance(value, tuple) and name not in WHOLE else (value,)
