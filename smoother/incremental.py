"""The reference: iSAM2 over the whole graph, frame by frame."""

import time
from dataclasses import dataclass, field

import gtsam
import numpy as np

from fgbaseline.data.estimate import Event, Landmarks, Progress
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from .convention import reordered
from .factors import Factors
from .journal import IndeterminateSystemError, RestorableISAM2
from .keys import landmark_of, pose_key, thresholds
from .values import depths, points_of, poses_of
from .waiting import Entry, EntryRule, WaitingLandmarks

ATTEMPTS_PER_FRAME = 20
"""at solving a frame with fewer landmarks, before its observations are given up instead"""
PRIOR = -1
"""stands for an observation where a factor is the landmark's prior"""
MIN_DEPTH = 0.3
"""m; a landmark nearer to the plane of a camera that saw it, or behind it, makes a system indeterminate: its Jacobian
is unbounded, or zero"""
MIN_DISPARITY = 0.05
"""px; so does one so far away that no step along its ray changes what the camera sees"""
UNDONE = "it came to lie behind a camera that saw it, at its plane or at infinity"


@dataclass(frozen=True, slots=True)
class ISAM2Settings:
    """How the graph is solved; none of these moves its optimum."""

    relinearize_position: float = 0.05
    """m, of a pose"""
    relinearize_rotation: float = 0.005
    """rad, of a pose"""
    relinearize_landmark: float = 0.005
    """as a share of its distance"""
    entry: EntryRule = field(default_factory=EntryRule)


class GivenUpError(Exception):
    """The run cannot go on: even a frame's motion alone leaves the system indeterminate."""


@dataclass(eq=False, slots=True)
class _Pending:
    """What a frame brings to the graph, by landmark, so that a landmark can be taken back."""

    motion: list[gtsam.NonlinearFactor]
    entries: dict[int, Entry]
    seen: dict[int, int]
    """landmark in the graph -> its observation in this frame"""
    removed: set[int] = field(default_factory=set)
    """landmarks in the graph that go with this update"""


