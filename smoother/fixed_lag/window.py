"""Sliding window of the fixed-lag smoother over a problem, and the estimates marginalized from it."""

from collections import Counter
from collections.abc import Collection

import gtsam
import numpy as np

from fgbaseline.data.estimators.estimate import Landmarks
from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from ..errors import IndeterminateSystemError
from ..frame_update import FrameUpdate
from ..graph.cheirality import CHEIRALITY_VIOLATION, cheirality_violations
from ..graph.frame_states import FrameStates
from ..graph.gtsam_conversions import landmarks_from_values, poses_from_values
from ..graph.keys import distance_key, landmark_of, pose_key, state_keys, width
from ..graph.marginal_covariances import joint_covariance
from ..graph_builder import GraphBuilder
from ..isam2.settings import ISAM2Settings
from .checkpointed_fixed_lag import CheckpointedFixedLag


class FixedLagWindow:
    """Frames and landmarks of the last `lag` seconds; a landmark's time is that of the frame that saw it last."""

    def __init__(self, problem: Problem, builder: GraphBuilder, lag: float, settings: ISAM2Settings) -> None:
        self._problem, self._builder = problem, builder
        self._unit_length = problem.sequence.camera.unit_length
        self._lag = CheckpointedFixedLag(lag, settings, self._unit_length)
        self._seconds = lag
        self._last_seen: dict[int, float] = {}
        """time of the last observation of each landmark in the window"""
        self._observed: dict[int, list[int]] = {}
        self._times_initialized: Counter[int] = Counter()
        self.key: dict[int, int] = {}
        """landmark in the window -> its key; a landmark observed again after marginalization has a new key"""
        self.oldest = 0
        """frame in the window"""
        self.newest = -1
        self.used = np.zeros(len(builder.observations), dtype=np.bool_)
        self.states = FrameStates.unknown(problem)
        """states of marginalized frames, from all data in the window at that time"""
        self.lost: list[int] = []
        """landmarks that violated cheirality when they were marginalized"""
        self._landmark: dict[int, tuple[FloatArray, FloatArray]] = {}
        if problem.sequence.monocular:
            builder.current_poses = self._current_poses

    def _current_poses(self, frames: IntArray) -> FloatArray:
        """Poses (n, 4, 4) of frames (n,) of the window by its last solution."""
        tree = self._lag.smoother.getISAM2()
        return np.array([tree.calculateEstimatePose3(pose_key(k)).matrix() for k in frames.tolist()]).reshape(-1, 4, 4)

    def add(self, update: FrameUpdate, dropped: Collection[int]) -> None:
        """See `IncrementalGraph.add`."""
        k, now = update.frame, float(self._problem.sequence.t[update.frame])
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        values.insert(update.initial_values)
        graph.add(update.motion_factor)
        new: dict[int, int] = {}
        for entry in update.new_landmarks:
            j = entry.landmark
            distance = float(np.linalg.norm(entry.position - update.initial_pose[:3, 3])) / self._unit_length
            name = j + self._problem.sequence.n_landmarks * self._times_initialized[j]
            new[j] = distance_key(name, distance)
            values.insert(new[j], entry.position)
            if self._problem.landmark_prior is not None:
                graph.add(self._builder.factors.landmark_prior(j, new[j]))
            for i in entry.observations:
                graph.add(self._builder.observation(i, new[j]))
        for j, i in update.tracked.items():
            graph.add(self._builder.observation(i, self.key[j]))
        seen = new | {j: self.key[j] for j in update.tracked}
        times = dict.fromkeys(state_keys(k, self.states.inertial), now) | dict.fromkeys(seen.values(), now)
        forgotten = {self.key[j] for j in dropped if j in self.key}
        try:
            self._lag.update(graph, values, times, forgotten)
        except IndeterminateSystemError:
            if set(self.cheirality_violations(self.key)) - set(dropped):
                raise
            # No landmark is suspect: unequal pivots alone may be the cause.
            self._lag.update(graph, values, times, forgotten, qr=True)
        self._record(update, new, now, dropped)

    def _record(self, update: FrameUpdate, new: dict[int, int], now: float, dropped: Collection[int]) -> None:
        """Record the landmarks and observations of a successful update."""
        self.newest = update.frame
        for j in dropped:
            self.used[self._observed.pop(j, [])] = False
            self._leave(j)
        self.key |= new
        self._times_initialized.update(new.keys())
        for entry in update.new_landmarks:
            self._observed[entry.landmark] = list(entry.observations)
        for j, i in update.tracked.items():
            self._observed[j].append(i)
        for j in (*new, *update.tracked):
            self._last_seen[j] = now
            self.used[self._observed[j]] = True
        while self._problem.sequence.t[self.oldest] < now - self._seconds:
            self.oldest += 1
        for j in [j for j, time in self._last_seen.items() if time < now - self._seconds]:
            self._leave(j)

    def _leave(self, landmark: int) -> None:
        for known in (self.key, self._last_seen, self._observed):
            known.pop(landmark, None)

    def suspect_landmarks(self, error: IndeterminateSystemError, dropped: Collection[int]) -> dict[int, str]:
        """See `IncrementalGraph.suspect_landmarks`; as in `IncrementalSmoother`."""
        culprits = [j for j in self.cheirality_violations(self.key) if j not in dropped]
        if culprits:
            return dict.fromkeys(culprits, CHEIRALITY_VIOLATION)
        named = None if error.key is None else landmark_of(error.key)
        if named is None or named % self._problem.sequence.n_landmarks in dropped:
            return {}
        return {named % self._problem.sequence.n_landmarks: "the system was indeterminate near it"}

    def cheirality_violations(self, landmarks: Collection[int]) -> list[int]:
        """Landmarks of the window that violate cheirality in its frames."""
        if not landmarks:
            return []
        values = self._lag.smoother.calculateEstimate()
        path = np.full_like(self.states.world_T_imu, np.nan)
        path[self.oldest : self.newest + 1] = poses_from_values(values, range(self.oldest, self.newest + 1))
        o = self._builder.observations.select(np.sort([i for j in landmarks for i in self._observed[j]]))
        o = o.select(o.frame >= self.oldest)
        return cheirality_violations(
            self._problem, o, path, landmarks_from_values(values, {j: self.key[j] for j in landmarks})
        )

    def take_newest(self, states: FrameStates) -> None:
        """Set the newest state, and with raw inertial data its covariance, which the next prediction needs."""
        state = state_keys(self.newest, states.inertial)
        states.take(self.newest, self._estimate(state))
        if states.inertial:
            joint = joint_covariance(self._lag.smoother.getISAM2(), state)
            states.take_covariances(self._problem, self.newest, [joint])

    def _estimate(self, keys: list[int]) -> gtsam.Values:
        return self._lag.smoother.getISAM2().calculateEstimate(keys)

    def position(self, landmark: int) -> FloatArray:
        """Position (3,), m, of a landmark in the window."""
        return np.asarray(self._lag.smoother.calculateEstimatePoint3(self.key[landmark]), dtype=np.float64)

    def store_marginalized(self, now: float, seen: Collection[int]) -> None:
        """Store the estimates of variables that leave the window at `now` (s), except landmarks `seen` then."""
        window = range(self.oldest, self.newest + 1)
        frames = [frame for frame in window if self._problem.sequence.t[frame] < now - self._seconds]
        leaving = [j for j, time in self._last_seen.items() if time < now - self._seconds and j not in seen]
        if not frames and not leaving:
            return
        states = {frame: state_keys(frame, self.states.inertial) for frame in frames}
        covariance = self._covariances([*states.values(), *([self.key[j]] for j in leaving)])
        for frame, state in states.items():
            self.states.take(frame, self._estimate(state))
            self.states.take_covariances(self._problem, frame, [covariance[state[0]]])
        lost = self.cheirality_violations(leaving)
        self.lost += lost
        for j in leaving:
            if j in lost:
                self.used[self._observed[j]] = False
            else:
                self._landmark[j] = (self.position(j), covariance[self.key[j]])

    def _covariances(self, together: list[list[int]]) -> dict[int, FloatArray]:
        """Joint covariances of lists of variables, by their first keys; NaN where they are indeterminate."""
        try:
            return self._lag.checkpoint.covariances(together)
        except (RuntimeError, np.linalg.LinAlgError):
            size = {keys[0]: sum(map(width, keys)) for keys in together}
            return {key: np.full((n, n), np.nan) for key, n in size.items()}

    def landmarks(self) -> Landmarks:
        """Marginalized landmarks as estimated then; the latest estimate of one initialized several times."""
        index = np.sort(np.fromiter(self._landmark, dtype=np.int64))
        position, covariance = ([self._landmark[int(j)][part] for j in index] for part in (0, 1))
        return Landmarks(index, np.array(position).reshape(-1, 3), np.array(covariance).reshape(-1, 3, 3))
