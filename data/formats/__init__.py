"""Readers and writers: recordings (course npz, ours, UTIAS .mat), trajectories and truth (TUM, KITTI, EuRoC, npz)."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .euroc import read_euroc, write_euroc
    from .ground_truth import BodyFrame, attach_truth
    from .kitti import read_kitti, read_times, write_kitti
    from .landmark_file import read_landmarks
    from .npz_writer import write_npz
    from .parsed_trajectory import ParsedTrajectory
    from .recording import read
    from .trajectory_columns import Order
    from .trajectory_npz import write_trajectory_npz
    from .trajectory_opening import TrajectoryFormat
    from .trajectory_reader import read_pose_covariances, read_trajectory, read_trajectory_file
    from .tum import read_tum, write_tum
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "trajectory_columns": "Order",
            "euroc": "read_euroc write_euroc",
            "tum": "read_tum write_tum",
            "ground_truth": "BodyFrame attach_truth",
            "kitti": "read_kitti read_times write_kitti",
            "landmark_file": "read_landmarks",
            "npz_writer": "write_npz",
            "parsed_trajectory": "ParsedTrajectory",
            "recording": "read",
            "trajectory_npz": "write_trajectory_npz",
            "trajectory_opening": "TrajectoryFormat",
            "trajectory_reader": "read_pose_covariances read_trajectory read_trajectory_file",
        },
    )

__all__ = [
    "BodyFrame",
    "Order",
    "ParsedTrajectory",
    "TrajectoryFormat",
    "attach_truth",
    "read",
    "read_euroc",
    "read_kitti",
    "read_landmarks",
    "read_pose_covariances",
    "read_times",
    "read_trajectory",
    "read_trajectory_file",
    "read_tum",
    "write_euroc",
    "write_kitti",
    "write_npz",
    "write_trajectory_npz",
    "write_tum",
]
