"""Incremental smoother: iSAM2 frame by frame, with old frames marginalized into a linear prior."""

import time
from collections.abc import Collection

import gtsam
import numpy as np

from fgbaseline.data.estimators.estimate import Event, EventKind, Landmarks, Progress
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from ..errors import IndeterminateSystemError
from ..frame_update import FrameUpdate, add_with_recovery
from ..graph.cheirality import CHEIRALITY_VIOLATION, cheirality_violations
from ..graph.gtsam_conversions import landmarks_from_values, poses_from_values
from ..graph.keys import distance_key, landmark_of, pose_key, state_keys
from ..graph.marginal_covariances import joint_covariance
from ..graph_builder import GraphBuilder
from .elimination_ordering import EliminationOrdering
from .kernel_weights import changed_weights
from .marginalized_isam2 import NO_POSE, MarginalizedISAM2, marginalization_horizon
from .settings import ISAM2Settings

PRIOR = -1
"""Index in place of an observation for the factor of a landmark's prior."""
REINITIALIZATION_FRAMES = 4
"""Number of consecutive updates that relinearize every variable, beginning with an update in which all observed
landmarks are new. Initial values of these landmarks and of the latest poses may be far off."""
FINAL_UPDATES = 8
"""Largest number of updates after the last frame; three to five are usual."""


class FrameLostError(Exception):
    """The observations of a frame would be dropped with Cholesky factorization; with QR they may be kept."""

    def __init__(self, frame: int) -> None:
        super().__init__(f"Cholesky factorization would drop the observations of frame {frame}")
        self.frame = frame


