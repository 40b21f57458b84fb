"""Trajectory divergence, reprojection statistics, consistency and trust: arrays in, tables out."""

from .absolute import absolute_errors
from .alignment import Align, Alignment, align, align_se3
from .association import Association, Matched, associate
from .consistency import nees
from .interpolation import interpolated
from .pairs import Unit, pose_pairs
from .pose_difference import Difference, absolute_difference, motion_difference
from .relative import matched_pairs, relative_errors
from .reprojection import (
    commonly_used,
    component_summary,
    reprojection,
    reprojection_by,
    reprojection_summary,
)
from .segments import SegmentErrors, segment_errors
from .statistics import summarised
from .trajectory import divergence, divergence_summary, pose_errors, truth_errors
from .trust import Trust, Verdict, trust

__all__ = [
    "Align",
    "Alignment",
    "Association",
    "Difference",
    "Matched",
    "SegmentErrors",
    "Trust",
    "Unit",
    "Verdict",
    "absolute_difference",
    "absolute_errors",
    "align",
    "align_se3",
    "associate",
    "commonly_used",
    "component_summary",
    "divergence",
    "divergence_summary",
    "interpolated",
    "matched_pairs",
    "motion_difference",
    "nees",
    "pose_errors",
    "pose_pairs",
    "relative_errors",
    "reprojection",
    "reprojection_by",
    "reprojection_summary",
    "segment_errors",
    "summarised",
    "trust",
    "truth_errors",
]
