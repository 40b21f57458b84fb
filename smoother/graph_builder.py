"""Graph builder: turns the observations of each frame into a frame update for an incremental solver."""

from collections.abc import Callable, Collection

import gtsam
import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

from .frame_update import FrameUpdate
from .graph.factors import FactorBuilder
from .graph.frame_states import FrameStates
from .initialization.landmark_initialization import InitializationCriterion, UninitializedLandmarks
from .initialization.pose_initialization import refine_predicted_pose
from .initialization.prediction import predict_state
from .initialization.windowed_initialization import optimize_window

WINDOW_FRAMES = 2
"""Number of previous frames that are optimized with a frame without known landmarks: a landmark needs three views."""


class GraphBuilder:
    """Builds frame updates of a problem from the online estimates of poses and landmarks."""

    def __init__(self, problem: Problem, criterion: InitializationCriterion) -> None:
        self.problem = problem
        self.observations = problem.observations()
        self.frame: list[int] = self.observations.frame.tolist()
        """frame of each observation"""
        self._rows: list[list[float]] = problem.measurement.rows_of(self.observations.pixel).tolist()
        self.factors = FactorBuilder(problem)
        self.uninitialized = UninitializedLandmarks(problem, self.observations, criterion)
        self.weight = np.ones(len(self.observations))
        """(n,) kernel weights of the observations; the solver may renew them"""
        self.online = FrameStates.unknown(problem)
        """causal estimates: the state of frame k from data up to k. The solver sets these, and `landmark_position`."""
        self.landmark_position: dict[int, FloatArray] = {}
        """landmark -> position (3,), m, as estimated at its latest observation"""
        self.current_poses: Callable[[IntArray], FloatArray] | None = None
        """poses (n, 4, 4) of frames (n,) by the latest solution of the graph. It is set for one camera only: its
        landmarks are initialized late, and later frames have changed the path by more than their parallax."""

    def frame_update(
        self, k: int, observed: range, known: Collection[int], dropped: Collection[int], first_frame: int = 0
    ) -> FrameUpdate:
        """Update by frame k for a graph of the landmarks `known` and the frames from `first_frame` on."""
        landmarks = self.observations.landmark[observed.start : observed.stop].tolist()
        tracked = {j: i for j, i in zip(landmarks, observed, strict=True) if j in known}
        uninitialized = [
            (j, i) for j, i in zip(landmarks, observed, strict=True) if j not in known and j not in dropped
        ]
        for landmark, i in uninitialized:
            self.uninitialized.add(landmark, i)
        motion_factor = self._predict(k, tracked)
        candidates = self.uninitialized.candidates([landmark for landmark, _ in uninitialized], first_frame)
        states = self._windowed_states(k, first_frame) if candidates and not tracked else self.online
        new_landmarks = self.uninitialized.initialize(candidates, self._path(candidates, states))
        values = gtsam.Values()
        states.insert(values, k)
        for entry in new_landmarks:
            self.weight[entry.observations] = entry.weights
        return FrameUpdate(k, states.world_T_imu[k], values, motion_factor, tuple(new_landmarks), tracked)

    def _predict(self, k: int, tracked: dict[int, int]) -> gtsam.NonlinearFactor:
        """Set the predicted state of frame k; return the factor of its motion, or the prior of frame 0."""
        if k == 0:
            self.online.start(self.problem)
            return self.factors.start_prior()
        pose, covariance, factor = predict_state(self.factors, self.online, k)
        if tracked:
            points = np.array([self.landmark_position[j] for j in tracked])
            pixel = self.observations.pixel[list(tracked.values())]
            information: FloatArray = np.linalg.inv(covariance).astype(np.float64)
            pose = refine_predicted_pose(self.problem, information, pose, points, pixel)
            world_T_cam = pose @ self.problem.sequence.imu_T_cam
            self.weight[list(tracked.values())] = self.problem.measurement.weight_at(world_T_cam, points, pixel)
        self.online.world_T_imu[k] = pose
        return factor

    def _windowed_states(self, k: int, first_frame: int) -> FrameStates:
        """Online states, the last of them optimized in a window of frames, as frame k observes no known landmark.

        At the start or after a gap no landmark corrects the dead-reckoned path. Landmarks triangulated along it would
        be so far off that the first Gauss-Newton step moves some behind the cameras and bends the path.
        """
        first = max(k - WINDOW_FRAMES, first_frame)
        if self.problem.landmark_prior is not None or k - first < WINDOW_FRAMES:
            return self.online
        values = optimize_window(self.factors, self.observations, self.online, first, k)
        if values is None:
            return self.online
        states = self.online.copy()
        states.take_all(values, first, k)
        return states

    def _path(self, candidates: list[int], states: FrameStates) -> FloatArray:
        """Poses (T, 4, 4) along which candidates are triangulated: those of `states`, or of the graph's solution."""
        if self.current_poses is None or states is not self.online or not candidates:
            return states.world_T_imu
        frames, path = self.uninitialized.frames(candidates), states.world_T_imu.copy()
        frames = frames[:-1]  # the new frame is not in the graph
        path[frames] = self.current_poses(frames)
        return path

    def observation(self, observation: int, key: int, weight: float | None = None) -> gtsam.NonlinearFactor:
        """Factor of one observation of the landmark `key`, under the kernel, or with a `weight` in its place."""
        return self.factors.observation(self.frame[observation], key, self._rows[observation], weight)

    def observed_landmarks(self, observed: range) -> IntArray:
        """Landmarks of a frame's observations."""
        return self.observations.landmark[observed.start : observed.stop]
