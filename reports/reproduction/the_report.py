"""What the report has: its two recordings, which figure shows what, and the settings it names."""

from collections.abc import Mapping
from dataclasses import dataclass, field

MAPPED = (700, 1000)
"""numbers of features of figures 5 to 8"""
TRACKS_PER_FRAME = 13_289 / 3_026
"""of 10.npz: new tracks a frame, which a recording simulated in its place has too"""


@dataclass(frozen=True, slots=True)
class Reported:
    """A recording of the report: what it says of it, and under which number it shows what."""

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
