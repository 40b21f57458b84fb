"""Recordings, estimation problems, estimates, and the registry of estimators."""

from fgbaseline.geometry import HuberKernel

from .estimate import Estimate, Event, EventKind, Innovations, Landmarks, Progress, Status
from .finding import Finding
from .formats import (
    attach_truth,
    read,
    read_kitti,
    read_times,
    read_trajectory,
    read_tum,
    write_euroc,
    write_kitti,
    write_npz,
    write_trajectory_npz,
    write_tum,
)
from .held_out import HeldOut
from .observations import Observations
from .problem import Excluded, LandmarkMode, LandmarkPrior, Problem
from .problem.documented import documented
from .problem_export import read_problem, write_problem
from .registry import estimator_names, estimator_summaries, find_estimator
from .sequence import Sequence, Truth
from .time_unit import TimeUnit
from .trajectory import Trajectory

__all__ = [
    "Estimate",
    "Event",
    "EventKind",
    "Excluded",
    "Finding",
    "HeldOut",
    "HuberKernel",
    "Innovations",
    "LandmarkMode",
    "LandmarkPrior",
    "Landmarks",
    "Observations",
    "Problem",
    "Progress",
    "Sequence",
    "Status",
    "TimeUnit",
    "Trajectory",
    "Truth",
    "attach_truth",
    "documented",
    "estimator_names",
    "estimator_summaries",
    "find_estimator",
    "read",
    "read_kitti",
    "read_problem",
    "read_times",
    "read_trajectory",
    "read_tum",
    "write_euroc",
    "write_kitti",
    "write_npz",
    "write_problem",
    "write_trajectory_npz",
    "write_tum",
]
