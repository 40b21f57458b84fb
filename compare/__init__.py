"""Trajectory divergence, reprojection statistics, consistency and trust: arrays in, tables out."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fgbaseline.geometry.path_length import distance_traveled

    from .consistency.anees import AneesSummary, anees, anees_summary, average_nees
    from .consistency.covariance import (
        CovarianceState,
        covariance_of_body,
        covariance_since_first,
        covariance_state,
        scaled_covariance,
    )
    from .consistency.nees import body_error, nees, nees_summary, nees_table, sigma_ratio
    from .consistency.nis import NisSummary, nis_per_degree, nis_summary
    from .consistency.pose_sigma import PoseSigma, pose_sigma
    from .consistency.reference_nees import ReferenceNees, reference_nees
    from .consistency.state_nees import (
        quantity_summary,
        state_error,
        state_nees,
        velocity_and_bias_errors,
        velocity_and_biases,
    )
    from .landmarks.dynamic_landmarks import dynamic_landmarks
    from .landmarks.map_difference import map_by_depth, map_difference
    from .reference_trust import Criterion, Trust, Verdict, trust
    from .residuals.cost import cost
    from .residuals.held_out_tracks import HeldOutErrors, held_out_errors, held_out_ranking
    from .residuals.reprojection import (
        component_summary,
        reprojection,
        reprojection_by,
        reprojection_summary,
        used_by_all,
    )
    from .residuals.residual_classes import residual_patterns
    from .residuals.whitening import evaluated_rows, track_chi_square, whitened_summary
    from .statistics.block_bootstrap import error_statistics
    from .statistics.chi_square import chi_square_bounds, chi_square_quantile, p_value, share_inside_bounds
    from .statistics.descriptive import summarized
    from .statistics.monte_carlo import MeanInterval, mean_interval, monte_carlo_ranking
    from .statistics.paired_bootstrap import (
        PairedRanking,
        RmseDifference,
        is_claimed,
        is_level,
        paired_ranking,
        rmse_difference,
    )
    from .trajectory.alignment import Align, Alignment, align, align_se3
    from .trajectory.association import (
        Association,
        MatchedTrajectories,
        associate,
        common_stamps,
        interpolated,
        rankable,
    )
    from .trajectory.ate_rpe import (
        PoseRelation,
        absolute_errors,
        absolute_pose_error,
        matched_pairs,
        relative_errors,
        relative_pose_error,
    )
    from .trajectory.coverage import (
        MIN_COVERAGE,
        MIN_SAMPLE_SIZE,
        MIN_STRETCHES,
        interval_coverage,
        is_insufficient,
        time_coverage,
    )
    from .trajectory.delta_pairs import Unit, pose_pairs
    from .trajectory.drift import drift
    from .trajectory.error_decomposition import ErrorDecomposition, decomposition_intervals, error_decomposition
    from .trajectory.frame_conventions import (
        BodyRotation,
        body_rotation,
        has_conjugated_orientations,
        least_rotation_misfit,
        length_unit,
        rmse_of_inverse_poses,
        travel_direction_misfit,
        world_rotation_from_positions,
    )
    from .trajectory.pose_errors import (
        Exceedance,
        divergence,
        divergence_along_path,
        divergence_growth,
        divergence_summary,
        first_exceedance,
        pose_errors,
        truth_alignment,
        truth_errors,
    )
    from .trajectory.segments import SegmentErrors, segment_errors
    from .trajectory.time_offset import TimeOffset, time_offset
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "consistency.anees": "AneesSummary anees anees_summary average_nees",
            "consistency.covariance": "CovarianceState covariance_of_body covariance_since_first covariance_state "
            "scaled_covariance",
            "consistency.nees": "body_error nees nees_summary nees_table sigma_ratio",
            "consistency.nis": "NisSummary nis_per_degree nis_summary",
            "consistency.pose_sigma": "PoseSigma pose_sigma",
            "consistency.reference_nees": "ReferenceNees reference_nees",
            "consistency.state_nees": (
                "quantity_summary state_error state_nees velocity_and_bias_errors velocity_and_biases"
            ),
            "landmarks.dynamic_landmarks": "dynamic_landmarks",
            "landmarks.map_difference": "map_by_depth map_difference",
            "residuals.cost": "cost",
            "residuals.held_out_tracks": "HeldOutErrors held_out_errors held_out_ranking",
            "residuals.residual_classes": "residual_patterns",
            "residuals.reprojection": "component_summary reprojection reprojection_by reprojection_summary used_by_all",
            "residuals.whitening": "evaluated_rows track_chi_square whitened_summary",
            "statistics.block_bootstrap": "error_statistics",
            "statistics.chi_square": "chi_square_bounds chi_square_quantile p_value share_inside_bounds",
            "statistics.descriptive": "summarized",
            "statistics.monte_carlo": "MeanInterval mean_interval monte_carlo_ranking",
            "statistics.paired_bootstrap": "PairedRanking RmseDifference is_claimed is_level paired_ranking "
            "rmse_difference",
            "trajectory.alignment": "Align Alignment align align_se3",
            "trajectory.association": "Association MatchedTrajectories associate common_stamps interpolated rankable",
            "trajectory.ate_rpe": "PoseRelation absolute_errors absolute_pose_error matched_pairs relative_errors "
            "relative_pose_error",
            "trajectory.coverage": "MIN_COVERAGE MIN_SAMPLE_SIZE MIN_STRETCHES interval_coverage is_insufficient "
            "time_coverage",
            "trajectory.delta_pairs": "Unit pose_pairs",
            "trajectory.pose_errors": "Exceedance divergence divergence_along_path divergence_growth "
            "divergence_summary first_exceedance pose_errors truth_alignment truth_errors",
            "trajectory.drift": "drift",
            "trajectory.error_decomposition": "ErrorDecomposition decomposition_intervals error_decomposition",
            "trajectory.frame_conventions": "BodyRotation body_rotation has_conjugated_orientations "
            "least_rotation_misfit length_unit rmse_of_inverse_poses travel_direction_misfit "
            "world_rotation_from_positions",
            "fgbaseline.geometry.path_length": "distance_traveled",
            "trajectory.segments": "SegmentErrors segment_errors",
            "trajectory.time_offset": "TimeOffset time_offset",
            "reference_trust": "Criterion Trust Verdict trust",
        },
    )

__all__ = [
    "MIN_COVERAGE",
    "MIN_SAMPLE_SIZE",
    "MIN_STRETCHES",
    "Align",
    "Alignment",
    "AneesSummary",
    "Association",
    "BodyRotation",
    "CovarianceState",
    "Criterion",
    "ErrorDecomposition",
    "Exceedance",
    "HeldOutErrors",
    "MatchedTrajectories",
    "MeanInterval",
    "NisSummary",
    "PairedRanking",
    "PoseRelation",
    "PoseSigma",
    "ReferenceNees",
    "RmseDifference",
    "SegmentErrors",
    "TimeOffset",
    "Trust",
    "Unit",
    "Verdict",
    "absolute_errors",
    "absolute_pose_error",
    "align",
    "align_se3",
    "anees",
    "anees_summary",
    "associate",
    "average_nees",
    "body_error",
    "body_rotation",
    "chi_square_bounds",
    "chi_square_quantile",
    "common_stamps",
    "component_summary",
    "cost",
    "covariance_of_body",
    "covariance_since_first",
    "covariance_state",
    "decomposition_intervals",
    "distance_traveled",
    "divergence",
    "divergence_along_path",
    "divergence_growth",
    "divergence_summary",
    "drift",
    "dynamic_landmarks",
    "error_decomposition",
    "error_statistics",
    "evaluated_rows",
    "first_exceedance",
    "has_conjugated_orientations",
    "held_out_errors",
    "held_out_ranking",
    "interpolated",
    "interval_coverage",
    "is_claimed",
    "is_insufficient",
    "is_level",
    "least_rotation_misfit",
    "length_unit",
    "map_by_depth",
    "map_difference",
    "matched_pairs",
    "mean_interval",
    "monte_carlo_ranking",
    "nees",
    "nees_summary",
    "nees_table",
    "nis_per_degree",
    "nis_summary",
    "p_value",
    "paired_ranking",
    "pose_errors",
    "pose_pairs",
    "pose_sigma",
    "quantity_summary",
    "rankable",
    "reference_nees",
    "relative_errors",
    "relative_pose_error",
    "reprojection",
    "reprojection_by",
    "reprojection_summary",
    "residual_patterns",
    "rmse_difference",
    "rmse_of_inverse_poses",
    "scaled_covariance",
    "segment_errors",
    "share_inside_bounds",
    "sigma_ratio",
    "state_error",
    "state_nees",
    "summarized",
    "time_coverage",
    "time_offset",
    "track_chi_square",
    "travel_direction_misfit",
    "trust",
    "truth_alignment",
    "truth_errors",
    "used_by_all",
    "velocity_and_bias_errors",
    "velocity_and_biases",
    "whitened_summary",
    "world_rotation_from_positions",
]
