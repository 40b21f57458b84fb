"""Frame after frame: which observations go to the graph, which wait, and where the new pose starts."""

from collections.abc import Collection

import gtsam
import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement import measured_rows

from .frame_update import Arrival
from .graph.factors import Factors
from .initialization.landmark_initialization import EntryRule, WaitingLandmarks
from .initialization.pose_initialization import corrected
from .initialization.windowed_initialization import solved

LAST_FRAMES = 2
"""before the one that sees nothing known: three sights are what a landmark needs to enter"""


class Arrivals:
    """Turns a problem into arrivals, given what is known online."""

    def __init__(self, problem: Problem, rule: EntryRule) -> None:
        self.problem = problem
        self.observations = problem.observations()
        self.frame: list[int] = self.observations.frame.tolist()
        """of each observation"""
        self._rows = list(measured_rows(self.observations.pixel))
        self.factors = Factors(problem)
        self.waiting = WaitingLandmarks(problem, self.observations, rule)
        self._information = np.linalg.inv(problem.increment_covariance)
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
        self.path[k] = self._guess(k, seen)
        candidates = self.waiting.candidates([landmark for landmark, _ in waiting], since)
        path = self._anew(k, since) if candidates and not seen else self.path
        entries = self.waiting.enter(candidates, path)
        motion = self.factors.first_pose() if k == 0 else self.factors.motion(k - 1)
        return Arrival(k, path[k], motion, tuple(entries), seen)

    def _guess(self, k: int, seen: dict[int, int]) -> FloatArray:
        if k == 0:
            return self.problem.initial_pose
        pose: FloatArray = self.path[k - 1] @ self.factors.steps[k - 1]
        if not seen:
            return pose
        points = np.array([self.position[j] for j in seen])
        pixel = self.observations.pixel[list(seen.values())]
        return corrected(self.problem, self._information[k - 1], pose, points, pixel)

    def _anew(self, k: int, since: int) -> FloatArray:
        """The path (T, 4, 4) where frame k sees no landmark that is known and some may enter: its last frames fitted to
        the images alone.

        At the start, or after a gap, nothing corrects where the velocities lead. Landmarks triangulated along it would
        start so far off, all at once, that the first step throws some behind the cameras and bends the path.
        """
        first = max(k - LAST_FRAMES, since)
        if self.problem.landmark_prior is not None or k - first < LAST_FRAMES:
            return self.path
        path = self.path.copy()
        path[first : k + 1] = solved(self.factors, self.observations, self.path, first, k)
        return path

    def stereo(self, observation: int, key: int) -> gtsam.GenericStereoFactor3D:
        """The factor of one observation of the landmark `key`."""
        return self.factors.stereo(self.frame[observation], key, self._rows[observation])

    def landmarks_seen(self, observed: range) -> IntArray:
        """The landmarks of a frame's observations."""
        return self.observations.landmark[observed.start : observed.stop]
