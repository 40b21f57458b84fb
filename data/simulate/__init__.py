"""Recordings with known truth: cars and hand-held rigs, what they see and what their sensors make of it.

A simulated town lies among the real recordings; `pytest -s tests/data/test_simulate_likeness.py` prints:

                            observations a frame      frames a track            depth, m
                             mean    5 %   95 %   mean  25 %  50 %  75 %  95 %   5 %  25 %  50 %  75 %  95 %
    03                       65.7   42.0  100.0   13.0     5     8    15    37    10    24    49   100   241
    0027                     68.4   48.0   99.0   19.2     7    12    23    63     8    16    27    57   182
    26_drive_0001_sync_KLT   97.2   48.0  174.9   14.9     6    12    21    38    17    28    38    52    70
    26_drive_0005_sync_KLT   90.3   47.3  156.4   15.3     6    11    20    44     9    14    19    30    59
    26_drive_0009_sync_KLT   59.9   20.0  117.5   18.3     6    11    21    65    13    27    38    54   119
    26_drive_0036_sync_KLT   70.1   45.0  106.5   14.8     5    10    18    44    16    29    44    63    98
    30_drive_0027_sync_KLT   89.1   49.0  147.0   15.9     6    12    21    42     8    14    24    46    96
    simulated, 10 seeds      69.9   47.9   93.1   14.2     6    10    18    39    11    21    38    71   134
"""

from ..axis_conventions import AXIS_CONVENTIONS, axes_matrix, axes_name
from .recording import Labels, simulate, simulate_with_labels
from .rig import HANDHELD, KITTI, Rig
from .settings import SimulatedImu, Simulation, Velocities, default_drive

__all__ = [
    "AXIS_CONVENTIONS",
    "HANDHELD",
    "KITTI",
    "Labels",
    "Rig",
    "SimulatedImu",
    "Simulation",
    "Velocities",
    "axes_matrix",
    "axes_name",
    "default_drive",
    "simulate",
    "simulate_with_labels",
]
