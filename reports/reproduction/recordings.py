"""What is reproduced: the recordings that were given, and what stands in for one without features."""

from collections.abc import Sequence as Several
from dataclasses import dataclass
from pathlib import Path

from fgbaseline.data import Sequence, read
from fgbaseline.geometry import InputError

from .stand_in import StandIn, stand_in
from .the_report import Reported, reported


@dataclass(frozen=True, eq=False, slots=True)
class Subject:
    """A recording, and what the filter is run on."""

    recorded: Sequence
    reported: Reported | None
    """what the report says of it; None for a recording that is not the report's"""
    stand_in: StandIn | None = None
    """simulated where the recording has no features"""

    @property
    def name(self) -> str:
        """As tables and figures call it."""
        return self.recorded.name if self.reported is None else self.reported.name

    @property
    def studied(self) -> Sequence:
        """The recording whose features the filter sees."""
        return self.recorded if self.stand_in is None else self.stand_in.sequence

    @property
    def label(self) -> str:
        """The name of what the filter is run on."""
        return self.name if self.stand_in is None else f"{self.name}, simulated features"


def read_subjects(paths: Several[Path]) -> list[Subject]:
    """The recordings in the report's order, each given once, those without features with a stand-in.

    Raises InputError for what cannot be read, and for a recording that is given twice.
    """
    every = [read(path) for path in paths]
    for i, sequence in enumerate(every):
        for before in every[:i]:
            if _same(before, sequence):
                raise InputError(
                    f"{paths[i]}: this is the same recording as {before.source or before.name}; give each once"
                )
    _require_different_names(paths, every)
    subjects = [Subject(s, reported(s.n_frames), None if len(s.observations) else stand_in(s)) for s in every]
    return sorted(subjects, key=lambda subject: "~" if subject.reported is None else subject.reported.name)


def _require_different_names(paths: Several[Path], every: Several[Sequence]) -> None:
    taken: dict[str, Path] = {}
    for path, sequence in zip(paths, every, strict=True):
        told = reported(sequence.n_frames)
        name = sequence.name if told is None else told.name
        if name in taken:
            as_what = f"is called {name}" if told is None else f"has the {told.frames} frames of the report's {name}"
            raise InputError(f"{path}: it {as_what}, as {taken[name]} does; give one of them at a time")
        taken[name] = path


def _same(one: Sequence, other: Sequence) -> bool:
    """Of the same drive: 10.npz and its velocities alone are."""
    if one.n_frames != other.n_frames:
        return False
    return bool((one.t == other.t).all() and (one.linear_velocity == other.linear_velocity).all())
