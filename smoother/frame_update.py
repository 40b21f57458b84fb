"""Update of the factor graph by one frame, with recovery from an indeterminate system."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import gtsam

from fgbaseline.data.estimators.estimate import Event, EventKind
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray

from .errors import IndeterminateSystemError, UnrecoverableError
from .initialization.landmark_initialization import NewLandmark

MAX_ATTEMPTS = 20
"""Attempts to solve a frame with fewer landmarks before all its observations are dropped."""
DROPPED: Mapping[str, tuple[str, str]] = {
    EventKind.LANDMARK_DROPPED: ("landmark", "landmarks"),
    EventKind.FRAME_WITHOUT_OBSERVATIONS: ("frame's observations", "frames' observations"),
}
"""kind of event -> noun for what it drops, singular and plural"""


@dataclass(frozen=True, eq=False, slots=True)
class FrameUpdate:
    """New frame with its factors: motion, new landmarks and observations."""

    frame: int
    initial_pose: FloatArray
    """(4, 4) world_T_imu, initial value"""
    initial_values: gtsam.Values
    """initial values of the frame's variables"""
    motion_factor: gtsam.NonlinearFactor
    """motion from the previous frame, or the prior of the first one"""
    new_landmarks: tuple[NewLandmark, ...]
    tracked: Mapping[int, int]
    """landmark that is in the graph -> index of its observation in this frame"""

    def without(self, landmarks: Collection[int]) -> "FrameUpdate":
        """Update without the new landmarks and observations of some landmarks."""
        new = tuple(entry for entry in self.new_landmarks if entry.landmark not in landmarks)
        return replace(self, new_landmarks=new, tracked={j: i for j, i in self.tracked.items() if j not in landmarks})

    def without_observations(self) -> "FrameUpdate":
        """Update by the motion alone."""
        return replace(self, new_landmarks=(), tracked={})


class IncrementalGraph(Protocol):
    """Incremental solver that frame updates are added to."""

    def add(self, update: FrameUpdate, dropped: Collection[int]) -> None:
        """Add a frame and remove the factors of the `dropped` landmarks, atomically.

        Raises IndeterminateSystemError, with the graph unchanged, where the result is indeterminate.
        """

    def suspect_landmarks(self, error: IndeterminateSystemError, dropped: Collection[int]) -> dict[int, str]:
        """Further landmarks that may have caused a failure -> reason."""


class Recovery(NamedTuple):
    """Landmarks dropped by a frame update, with the events."""

    landmarks: frozenset[int]
    events: tuple[Event, ...]


def add_with_recovery(graph: IncrementalGraph, update: FrameUpdate) -> Recovery:
    """Add a frame; if the system is indeterminate, without suspect landmarks, and at last without observations.

    Raises UnrecoverableError.
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
    reason = "its observations left the system indeterminate and were dropped"
    lost = Event(update.frame, EventKind.FRAME_WITHOUT_OBSERVATIONS, reason)
    return Recovery(landmarks | {entry.landmark for entry in update.new_landmarks}, (*events, lost))


def recovery_reason(events: Iterable[Event]) -> str:
    """Losses among the events of a run, as the reason of the status `recovered`; empty where there are none.

    Landmarks that were never determined are no loss by themselves, and are counted only beside others.
    """
    count = Counter(event.kind for event in events)
    never = count.pop(EventKind.LANDMARK_NEVER_DETERMINED, 0)
    lost = [
        f"{plural(n, *DROPPED[kind])} dropped" if kind in DROPPED else f"{kind} ({n:,})"
        for kind, n in sorted(count.items())
        if kind != EventKind.SOLVED_BY_QR
    ]
    others = [f"{plural(never, 'other landmark')} never determined"] if never else []
    return "; ".join([*lost, *others]) if lost else ""


def _recovery(frame: int, dropped: Mapping[int, str]) -> Recovery:
    events = tuple(Event(frame, EventKind.LANDMARK_DROPPED, why, landmark) for landmark, why in dropped.items())
    return Recovery(frozenset(dropped), events)
