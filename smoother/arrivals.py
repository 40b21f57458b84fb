"""Frame after frame: which observations go to the graph, which wait, and where the new pose starts."""

from collections.abc import Collection

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from .arrival import Arrival
from .factors import Factors
from .pose_guess import corrected
from .waiting import EntryRule, WaitingLandmarks


class Arrivals:
    """Turns a problem into arrivals, given what is known online."""

    def __init__(self, problem: Problem, rule: EntryRule) -> None:
        self.problem = problem
        self.observations = problem.observations()
        self.factors = Factors(problem)
        self.waiting = WaitingLandmarks(problem, self.observations, rule)
        self.path = np.full((problem.n_frames, 4, 4), np.nan)
        """world_T_imu as known online; whoever solves fills it, and `position`"""
        self.position: dict[int, FloatArray] = {}
        """of each landmark that ever was in the graph, at the frame that saw it last"""

    def next(
        self, k: int, observed: range, known: Collection[int], dropped: Collection[int], since: int = 0
    ) -> Arrival:
        """Frame k with its observations, in a graph of the landmarks `known` and the frames from `since` on."""
        landmarks = self.observations.landmark[observed.start : observed.stop].tolist()
        seen = {j: i for j, i in zip(landmarks, observed, strict=True) if j in known}
        waiting = [(j, i) for j, i in zip(landmarks, observed, strict=True) if j not in known and j not in dropped]
        for landmark, i in waiting:
            self.waiting.add(landmark, i)
        self.path[k] = guess = self._guess(k, seen)
        entries = self.waiting.enter([landmark for landmark, _ in waiting], self.path, since)
        motion = self.factors.first_pose() if k == 0 else self.factors.motion(k - 1)
        return Arrival(k, guess, motion, tuple(entries), seen)

    def _guess(self, k: int, seen: dict[int, int]) -> FloatArray:
        if k == 0:
            return self.problem.initial_pose
        pose: FloatArray = self.path[k - 1] @ self.factors.steps[k - 1]
        if not seen:
            return pose
        points = np.array([self.position[j] for j in seen])
        return corrected(self.problem, k, pose, points, self.observations.pixel[list(seen.values())])

    def landmarks_seen(self, observed: range) -> IntArray:
        """The landmarks of a frame's observations."""
        return self.observations.landmark[observed.start : observed.stop]
