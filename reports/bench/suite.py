"""The suite file: which sequences, which estimators, which settings to go through, in TOML."""

from pathlib import Path
from typing import Annotated, Literal, TypeAlias, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from fgbaseline.data.formats import BodyFrame
from fgbaseline.data.toml_file import TomlFile, read_toml
from fgbaseline.diagnosis.repair_overrides.settings import SigmaOverrides
from fgbaseline.reports.run.problem import RunSettings

from .simulated_cases import Drives

Page: TypeAlias = Literal["none", "tables", "figures"]
Preset: TypeAlias = Literal["calibrated", "documented"]
Features: TypeAlias = Annotated[int, Field(ge=1)] | Literal["all"]
Noise: TypeAlias = Literal["estimated", "assumed"] | SigmaOverrides
Share: TypeAlias = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Seed: TypeAlias = Annotated[int, Field(ge=0)]
MOST_SEEDS = 10_000


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def _name(text: str) -> str:
    if not text.strip() or not text.isprintable() or any(c in text for c in "/\\*?[]"):
        raise ValueError("it should be a word or two without slashes, brackets and wildcards; write another")
    return text


Name: TypeAlias = Annotated[str, AfterValidator(_name)]


class Seeds(_Part):
    """So many seeds from a first one on."""

    count: Annotated[int, Field(ge=1, le=MOST_SEEDS)]
    first: Seed = 0


class Entry(_Part):
    """A recording, several, or simulated drives."""

    name: Name | None = None
    """of drives, or of a single recording; recordings are otherwise called as their files"""
    files: str | Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    """paths or globs; relative ones from the suite's folder, or from --data"""
    leave_out: str | tuple[str, ...] = ()
    """globs of files that do not count among `files`"""
    truth: str | None = None
    truth_frame: BodyFrame | None = None
    repairs: str | None = None
    """TOML file of repairs by hand"""
    simulate: Drives | None = None
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] | Seeds | None = None
    """of the drives; a single one, 0, where they are left out"""

    @model_validator(mode="after")
    def _is_something(self) -> "Entry":
        if (self.files is None) == (self.simulate is None):
            raise ValueError("a sequence is recorded or simulated; give either files or simulate")
        if self.simulate is not None:
            for key in ("truth", "truth_frame", "repairs", "leave_out"):
                if getattr(self, key):
                    raise ValueError(f"{key} is for recordings, and simulated drives need none; leave it out")
        elif self.seeds is not None:
            raise ValueError("seeds are for simulated drives, and a recording has one course; leave them out")
        if (self.truth is None) != (self.truth_frame is None):
            raise ValueError(
                'truth needs to be told whose poses it has; give truth and truth_frame ("camera" or "imu")'
            )
        if isinstance(self.seeds, tuple) and len(set(self.seeds)) < len(self.seeds):
            raise ValueError("seeds names one twice; name it once")
        return self

    @property
    def patterns(self) -> tuple[str, ...]:
        """`files`, however they were written."""
        return several(self.files) if self.files is not None else ()

    @property
    def seed_numbers(self) -> tuple[int, ...]:
        """The seeds one by one."""
        if isinstance(self.seeds, Seeds):
            return tuple(range(self.seeds.first, self.seeds.first + self.seeds.count))
        return (0,) if self.seeds is None else self.seeds


class Sweep(_Part):
    """Settings of a run; of each that is a list, every value is run with every value of the others."""

    preset: Preset | Annotated[tuple[Preset, ...], Field(min_length=1)] = "calibrated"
    features: Features | Annotated[tuple[Features, ...], Field(min_length=1)] | None = None
    """None for the preset's default"""
    noise: Noise | Annotated[tuple[Noise, ...], Field(min_length=1)] | None = None
    """of the calibrated preset: estimated from the recording (the default), assumed for all of them, or given"""
    landmarks: (
        Literal["in-turn", "held"] | Annotated[tuple[Literal["in-turn", "held"], ...], Field(min_length=1)] | None
    ) = None
    """of the documented preset"""
    held_out: Share | Annotated[tuple[Share, ...], Field(min_length=1)] = 0.0


class Suite(_Part):
    """The file."""

    name: Name
    estimators: Annotated[tuple[str, ...], Field(min_length=1)] = RunSettings().estimators
    page: Page = "tables"
    """what each run leaves for people: nothing, a page without figures, or all of it"""
    sweep: Sweep = Sweep()
    sequence: Annotated[tuple[Entry, ...], Field(min_length=1)]


Item = TypeVar("Item")


def several(value: Item | tuple[Item, ...]) -> tuple[Item, ...]:
    """A value that may be one or many, as many."""
    return value if isinstance(value, tuple) else (value,)


def read_suite(path: Path) -> TomlFile[Suite]:
    """The suite in a file. Raises InputError naming file, place and what is allowed."""
    return read_toml(path, Suite)
