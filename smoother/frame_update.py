"""What a frame brings to the graph, and how it is added so that a failure costs as little as possible."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import gtsam

from fgbaseline.data.estimate import Event, EventKind
from fgbaseline.geometry import FloatArray

from .errors import GivenUpError, IndeterminateSystemError
from .initialization.landmark_initialization import Entry

ATTEMPTS = 20
"""at solving a frame with fewer landmarks, before its observations are given up instead"""


@dataclass(frozen=True, eq=False, slots=True)
class Arrival:
    """A new pose with all that ties it to the graph."""

    frame: int
    guess: FloatArray
    """(4, 4) where the pose starts"""
    motion: gtsam.NonlinearFactor
    """from the frame before, or the prior of the first pose"""
    entries: tuple[Entry, ...]
    seen: Mapping[int, int]
    """landmark in the graph -> its observation in this frame"""

    def without(self, landmarks: Collection[int]) -> "Arrival":
        """The same, but some landmarks neither enter nor are seen."""
        entries = tuple(entry for entry in self.entries if entry.landmark not in landmarks)
        return replace(self, entries=entries, seen={j: i for j, i in self.seen.items() if j not in landmarks})

    def motion_alone(self) -> "Arrival":
        """The same without any observation."""
        return replace(self, entries=(), seen={})


class Graph(Protocol):
    """What an arrival is added to."""

    def add(self, arrival: Arrival, given_up: Collection[int]) -> None:
        """Adds a frame and takes out what is there of some landmarks; all or nothing.

        Raises IndeterminateSystemError, nothing being changed, where the result has no solution.
        """

    def suspects(self, error: IndeterminateSystemError, given_up: Collection[int]) -> dict[int, str]:
        """Further landmarks that may have caused a failure, each with the reason."""


class GivenUp(NamedTuple):
    """What a frame has cost."""

    landmarks: frozenset[int]
    events: tuple[Event, ...]


def add_recovering(graph: Graph, arrival: Arrival) -> GivenUp:
    """Adds a frame; where the system is indeterminate, without the suspects, or else without its observations.

    Raises GivenUpError.
    """
    given_up: dict[int, str] = {}
    for _ in range(ATTEMPTS):
        try:
            graph.add(arrival.without(given_up), given_up)
            return _told(arrival.frame, given_up)
        except IndeterminateSystemError as error:
            suspects = graph.suspects(error, given_up)
        if not suspects:
            break
        given_up |= suspects
    try:
        graph.add(arrival.motion_alone(), given_up)
    except IndeterminateSystemError as error:
        text = f"the system stays indeterminate at frame {arrival.frame} even without its observations"
        raise GivenUpError(text) from error
    dropped, events = _told(arrival.frame, given_up)
    reason = "its observations left the system indeterminate and were given up"
    lost = Event(arrival.frame, EventKind.FRAME_WITHOUT_OBSERVATIONS, reason)
    return GivenUp(dropped | {entry.landmark for entry in arrival.entries}, (*events, lost))


def _told(frame: int, given_up: Mapping[int, str]) -> GivenUp:
    events = tuple(Event(frame, EventKind.LANDMARK_DROPPED, why, landmark) for landmark, why in given_up.items())
    return GivenUp(frozenset(given_up), events)