class IncrementalSmoother:
    """Builds and solves the graph frame by frame, and keeps what was given up on the way."""

    def __init__(self, problem: Problem, settings: ISAM2Settings) -> None:
        params = gtsam.ISAM2Params()
        params.setRelinearizeThreshold(
            thresholds(settings.relinearize_position, settings.relinearize_rotation, settings.relinearize_landmark)
        )
        params.relinearizeSkip = 1
        self.isam = RestorableISAM2(params)
        self.problem = problem
        self.observations = problem.observations()
        self.factors = Factors(problem)
        self.waiting = WaitingLandmarks(problem, self.observations, settings.entry)
        self.online = np.full((problem.n_frames, 4, 4), np.nan)
        self.online_covariance = np.full((problem.n_frames, 6, 6), np.nan)
        self.in_graph: dict[int, dict[int, int]] = {}
        """landmark -> {observation, or PRIOR: factor slot}"""
        self.dropped: set[int] = set()
        self._online_landmark: dict[int, FloatArray] = {}
        self.events: list[Event] = []

    def run(self, seconds: FloatArray, progress: Progress | None) -> None:
        """All frames; `seconds` (T,) is filled. Raises GivenUpError."""
        T = self.problem.n_frames
        for k, seen in enumerate(self.observations.by_frame(T)):
            start = time.perf_counter()
            self.add_frame(k, range(seen.start, seen.stop))
            seconds[k] = time.perf_counter() - start
            if progress is not None:
                progress(k + 1, T)

    def add_frame(self, k: int, observed: range) -> None:
        """Frame k with its observations (indices into the problem's)."""
        guess = self.problem.initial_pose if k == 0 else self.online[k - 1] @ self.factors.steps[k - 1]
        self.online[k] = guess
        motion: list[gtsam.NonlinearFactor] = [self.factors.first_pose() if k == 0 else self.factors.motion(k - 1)]
        seen: dict[int, int] = {}
        waiting: list[int] = []
        for i in observed:
            landmark = int(self.observations.landmark[i])
            if landmark in self.in_graph:
                seen[landmark] = i
            elif landmark not in self.dropped:
                self.waiting.add(landmark, i)
                waiting.append(landmark)
        entries = {entry.landmark: entry for entry in self.waiting.enter(waiting, self.online)}
        for entry in entries.values():
            self.factors.key.place(entry.landmark, float(np.linalg.norm(entry.start - guess[:3, 3])))
        self._update(k, guess, _Pending(motion, entries, seen))
        self.online[k] = self.isam.tree.calculateEstimatePose3(pose_key(k)).matrix()
        self.online_covariance[k] = reordered(self.isam.tree.marginalCovariance(pose_key(k)))
        for i in observed:
            landmark = int(self.observations.landmark[i])
            if landmark in self.in_graph:
                self._online_landmark[landmark] = self.isam.tree.calculateEstimatePoint3(self.factors.key(landmark))

    def _update(self, k: int, guess: FloatArray, pending: _Pending) -> None:
        for _ in range(ATTEMPTS_PER_FRAME):
            try:
                return self._try(k, guess, pending)
            except IndeterminateSystemError as error:
                if not self._lighten(k, pending, error):
                    break
        self.events.append(
            Event(k, "frame without observations", "its observations left the system indeterminate and were given up")
        )
        self.dropped.update(pending.entries)
        try:
            self._try(k, guess, _Pending(pending.motion, {}, {}, pending.removed))
        except IndeterminateSystemError as error:
            raise GivenUpError(f"the system stays indeterminate at frame {k} even without its observations") from error

    def _lighten(self, k: int, pending: _Pending, error: IndeterminateSystemError) -> bool:
        """Takes landmarks that may have caused the failure out of `pending` and the graph; False if there is none.

        GTSAM names a variable near the trouble, seldom the culprit. That is a landmark which the last solution sent
        behind a camera or onto its plane; only where there is none, the named one is taken.
        """
        culprits = [j for j in self.undone(k, self.isam.tree.calculateEstimate()) if j not in pending.removed]
        if culprits:
            for landmark in culprits:
                self._drop(k, landmark, pending, UNDONE)
            return True
        named = self._named_landmark(error)
        if named is not None:
            self._drop(k, named, pending, "the system was indeterminate near it")
        return named is not None

    def undone(self, n_frames: int, values: gtsam.Values) -> list[int]:
        """Landmarks in the graph of the first `n_frames` frames that are no point in front of all their cameras."""
        if not self.in_graph:
            return []
        camera = self.problem.sequence.camera
        index = np.sort(np.fromiter(self.in_graph, dtype=np.int64))
        taken = np.sort([i for observed in self.in_graph.values() for i in observed if i != PRIOR])
        o = self.observations.select(taken)
        position = points_of(values, index.tolist(), self.factors.key)
        depth = depths(self.problem, o, poses_of(values, n_frames), index, position)
        sane = (depth > MIN_DEPTH) & (depth < camera.fu * camera.baseline / MIN_DISPARITY)
        return [int(j) for j in np.unique(o.landmark[~sane])]

    def _try(self, k: int, guess: FloatArray, pending: _Pending) -> None:
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        values.insert(pose_key(k), gtsam.Pose3(guess))
        for factor in pending.motion:
            graph.push_back(factor)
        owner: list[tuple[int, int]] = []
        for entry in pending.entries.values():
            values.insert(self.factors.key(entry.landmark), entry.start)
            if self.problem.landmark_prior is not None:
                graph.push_back(self.factors.landmark_prior(entry.landmark))
                owner.append((entry.landmark, PRIOR))
            for i in entry.observation:
                graph.push_back(self._stereo(entry.landmark, i))
                owner.append((entry.landmark, i))
        for landmark, i in pending.seen.items():
            graph.push_back(self._stereo(landmark, i))
            owner.append((landmark, i))
        slots = [slot for landmark in pending.removed for slot in self.in_graph[landmark].values()]
        result = self.isam.update(graph, values, slots)
        for landmark in pending.removed:
            del self.in_graph[landmark]
        new_slots = result.getNewFactorsIndices()
        for (landmark, i), slot in zip(owner, list(new_slots)[len(pending.motion) :], strict=True):
            self.in_graph.setdefault(landmark, {})[i] = int(slot)

    def _stereo(self, landmark: int, observation: int) -> gtsam.NonlinearFactor:
        o = self.observations
        return self.factors.stereo(int(o.frame[observation]), landmark, o.pixel[observation])

    def drop_undone(self, values: gtsam.Values) -> bool:
        """After the last frame: gives up every landmark whose geometry came undone; False if there is none.

        Such a landmark pulls at nothing (its Jacobian is zero) and its residual means nothing.
        """
        last = self.problem.n_frames - 1
        undone = self.undone(last + 1, values)
        slots = [slot for landmark in undone for slot in self.in_graph.pop(landmark).values()]
        if undone:
            self.isam.update(gtsam.NonlinearFactorGraph(), gtsam.Values(), slots)
        self.dropped.update(undone)
        self.events += [Event(last, "landmark dropped", UNDONE, landmark) for landmark in undone]
        return bool(undone)

    def online_landmarks(self) -> Landmarks:
        """Every landmark as known at the frame that saw it last."""
        index = np.sort(np.fromiter(self._online_landmark, dtype=np.int64))
        return Landmarks(index, np.array([self._online_landmark[int(j)] for j in index]).reshape(-1, 3))

    def _named_landmark(self, error: IndeterminateSystemError) -> int | None:
        landmark = None if error.key is None else landmark_of(error.key)
        return None if landmark in self.dropped else landmark

    def _drop(self, k: int, landmark: int, pending: _Pending, reason: str) -> None:
        pending.entries.pop(landmark, None)
        pending.seen.pop(landmark, None)
        if landmark in self.in_graph:
            pending.removed.add(landmark)
        self.dropped.add(landmark)
        self.events.append(Event(k, "landmark dropped", reason, landmark))
