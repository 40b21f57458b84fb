"""The reference: iSAM2 over the whole graph, frame by frame."""

import time
from collections.abc import Collection

import gtsam
import numpy as np

from fgbaseline.data.estimate import Event, EventKind, Landmarks, Progress
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from ..errors import IndeterminateSystemError
from ..frame_update import Arrival, add_recovering
from ..graph.cheirality import UNDONE, undone
from ..graph.gtsam_conversions import landmarks_of, pose_covariances, poses_of
from ..graph.keys import distance_key, landmark_of, pose_key
from ..graph_builder import Arrivals
from .elimination_ordering import Chronology
from .marginalized_isam2 import NO_POSE, MovingTree, earliest_tracked
from .settings import ISAM2Settings

PRIOR = -1
"""stands for an observation where a factor is the landmark's prior"""
UNSETTLED = 4
"""updates that all relinearise, from one on whose landmarks are all new: they and the last poses start far off"""
SETTLING_UPDATES = 8
"""at most; three to five are usual"""


class FrameLostError(Exception):
    """A frame's observations would have to be given up, to which QR may be an answer."""

    def __init__(self, frame: int) -> None:
        super().__init__(f"frame {frame}")
        self.frame = frame


class IncrementalSmoother:
    """Builds and solves the graph frame by frame, and keeps what was given up on the way."""

    def __init__(self, problem: Problem, settings: ISAM2Settings) -> None:
        self.solver = MovingTree(settings.params(problem.sequence.camera.baseline))
        self._settings = settings
        self.problem = problem
        self._may_lose_frames = settings.careful or problem.landmark_prior is not None
        self.arrivals = Arrivals(problem, settings.entry)
        self.online_covariance = np.full((problem.n_frames, 6, 6), np.nan)
        self.key: dict[int, int] = {}
        """of each landmark in the graph"""
        self._slots: dict[int, dict[int, int]] = {}
        """landmark -> {observation, or PRIOR: slot of its factor in the graph}"""
        self._dropped: set[int] = set()
        self.n_frames = 0
        """in the graph"""
        self._unsettled = 0
        """frames for which every update relinearises"""
        self._chronology = Chronology()
        self._first = 0
        """frame in the tree"""
        self._shorten_at = settings.tree_frames
        """frame"""
        self.events: list[Event] = []

    def run(self, seconds: FloatArray, progress: Progress | None) -> None:
        """All frames; `seconds` (T,) is filled. Raises GivenUpError, and FrameLostError unless by QR already (or under
        landmark priors, whose graph QR has not been seen to rescue)."""
        T = self.problem.n_frames
        for k, observed in enumerate(self.arrivals.observations.by_frame(T)):
            start = time.perf_counter()
            self._frame(k, range(observed.start, observed.stop))
            seconds[k] = time.perf_counter() - start
            if progress is not None:
                progress(k + 1, T)

    def settle(self) -> None:
        """After the last frame: updates without anything new, until every variable is within its threshold."""
        for _ in range(SETTLING_UPDATES):
            try:
                if self.solver.relinearised() == 0:
                    return
            except IndeterminateSystemError:  # the tree is as it was, and so good enough
                return

    def _frame(self, k: int, observed: range) -> None:
        arrival = self._reached(self.arrivals.next(k, observed, self.key, self._dropped))
        landmarks, events = add_recovering(self, arrival)
        if not self._may_lose_frames and any(event.kind == EventKind.FRAME_WITHOUT_OBSERVATIONS for event in events):
            raise FrameLostError(k)
        self.n_frames = k + 1
        self._dropped |= landmarks
        self.events += events
        tree = self.solver.tree
        self.arrivals.path[k] = tree.calculateEstimatePose3(pose_key(k)).matrix()
        self.online_covariance[k] = pose_covariances(self.problem, [tree.marginalCovariance(pose_key(k))], k)[0]
        for j in self.arrivals.landmarks_seen(observed).tolist():
            if j in self.key and j not in self._dropped:
                self.arrivals.position[j] = tree.calculateEstimatePoint3(self.key[j])
        if k >= self._shorten_at:
            self._shorten(k)

    def _shorten(self, k: int) -> None:
        """After frame k: what is far behind leaves the tree, unless a track that is alive hangs on it."""
        kept = self._settings.kept_frames
        first = min(k + 1 - kept, earliest_tracked(self.arrivals.observations, k))
        self._shorten_at = k + kept
        if first < self._first + kept:
            return
        if self.solver.shortened(first, self._chronology.anew(first, k)):
            self._first = first
            self._shorten_at = first + self._settings.tree_frames

    def _reached(self, arrival: Arrival) -> Arrival:
        """The arrival, after the tree has gone back to frame 0 where it names what left the tree: that could not be
        known when the tree was exchanged. Where GTSAM fails, the arrival without the landmarks that reach back."""
        frame, back = self.arrivals.frame, {j for j in arrival.seen if self.solver.has_left(self.key[j])}
        back |= {e.landmark for e in arrival.entries if frame[e.observation[0]] < self._first}
        if not back:
            return arrival
        k, new = arrival.frame, back - self._dropped
        if new and self.solver.restored(self._chronology.anew(0, k - 1)):
            self._first = 0
            self._shorten_at = max(self._shorten_at, 2 * k)  # so that all of these together cost no more than one
            return arrival
        self.events += [
            Event(k, EventKind.LANDMARK_DROPPED, "it came back, and the tree cannot go back", j) for j in sorted(new)
        ]
        self._dropped |= new
        return arrival.without(back)

    def add(self, arrival: Arrival, given_up: Collection[int]) -> None:
        """See `arrival.Graph`."""
        k, factors = arrival.frame, self.arrivals.factors
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        values.insert(pose_key(k), gtsam.Pose3(arrival.guess))
        graph.push_back(arrival.motion)
        owner: list[tuple[int, int]] = []
        new = {e.landmark: distance_key(e.landmark, self._baselines(e.start, arrival.guess)) for e in arrival.entries}
        for entry in arrival.entries:
            j, key = entry.landmark, new[entry.landmark]
            values.insert(key, entry.start)
            if self.problem.landmark_prior is not None:
                graph.push_back(factors.landmark_prior(j, key))
                owner.append((j, PRIOR))
            for i in entry.observation:
                graph.push_back(self.arrivals.stereo(i, key))
                owner.append((j, i))
        for j, i in arrival.seen.items():
            graph.push_back(self.arrivals.stereo(i, self.key[j]))
            owner.append((j, i))
        if arrival.entries and not arrival.seen:
            self._unsettled = UNSETTLED
        sighted = [*new.values(), *(self.key[j] for j in arrival.seen)]
        there = [j for j in given_up if j in self.key]
        removed = [slot for j in there for slot in self._slots[j].values()]
        self._chronology.forget([self.key[j] for j in there])
        groups = self._chronology.groups(k, sighted, first=self._first, fresh=self._unsettled > 0)
        frames = [max(k - 1, 0), *(NO_POSE if i == PRIOR else self.arrivals.frame[i] for _, i in owner)]
        try:
            slots = self.solver.update(graph, frames, values, pose_key(k), removed, groups, self._unsettled > 0)
        except IndeterminateSystemError:
            self._chronology.forget(new.values())
            raise
        self._unsettled = max(0, self._unsettled - 1)
        for j in there:
            del self.key[j], self._slots[j]
        self.key |= new
        for (j, i), slot in zip(owner, slots[1:], strict=True):
            self._slots.setdefault(j, {})[i] = slot

    def suspects(self, error: IndeterminateSystemError, given_up: Collection[int]) -> dict[int, str]:
        """See `arrival.Graph`.

        GTSAM names a variable near the trouble, seldom the culprit. That is a landmark which the last solution sent
        behind a camera or onto its plane; only where there is none, the named one is taken.
        """
        culprits = [j for j in self._undone(self.solver.estimate()) if j not in given_up]
        if culprits:
            return dict.fromkeys(culprits, UNDONE)
        named = None if error.key is None else landmark_of(error.key)
        if named is None or named in given_up or named in self._dropped:
            return {}
        return {named: "the system was indeterminate near it"}

    def _undone(self, values: gtsam.Values) -> list[int]:
        if not self.key:
            return []
        o = self.arrivals.observations.select(self.used())
        return undone(self.problem, o, poses_of(values, range(self.n_frames)), landmarks_of(values, self.key))

    def released(self) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """After the last frame: the factors in their slots, and the solution. The tree is gone, as large as it is."""
        graph, values = self.solver.released()
        there = set(self.key.values())
        for key in values.keys():  # noqa: SIM118
            if landmark_of(key) is not None and key not in there:  # given up, and still in the prior
                values.erase(key)
        return graph, values

    def drop_undone(self, graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> bool:
        """Takes every landmark whose geometry came undone out of what `released` gave; False if there is none.

        Such a landmark pulls at nothing (its Jacobian is zero) and its residual means nothing.
        """
        given_up = self._undone(values)
        for j in given_up:
            for slot in self._slots.pop(j).values():
                graph.remove(slot)
            values.erase(self.key.pop(j))
        last = self.problem.n_frames - 1
        self.events += [Event(last, EventKind.LANDMARK_DROPPED, UNDONE, landmark) for landmark in given_up]
        return bool(given_up)

    def used(self) -> BoolArray:
        """Which of the problem's observations are in the graph."""
        used = np.zeros(len(self.arrivals.observations), dtype=np.bool_)
        used[[i for slots in self._slots.values() for i in slots if i != PRIOR]] = True
        return used

    def online_landmarks(self) -> Landmarks:
        """Every landmark as known at the frame that saw it last."""
        position = self.arrivals.position
        index = np.sort(np.fromiter(position, dtype=np.int64))
        return Landmarks(index, np.array([position[int(j)] for j in index]).reshape(-1, 3))

    def _baselines(self, point: FloatArray, world_T_imu: FloatArray) -> float:
        return float(np.linalg.norm(point - world_T_imu[:3, 3])) / self.problem.sequence.camera.baseline