class IncrementalSmoother:
    """iSAM2 with landmark initialization, recovery from indeterminate systems and marginalization of old frames."""

    def __init__(self, problem: Problem, settings: ISAM2Settings) -> None:
        self.solver = MarginalizedISAM2(settings.params(problem.sequence.camera.unit_length))
        self._settings = settings
        self.problem = problem
        self._may_lose_frames = settings.qr or problem.landmark_prior is not None
        """True where a frame may lose its observations, as a retry with QR is not possible or would not help"""
        self.builder = GraphBuilder(problem, settings.initialization)
        self._inertial = problem.imu is not None
        self._weighted = settings.weights_at_estimate and problem.kernel is not None
        """whether observations in the tree are Gaussian with their kernel weights"""
        if problem.sequence.monocular:
            self.builder.current_poses = self._current_poses
        self.key: dict[int, int] = {}
        """key of each landmark in the graph"""
        self._slots: dict[int, dict[int, int]] = {}
        """landmark -> {observation, or PRIOR: slot of its factor in the graph}"""
        self._dropped: set[int] = set()
        self.n_frames = 0
        """number of frames in the graph"""
        self._reinitialization_frames = 0
        """number of frames to come whose updates relinearize every variable"""
        self._ordering = EliminationOrdering(self._inertial)
        self._first = 0
        """first frame in the tree"""
        self._no_relin_before = 0
        """first frame whose variables are not in `_no_relin_keys`"""
        self._no_relin_keys = gtsam.KeyList()
        """variables older than `recent_frames`: they are relinearized with the whole tree only"""
        self._marginalize_at = settings.tree_frames
        """next frame after which to marginalize"""
        self.events: list[Event] = []

    def run(self, seconds: FloatArray, progress: Progress | None) -> None:
        """Process all frames; fill `seconds` (T,).

        Raises UnrecoverableError, and FrameLostError unless QR is used or landmarks have priors.
        """
        T = self.problem.n_frames
        for k, observed in enumerate(self.builder.observations.by_frame(T)):
            start = time.perf_counter()
            self._process_frame(k, range(observed.start, observed.stop))
            seconds[k] = time.perf_counter() - start
            if progress is not None:
                progress(k + 1, T)

    def settle(self) -> None:
        """Update without new factors after the last frame, until no variable exceeds its relinearization threshold."""
        for _ in range(FINAL_UPDATES):
            try:
                if self.solver.relinearize() == 0:
                    return
            except IndeterminateSystemError:  # GTSAM failed before it changed the tree: its solution remains
                return

    def _process_frame(self, k: int, observed: range) -> None:
        update = self._with_restored_tree(self.builder.frame_update(k, observed, self.key, self._dropped))
        landmarks, events = add_with_recovery(self, update)
        if not self._may_lose_frames and any(event.kind == EventKind.FRAME_WITHOUT_OBSERVATIONS for event in events):
            raise FrameLostError(k)
        self.n_frames = k + 1
        self._dropped |= landmarks
        self.events += events
        tree, state = self.solver.tree, state_keys(k, self._inertial)
        self.builder.online.take(k, tree.calculateEstimate(state))
        self.builder.online.take_covariances(self.problem, k, [joint_covariance(tree, state)])
        for j in self.builder.observed_landmarks(observed).tolist():
            if j in self.key and j not in self._dropped:
                self.builder.landmark_position[j] = tree.calculateEstimatePoint3(self.key[j])
        if k >= self._marginalize_at:
            self._marginalize_old_frames(k)

    def _marginalize_old_frames(self, k: int) -> None:
        """After frame k, marginalize frames older than `kept_frames` that no continuing track needs."""
        kept = self._settings.kept_frames
        first = min(k + 1 - kept, marginalization_horizon(self.builder.observations, k))
        self._marginalize_at = k + kept
        if first < self._first + kept:
            return
        if self.solver.marginalize_before(first, self._ordering.batch_groups(first, k)):
            self._start_tree_at(first)
            self._marginalize_at = first + self._settings.tree_frames

    def _start_tree_at(self, first: int) -> None:
        self._first = self._no_relin_before = first
        self._no_relin_keys = gtsam.KeyList()

    def _with_restored_tree(self, update: FrameUpdate) -> FrameUpdate:
        """Restore the marginalized frames if `update` observes marginalized variables; return the update to apply.

        If GTSAM cannot restore the frames, these landmarks are dropped, and the returned update is without them.
        """
        frame = self.builder.frame
        marginalized = {j for j in update.tracked if self.solver.is_marginalized(self.key[j])}
        marginalized |= {e.landmark for e in update.new_landmarks if frame[e.observations[0]] < self._first}
        if not marginalized:
            return update
        k, new = update.frame, marginalized - self._dropped
        if new and self.solver.restore_all(self._ordering.batch_groups(0, k - 1)):
            self._start_tree_at(0)
            # Marginalize again at frame 2k only: the intervals double, so that all earlier restorations together cost
            # no more than the last.
            self._marginalize_at = max(self._marginalize_at, 2 * k)
            return update
        self.events += [
            Event(
                k,
                EventKind.LANDMARK_DROPPED,
                "observed again after marginalization; GTSAM could not restore the tree",
                j,
            )
            for j in sorted(new)
        ]
        self._dropped |= new
        return update.without(marginalized)

    def _current_poses(self, frames: IntArray) -> FloatArray:
        """Poses world_T_imu (n, 4, 4) of frames (n,): the tree's last estimate, or online ones if marginalized."""
        poses = self.builder.online.world_T_imu[frames]
        for i in np.flatnonzero(frames >= self._first).tolist():
            poses[i] = self.solver.tree.calculateEstimatePose3(pose_key(int(frames[i]))).matrix()
        return poses

    def add(self, update: FrameUpdate, dropped: Collection[int]) -> None:
        """See `IncrementalGraph.add`."""
        k, factors = update.frame, self.builder.factors
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        values.insert(update.initial_values)
        graph.add(update.motion_factor)
        owner: list[tuple[int, int]] = []
        points = np.array([e.position for e in update.new_landmarks]).reshape(-1, 3) - update.initial_pose[:3, 3]
        distances = np.linalg.norm(points, axis=1) / self.problem.sequence.camera.unit_length
        new = {
            e.landmark: distance_key(e.landmark, distance)
            for e, distance in zip(update.new_landmarks, distances.tolist(), strict=True)
        }
        for entry in update.new_landmarks:
            j, key = entry.landmark, new[entry.landmark]
            values.insert(key, entry.position)
            if self.problem.landmark_prior is not None:
                graph.add(factors.landmark_prior(j, key))
                owner.append((j, PRIOR))
            for i in entry.observations:
                graph.add(self._observation(i, key))
                owner.append((j, i))
        for j, i in update.tracked.items():
            graph.add(self._observation(i, self.key[j]))
            owner.append((j, i))
        if update.new_landmarks and not update.tracked:
            self._reinitialization_frames = REINITIALIZATION_FRAMES
        observed_keys = [*new.values(), *(self.key[j] for j in update.tracked)]
        present = [j for j in dropped if j in self.key]
        removed = [slot for j in present for slot in self._slots[j].values()]
        self._ordering.remove([self.key[j] for j in present])
        groups = self._ordering.groups(k, observed_keys, first=self._first, all_new=self._reinitialization_frames > 0)
        # first frame of each factor in the order of `graph`: motion, then landmark priors (no pose) and observations
        frames = [max(k - 1, 0), *(NO_POSE if i == PRIOR else self.builder.frame[i] for _, i in owner)]
        relinearize, no_relin_keys = self._relinearization(k)
        weights = self._renewed_weights(k, dropped) if relinearize and self._weighted else {}
        replaced = dict[int, gtsam.NonlinearFactor]()
        for i, weight in weights.items():
            j = int(self.builder.observations.landmark[i])
            replaced[self._slots[j][i]] = self.builder.observation(i, self.key[j], weight)
        try:
            state = state_keys(k, self._inertial)
            slots = self.solver.update(
                graph, frames, values, state, removed, groups, relinearize, no_relin_keys, replaced
            )
        except IndeterminateSystemError:
            self._ordering.remove(new.values())
            raise
        self.builder.weight[list(weights)] = list(weights.values())
        self._reinitialization_frames = max(0, self._reinitialization_frames - 1)
        for j in present:
            del self.key[j], self._slots[j]
        self.key |= new
        for (j, i), slot in zip(owner, slots[1:], strict=True):
            self._slots.setdefault(j, {})[i] = slot

    def _observation(self, i: int, key: int) -> gtsam.NonlinearFactor:
        """Factor of an observation in the tree."""
        return self.builder.observation(i, key, self.builder.weight[i] if self._weighted else None)

    def _renewed_weights(self, k: int, dropped: Collection[int]) -> dict[int, float]:
        """Kernel weights at the estimate before frame k, by observation, where they changed.

        They are of the observations in the last `recent_frames` frames, as far as the tree has their factors.
        """
        o, first = self.builder.observations, max(k - self._settings.recent_frames, self._first)
        start, end = np.searchsorted(o.frame, [first, k]).tolist()
        known = [
            i
            for i, j in enumerate(o.landmark[start:end].tolist(), start)
            if j in self.key and j not in dropped and i in self._slots[j] and self.solver.in_tree(self._slots[j][i])
        ]
        return changed_weights(self.builder, self.solver.tree, self.key, np.array(known, dtype=np.int64))

    def _relinearization(self, k: int) -> tuple[bool, gtsam.KeyList | None]:
        """Whether the update of frame k relinearizes, and the keys that keep their linearization points in it.

        The keys are those of variables older than `recent_frames`; None where all may be relinearized. A landmark that
        is observed again counts as older until the tree is rebuilt (marginalization or restoration).
        """
        settings = self._settings
        if self._reinitialization_frames > 0 or k % settings.relinearize_all_skip == 0:
            return True, None
        if k % settings.relinearize_skip:
            return False, None
        before = max(k - settings.recent_frames, self._no_relin_before)
        for key in self._ordering.older(self._no_relin_before, before):
            self._no_relin_keys.push_back(key)
        self._no_relin_before = before
        return True, gtsam.KeyList(self._no_relin_keys)

    def suspect_landmarks(self, error: IndeterminateSystemError, dropped: Collection[int]) -> dict[int, str]:
        """See `IncrementalGraph.suspect_landmarks`.

        GTSAM names a variable near the cause. The cause is usually a cheirality violation of the last solution; only
        without one, the named variable is taken.
        """
        violations = [j for j in self._cheirality_violations(self.solver.estimate()) if j not in dropped]
        if violations:
            return dict.fromkeys(violations, CHEIRALITY_VIOLATION)
        named = None if error.key is None else landmark_of(error.key)
        if named is None or named in dropped or named in self._dropped:
            return {}
        return {named: "the system was indeterminate near it"}

    def _cheirality_violations(self, values: gtsam.Values) -> list[int]:
        if not self.key:
            return []
        o = self.builder.observations.select(self.used())
        return cheirality_violations(
            self.problem, o, poses_from_values(values, range(self.n_frames)), landmarks_from_values(values, self.key)
        )

    def release(self) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """Factors in their slots, with the kernel, and the solution after the last frame. The tree is freed."""
        graph, values = self.solver.release()
        observed = [(j, i, slot) for j, slots in self._slots.items() for i, slot in slots.items() if i != PRIOR]
        for j, i, slot in observed if self._weighted else []:
            graph.replace(slot, self.builder.observation(i, self.key[j]))
        active = set(self.key.values())
        for key in values.keys():  # noqa: SIM118
            if landmark_of(key) is not None and key not in active:  # dropped, but still in the linear prior
                values.erase(key)
        return graph, values

    def drop_cheirality_violations(self, graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> bool:
        """Remove cheirality violations from the result of `release`; False if there is none.

        The Jacobian of such a landmark is zero and its residual meaningless.
        """
        dropped = self._cheirality_violations(values)
        for j in dropped:
            for slot in self._slots.pop(j).values():
                graph.remove(slot)
            values.erase(self.key.pop(j))
        last = self.problem.n_frames - 1
        self.events += [Event(last, EventKind.LANDMARK_DROPPED, CHEIRALITY_VIOLATION, landmark) for landmark in dropped]
        return bool(dropped)

    def used(self) -> BoolArray:
        """Mask (n,) over `problem.observations()` of those in the graph; see `Problem.scatter_mask`."""
        used = np.zeros(len(self.builder.observations), dtype=np.bool_)
        used[[i for slots in self._slots.values() for i in slots if i != PRIOR]] = True
        return used

    def online_landmarks(self) -> Landmarks:
        """Landmarks as estimated at their latest observation."""
        position = self.builder.landmark_position
        index = np.sort(np.fromiter(position, dtype=np.int64))
        return Landmarks(index, np.array([position[int(j)] for j in index]).reshape(-1, 3))
