"""Readers and writers: recordings (course npz, ours, UTIAS .mat), trajectories and truth (TUM, KITTI, EuRoC, npz)."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .recordings.ground_truth import BodyFrame, attach_truth
    from .recordings.landmark_file import read_landmarks
    from .recordings.npz_writer import write_npz
    from .recordings.reader import read
    from .trajectories.columns import Order
    from .trajectories.euroc import read_euroc, write_euroc
    from .trajectories.format_detection import TrajectoryFormat
    from .trajectories.kitti import read_kitti, read_times, write_kitti
    from .trajectories.npz import write_trajectory_npz
    from .trajectories.parsed_trajectory import ParsedTrajectory
    from .trajectories.reader import read_pose_covariances, read_trajectory, read_trajectory_file
    from .trajectories.tum import read_tum, write_tum
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "trajectories.columns": "Order",
            "trajectories.euroc": "read_euroc write_euroc",
            "trajectories.tum": "read_tum write_tum",
            "recordings.ground_truth": "BodyFrame attach_truth",
            "trajectories.kitti": "read_kitti read_times write_kitti",
            "recordings.landmark_file": "read_landmarks",
            "recordings.npz_writer": "write_npz",
            "trajectories.parsed_trajectory": "ParsedTrajectory",
            "recordings.reader": "read",
            "trajectories.npz": "write_trajectory_npz",
            "trajectories.format_detection": "TrajectoryFormat",
            "trajectories.reader": "read_pose_covariances read_trajectory read_trajectory_file",
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
