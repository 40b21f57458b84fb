"""Landmark initialization: observations are collected until triangulation determines the position."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import IntArray, Observations
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.triangulation import triangulate_tracks

from ..graph.cheirality import in_front

START_TOLERANCE = 1e-3
"""relative step at which triangulation stops: the first update of the graph moves a landmark further"""


@dataclass(frozen=True, slots=True)
class InitializationCriterion:
    """Criterion for a landmark whose observations determine its position."""

    min_observations: int = 3
    max_relative_deviation: float = 0.5
    """bound of the 1-sigma in the worst direction, relative to the distance from the last camera that observed it"""


@dataclass(frozen=True, eq=False, slots=True)
class NewLandmark:
    """Landmark to add to the graph: initial position and all observations so far."""

    landmark: int
    position: FloatArray
    """(3,) m, in the world frame"""
    observations: list[int]
    """indices into the problem's observations"""
    weights: FloatArray
    """(n,) kernel weights of these observations, along the trajectory of the triangulation"""


class UninitializedLandmarks:
    """Observations of landmarks that are not in the graph yet."""

    def __init__(self, problem: Problem, observations: Observations, criterion: InitializationCriterion) -> None:
        self._problem = problem
        self._observations = observations
        self._criterion = criterion
        self._observed: dict[int, list[int]] = {}

    def __len__(self) -> int:
        return len(self._observed)

    def add(self, landmark: int, observation: int) -> None:
        """Add an observation of an uninitialized landmark."""
        self._observed.setdefault(landmark, []).append(observation)

    def last_seen(self) -> list[tuple[int, int]]:
        """Pairs (landmark, frame of its last observation) of the uninitialized landmarks."""
        frame = self._observations.frame
        return [(landmark, int(frame[observed[-1]])) for landmark, observed in sorted(self._observed.items())]

    def candidates(self, seen: list[int], since: int = 0) -> list[int]:
        """Landmarks of `seen` with enough observations, or all with priors. Drops observations before frame `since`."""
        if since > 0:
            for j in seen:
                self._observed[j] = [i for i in self._observed[j] if self._observations.frame[i] >= since]
        if self._problem.landmark_prior is not None:
            return seen
        return [j for j in seen if len(self._observed[j]) >= self._criterion.min_observations]

    def frames(self, candidates: list[int]) -> IntArray:
        """Frames (n,) of the observations of candidates, rising."""
        return np.unique(self._observations.frame[np.concatenate([self._observed[j] for j in candidates])])

    def initialize(self, candidates: list[int], world_T_imu: FloatArray) -> list[NewLandmark]:
        """Remove and return the candidates whose position is determined, given the poses (T, 4, 4).

        A landmark is triangulated with the poses held fixed. It must be in front of every camera that observed it, and
        meet `InitializationCriterion.max_relative_deviation`. A landmark with a prior is initialized at its mean.
        """
        if self._problem.landmark_prior is not None:
            return [self._initialize_at_prior(landmark, world_T_imu) for landmark in candidates]
        if not candidates:
            return []
        lengths = np.array([len(self._observed[j]) for j in candidates])
        index = np.concatenate([self._observed[j] for j in candidates])
        row = np.repeat(np.arange(len(candidates)), lengths)
        world_T_cam = world_T_imu[self._observations.frame[index]] @ self._problem.sequence.imu_T_cam
        position, deviation = self._triangulate(index, row, world_T_cam, len(candidates))
        front = np.logical_and.reduceat(
            in_front(self._problem.sequence.camera, world_T_cam, position[row]), np.cumsum(lengths) - lengths
        )
        distance = np.linalg.norm(position - world_T_cam[np.cumsum(lengths) - 1, :3, 3], axis=1)
        determined = front & (deviation < self._criterion.max_relative_deviation * distance)
        weight = self._problem.measurement.weight_at(world_T_cam, position[row], self._observations.pixel[index])
        weights = np.split(weight, np.cumsum(lengths)[:-1])
        return [
            NewLandmark(j, position[i], self._observed.pop(j), weights[i])
            for i, j in enumerate(candidates)
            if bool(determined[i])
        ]

    def _initialize_at_prior(self, landmark: int, world_T_imu: FloatArray) -> NewLandmark:
        prior, observed = self._problem.landmark_prior, self._observed.pop(landmark)
        assert prior is not None
        position = prior.mean[int(np.searchsorted(self._problem.features, landmark))]
        world_T_cam = world_T_imu[self._observations.frame[observed]] @ self._problem.sequence.imu_T_cam
        weights = self._problem.measurement.weight_at(world_T_cam, position[None], self._observations.pixel[observed])
        return NewLandmark(landmark, position, observed, weights)

    def _triangulate(
        self, index: IntArray, row: IntArray, world_T_cam: FloatArray, n: int
    ) -> tuple[FloatArray, FloatArray]:
        """Positions (n, 3), m, and 1-sigma (n,), m, in the worst direction; infinite where not determined."""
        model, pixel = self._problem.measurement, self._observations.pixel[index]
        points = triangulate_tracks(model, world_T_cam, row, pixel, n, START_TOLERANCE)
        weakest = np.linalg.eigvalsh(points.information)[:, 0]
        finite = np.isfinite(points.position).all(axis=1) & (weakest > 0)
        deviation = np.full(n, np.inf)
        deviation[finite] = 1.0 / np.sqrt(weakest[finite])
        return points.position, deviation
