"""Recordings, the problem they pose, the answers to it, and the estimators that give them."""

from fgbaseline.geometry import HuberKernel

from .calibrated import Calibration, NoiseSettings, calibrated
from .diagnose import Diagnosis, Finding, diagnose
from .documented import documented
from .estimate import Estimate, Event, EventKind, Innovations, Landmarks, Progress, Status
from .exchange import read_problem, write_problem
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
from .held_out import HeldOut, hold_out
from .observations import Observations
from .problem import Excluded, LandmarkPrior, Problem, Reading
from .registry import estimator_names, find_estimator
from .repairs import Repairs, read_repairs
from .repairs_text import repairs_text
from .sequence import Sequence, Truth
from .time_unit import TimeUnit
from .trajectory import Trajectory

__all__ = [
    "Calibration",
    "Diagnosis",
    "Estimate",
    "Event",
    "EventKind",
    "Excluded",
    "Finding",
    "HeldOut",
    "HuberKernel",
    "Innovations",
    "LandmarkPrior",
    "Landmarks",
    "NoiseSettings",
    "Observations",
    "Problem",
    "Progress",
    "Reading",
    "Repairs",
    "Sequence",
    "Status",
    "TimeUnit",
    "Trajectory",
    "Truth",
    "attach_truth",
    "calibrated",
    "diagnose",
    "documented",
    "estimator_names",
    "find_estimator",
    "hold_out",
    "read",
    "read_kitti",
    "read_problem",
    "read_repairs",
    "read_times",
    "read_trajectory",
    "read_tum",
    "repairs_text",
    "write_euroc",
    "write_kitti",
    "write_npz",
    "write_problem",
    "write_trajectory_npz",
    "write_tum",
]
