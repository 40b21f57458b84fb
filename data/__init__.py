"""Recordings, the problem they pose, the answers to it, and the estimators that give them."""

from .estimate import Estimate, Event, Landmarks, Progress, Status
from .observations import Observations
from .problem import Excluded, HuberKernel, LandmarkPrior, Problem, Reading
from .registry import estimator_names, find_estimator
from .sequence import Sequence, Truth

__all__ = [
    "Estimate",
    "Event",
    "Excluded",
    "HuberKernel",
    "LandmarkPrior",
    "Landmarks",
    "Observations",
    "Problem",
    "Progress",
    "Reading",
    "Sequence",
    "Status",
    "Truth",
    "estimator_names",
    "find_estimator",
]
