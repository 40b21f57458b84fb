"""Trajectory divergence, reprojection statistics, consistency and trust: arrays in, tables out."""

from .alignment import align_se3
from .consistency import nees
from .reprojection import (
    commonly_used,
    component_summary,
    reprojection,
    reprojection_by,
    reprojection_summary,
)
from .statistics import summarised
from .trajectory import divergence, divergence_summary, pose_errors, truth_errors
from .trust import Trust, Verdict, trust

__all__ = [
    "Trust",
    "Verdict",
    "align_se3",
    "commonly_used",
    "component_summary",
    "divergence",
    "divergence_summary",
    "nees",
    "pose_errors",
    "reprojection",
    "reprojection_by",
    "reprojection_summary",
    "summarised",
    "trust",
    "truth_errors",
]
