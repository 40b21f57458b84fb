"""Trajectory divergence, reprojection statistics, consistency and trust: arrays in, tables out."""

from .absolute import absolute_errors
from .alignment import Align, Alignment, align, align_se3
from .association import Association, Matched, associate
from .block_bootstrap import error_statistics
from .consistency import nees
from .difference_shares import DifferenceShares, difference_shares
from .drift import drift
from .growth import Passing, first_beyond, growing_divergence, growth_by_part
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
from .time_offset import TimeOffset, time_offset
from .trajectory import divergence, divergence_summary, pose_errors, truth_errors
from .trust import Trust, Verdict, trust

__all__ = [
    "Align",
    "Alignment",
    "Association",
    "Difference",
    "DifferenceShares",
    "Matched",
    "Passing",
    "SegmentErrors",
    "TimeOffset",
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
    "difference_shares",
    "divergence",
    "divergence_summary",
    "drift",
    "error_statistics",
    "first_beyond",
    "growing_divergence",
    "growth_by_part",
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
    "time_offset",
    "trust",
    "truth_errors",
]
