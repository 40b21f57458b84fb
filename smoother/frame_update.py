"""What a frame brings to the graph, and how it is added so that a failure costs as little as possible."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import gtsam

from fgbaseline.data.estimate import Event, EventKind
from fgbaseline.geometry import FloatArray

from .errors import IndeterminateSystemError, UnrecoverableError
from .initialization.landmark_initialization import NewLandmark

MAX_ATTEMPTS = 20
"""at solving a frame with fewer landmarks, before its observations are given up instead"""


@dataclass(frozen=True, eq=False, slots=True)
class FrameUpdate:
    """A new pose with all that ties it to the graph."""

    frame: int
    initial_pose: FloatArray
    """(4, 4) where the pose starts"""
    motion_factor: gtsam.NonlinearFactor
    """from the frame before, or the prior of the first pose"""
    new_landmarks: tuple[NewLandmark, ...]
    tracked: Mapping[int, int]
    """landmark in the graph -> its observation in this frame"""

    def without(self, landmarks: Collection[int]) -> "FrameUpdate":
        """The same, but some landmarks neither enter nor are seen."""
        new = tuple(entry for entry in self.new_landmarks if entry.landmark not in landmarks)
        return replace(self, new_landmarks=new, tracked={j: i for j, i in self.tracked.items() if j not in landmarks})

    def without_observations(self) -> "FrameUpdate":
        """The same without any observation."""
        return replace(self, new_landmarks=(), tracked={})


class IncrementalGraph(Protocol):
    """What an update is added to."""

    def add(self, update: FrameUpdate, dropped: Collection[int]) -> None:
        """Adds a frame and takes out what is there of some landmarks; all or nothing.

        Raises IndeterminateSystemError, nothing being changed, where the result has no solution.
        """

    def suspect_landmarks(self, error: IndeterminateSystemError, dropped: Collection[int]) -> dict[int, str]:
        """Further landmarks that may have caused a failure, each with the reason."""


class Recovery(NamedTuple):
    """What a frame has cost."""

    landmarks: frozenset[int]
    events: tuple[Event, ...]


def add_with_recovery(graph: IncrementalGraph, update: FrameUpdate) -> Recovery:
    """Adds a frame; where the system is indeterminate, without the suspects, or else without its observations.

    Raises GivenUpError.
    """
    dropped: dict[int, str] = {}
    for _ in range(MAX_ATTEMPTS):
        try:
            graph.add(update.without(dropped), dropped)
            return _recovery(update.frame, dropped)
        except IndeterminateSystemError as error:
            suspects = graph.suspect_landmarks(error, dropped)
        if not suspects:
            break
        dropped |= suspects
    try:
        graph.add(update.without_observations(), dropped)
    except IndeterminateSystemError as error:
        text = f"the system stays indeterminate at frame {update.frame} even without its observations"
        raise UnrecoverableError(text) from error
    landmarks, events = _recovery(update.frame, dropped)
    reason = "its observations left the system indeterminate and were given up"
    lost = Event(update.frame, EventKind.FRAME_WITHOUT_OBSERVATIONS, reason)
    return Recovery(landmarks | {entry.landmark for entry in update.new_landmarks}, (*events, lost))


def _recovery(frame: int, dropped: Mapping[int, str]) -> Recovery:
    events = tuple(Event(frame, EventKind.LANDMARK_DROPPED, why, landmark) for landmark, why in dropped.items())
    return Recovery(frozenset(dropped), events)
