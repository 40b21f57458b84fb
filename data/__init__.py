"""Recordings, estimation problems, estimates, and the registry of estimators."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fgbaseline.geometry import HuberKernel

    from .estimators.estimate import Estimate, Event, EventKind, Innovations, Landmarks, Progress, Status
    from .estimators.registry import estimator_names, estimator_summaries, find_estimator
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
    from .sequence import Sequence, Truth
    from .time_unit import TimeUnit
    from .trajectory import Trajectory
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "fgbaseline.geometry": "HuberKernel",
            "estimators.estimate": "Estimate Event EventKind Innovations Landmarks Progress Status",
            "finding": "Finding",
            "formats": "attach_truth read read_kitti read_times read_trajectory read_tum write_euroc write_kitti "
            "write_npz write_trajectory_npz write_tum",
            "held_out": "HeldOut",
            "observations": "Observations",
            "problem": "Excluded LandmarkMode LandmarkPrior Problem",
            "problem.documented": "documented",
            "problem_export": "read_problem write_problem",
            "estimators.registry": "estimator_names estimator_summaries find_estimator",
            "sequence": "Sequence Truth",
            "time_unit": "TimeUnit",
            "trajectory": "Trajectory",
        },
    )

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
