"""Readers and writers: recordings (course npz, ours, UTIAS .mat), trajectories and truth (TUM, KITTI, EuRoC, npz)."""

from .euroc import read_euroc, write_euroc
from .ground_truth import BodyFrame, attach_truth
from .kitti import read_kitti, read_times, write_kitti
from .landmark_file import read_landmarks
from .npz_writer import write_npz
from .recording import read
from .trajectory_file import TrajectoryFormat, read_pose_covariances, read_trajectory
from .trajectory_npz import write_trajectory_npz
from .tum import read_tum, write_tum

__all__ = [
    "BodyFrame",
    "TrajectoryFormat",
    "attach_truth",
    "read",
    "read_euroc",
    "read_kitti",
    "read_landmarks",
    "read_pose_covariances",
    "read_times",
    "read_trajectory",
    "read_tum",
    "write_euroc",
    "write_kitti",
    "write_npz",
    "write_trajectory_npz",
    "write_tum",
]
