"""Recordings of a reproduction: the report's two and what it shows of each, those given, and their stand-ins."""

from collections.abc import Mapping
from collections.abc import Sequence as Several
from dataclasses import dataclass, field
from pathlib import Path

from fgbaseline.data import Sequence, read
from fgbaseline.geometry import InputError

from .stand_in import StandIn, stand_in

MAPPED = (700, 1000)
"""numbers of features of figures 5 to 8"""


@dataclass(frozen=True, slots=True)
class Reported:
    """A recording of the report: its size there, and the numbers of the figures that show it."""

    name: str
    frames: int
    tracks: int
    path: int
    """number of the figure with the predicted path"""
    arrows: int
    """the same with orientations"""
    mapped: Mapping[int, int] = field(default_factory=dict)
    """number of features -> number of the figure after landmark mapping"""
    slam: int | None = None
    """the figure after SLAM; None where the report has none, its filter having failed"""


REPORTED = (
    Reported("03.npz", 1010, 5105, path=1, arrows=4, mapped={700: 7, 1000: 8}, slam=9),
    Reported("10.npz", 3026, 13_289, path=2, arrows=3, mapped={700: 5, 1000: 6}),
)


def reported(frames: int) -> Reported | None:
    """The recording of the report that has so many frames; its files are known by that and not by their names."""
    return next((recording for recording in REPORTED if recording.frames == frames), None)


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
        known = reported(sequence.n_frames)
        name = sequence.name if known is None else known.name
        if name in taken:
            as_what = f"is called {name}" if known is None else f"has the {known.frames} frames of the report's {name}"
            raise InputError(f"{path}: it {as_what}, as {taken[name]} does; give one of them at a time")
        taken[name] = path


def _same(one: Sequence, other: Sequence) -> bool:
    """Of the same drive: 10.npz and its velocities alone are."""
    if one.n_frames != other.n_frames:
        return False
    return bool((one.t == other.t).all() and (one.linear_velocity == other.linear_velocity).all())
