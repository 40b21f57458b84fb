"""Trajectory divergence, reprojection statistics, consistency and trust: arrays in, tables out."""

from .absolute import absolute_errors
from .alignment import Align, Alignment, align, align_se3
from .association import Association, Matched, associate
from .block_bootstrap import error_statistics
from .carried_covariance import of_other_body, scaled, since_first
from .common_moments import common_moments, taking_part
from .consistency import CovarianceState, anees, body_error, covariance_state, nees, nees_table, sigma_ratio
from .conventions import (
    BodyRotation,
    are_conjugated,
    body_rotation,
    is_constant,
    rmse_of_inverses,
    travel_misfit,
    turning_misfit,
    turning_rotation,
    world_rotation,
)
from .coverage import FEWEST_STRETCHES, SMALLEST_COVERAGE, SMALLEST_SAMPLE, covered, spanned, too_small
from .difference_shares import DifferenceShares, difference_shares
from .drift import drift
from .growth import Passing, first_beyond, growing_divergence, growth_by_part
from .held_out import HeldOutErrors, held_out_errors, held_out_ranking
from .innovation import NisSummary, nis_per_degree, nis_summary
from .interpolation import interpolated
from .maps import map_by_depth, map_difference
from .moved import moved_points
from .over_runs import Consistency, consistency_of, mean_of, nees_over_runs, ranking
from .paired import PairedRanking, RmseDifference, paired_ranking, rmse_difference
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
from .residual_patterns import residual_patterns
from .segments import SegmentErrors, segment_errors
from .share_intervals import share_intervals
from .shared_data import DifferenceNees, difference_nees
from .statistics import summarised
from .time_offset import TimeOffset, time_offset
from .trajectory import divergence, divergence_summary, pose_errors, truth_errors
from .trust import Trust, Verdict, trust
from .whitened import track_chi_square, whitened_summary

__all__ = [
    "FEWEST_STRETCHES",
    "SMALLEST_COVERAGE",
    "SMALLEST_SAMPLE",
    "Align",
    "Alignment",
    "Association",
    "BodyRotation",
    "Consistency",
    "CovarianceState",
    "Difference",
    "DifferenceNees",
    "DifferenceShares",
    "HeldOutErrors",
    "Matched",
    "NisSummary",
    "PairedRanking",
    "Passing",
    "RmseDifference",
    "SegmentErrors",
    "TimeOffset",
    "Trust",
    "Unit",
    "Verdict",
    "absolute_difference",
    "absolute_errors",
    "align",
    "align_se3",
    "anees",
    "are_conjugated",
    "associate",
    "body_error",
    "body_rotation",
    "common_moments",
    "commonly_used",
    "component_summary",
    "consistency_of",
    "covariance_state",
    "covered",
    "difference_nees",
    "difference_shares",
    "divergence",
    "divergence_summary",
    "drift",
    "error_statistics",
    "first_beyond",
    "growing_divergence",
    "growth_by_part",
    "held_out_errors",
    "held_out_ranking",
    "interpolated",
    "is_constant",
    "map_by_depth",
    "map_difference",
    "matched_pairs",
    "mean_of",
    "motion_difference",
    "moved_points",
    "nees",
    "nees_over_runs",
    "nees_table",
    "nis_per_degree",
    "nis_summary",
    "of_other_body",
    "paired_ranking",
    "pose_errors",
    "pose_pairs",
    "ranking",
    "relative_errors",
    "reprojection",
    "reprojection_by",
    "reprojection_summary",
    "residual_patterns",
    "rmse_difference",
    "rmse_of_inverses",
    "scaled",
    "segment_errors",
    "share_intervals",
    "sigma_ratio",
    "since_first",
    "spanned",
    "summarised",
    "taking_part",
    "time_offset",
    "too_small",
    "track_chi_square",
    "travel_misfit",
    "trust",
    "truth_errors",
    "turning_misfit",
    "turning_rotation",
    "whitened_summary",
    "world_rotation",
]
