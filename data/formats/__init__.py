"""Readers and writers: recordings (course npz, our own npz, UTIAS .mat), trajectories and truth (TUM, KITTI)."""

from .ground_truth import BodyFrame, attach_truth
from .kitti import read_kitti
from .npz_writer import write_npz
from .recording import read
from .tum import read_tum, write_tum

__all__ = ["BodyFrame", "attach_truth", "read", "read_kitti", "read_tum", "write_npz", "write_tum"]
