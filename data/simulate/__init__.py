"""Recordings with known truth: cars and hand-held rigs, what they see and what their sensors make of it."""

from .axes import AXIS_CONVENTIONS, axes_matrix, axes_name
from .recording import Labels, simulate, simulate_with_labels
from .rig import HANDHELD, KITTI, Rig
from .settings import Simulation, Velocities, default_drive

__all__ = [
    "AXIS_CONVENTIONS",
    "HANDHELD",
    "KITTI",
    "Labels",
    "Rig",
    "Simulation",
    "Velocities",
    "axes_matrix",
    "axes_name",
    "default_drive",
    "simulate",
    "simulate_with_labels",
]
