"""Trajectories in an npz: `t` (n,) s and `world_T_body` (n, 4, 4), and with them, if wanted, `covariance` (n, 6, 6).

The covariance is that of the right perturbation [v, w] of each pose, m and rad. A recording in our own npz is read as
the trajectory of its ground truth.
"""

import zipfile
from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from ...observations import BoolArray
from ..files.atomic_write import atomic_write
from ..files.file_errors import FilePath
from ..files.npz_archive import NpzArchive
from ..files.npz_member import write_member
from ..stamps.frame_stamps import read_stamps
from .checks import EXACT, READ_TOLERANCE, writable

KEYS = {"t": "world_T_body", "time_stamps": "ground_truth"}
"""stamps and poses: ours, and those of a recording"""
COVARIANCE = "covariance"


def read_trajectory_npz(file: Path) -> tuple[FloatArray, FloatArray, FloatArray | None, list[str]]:
    """Stamps (n,), s, poses (n, 4, 4), covariances (n, 6, 6) if the file has them, NaN where there is none; remarks.

    All-NaN poses are left out, repeated stamps too and with a remark. Raises InputError naming the key and the pose.
    """
    with NpzArchive(file) as archive:
        name, key = next(((t, poses) for t, poses in KEYS.items() if poses in archive.keys), ("t", "world_T_body"))
        stamps = read_stamps(name, archive.array(name))
        n, poses = len(stamps.kept), archive.array(key)
        if poses.shape != (n, 4, 4):
            raise InputError(f"{key}: expected shape ({n}, 4, 4) for the {n} time stamps, got {poses.shape}")
        known: BoolArray = stamps.kept & ~np.isnan(poses).all(axis=(1, 2))
        covariance = archive.array(COVARIANCE) if COVARIANCE in archive.keys else None
        if covariance is not None and covariance.shape != (n, 6, 6):
            raise InputError(f"{COVARIANCE}: expected shape ({n}, 6, 6), got {covariance.shape}")
    if not known.any():
        raise InputError(f"{key}: every pose is NaN, so there is no trajectory; write the poses")
    repeated = [found.sentence.rstrip(".") for found in stamps.findings if found.code == "repeated_stamps"]
    return (
        stamps.t[known[stamps.kept]],
        _rigid(key, poses, known),
        None if covariance is None else covariance[known],
        repeated,
    )


def write_trajectory_npz(
    path: FilePath, t: FloatArray, world_T_body: FloatArray, covariance: FloatArray | None = None
) -> None:
    """Writes stamps (n,), s, poses (n, 4, 4) and covariances (n, 6, 6), all or nothing; all-NaN poses are left out.

    `read_trajectory` gives them back bit by bit. Raises InputError when a stamp does not rise, a pose is no rigid
    motion, there are fewer than two, or the file cannot be written.
    """
    stamps, poses = writable(t, world_T_body)
    if len(stamps) < 2:
        raise InputError(f"a trajectory in an npz needs at least 2 poses, this one has {len(stamps)}")
    arrays = {"t": stamps, "world_T_body": poses}
    if covariance is not None:
        if covariance.shape != (len(t), 6, 6):
            raise InputError(f"{COVARIANCE}: expected shape ({len(t)}, 6, 6), got {covariance.shape}")
        arrays[COVARIANCE] = covariance[~np.isnan(np.asarray(world_T_body)).all(axis=(1, 2))]
    with atomic_write(path) as file, zipfile.ZipFile(file, "w") as archive:
        for key, array in arrays.items():
            write_member(archive, key, array.shape, [array])


def _rigid(key: str, poses: FloatArray, known: BoolArray) -> FloatArray:
    """The known ones of poses (n, 4, 4), rotations made exact. Raises InputError naming the first that is not rigid."""
    chosen: FloatArray = poses[known].copy()
    defect = np.where(np.isfinite(chosen).all(axis=(1, 2)), 0.0, np.inf)
    finite = defect == 0.0
    defect[finite] = so3.orthogonality_error(chosen[finite, :3, :3])
    defect[(chosen[:, 3] != [0.0, 0.0, 0.0, 1.0]).any(axis=1)] = np.inf
    wrong = np.flatnonzero(~(defect <= READ_TOLERANCE))
    if len(wrong):
        k = int(np.flatnonzero(known)[wrong[0]])
        raise InputError(
            f"{key}: the pose {k} is not a rigid motion: {poses[k].tolist()}; write a pose, or NaN in all its entries"
        )
    rough = defect > EXACT
    chosen[rough, :3, :3] = so3.nearest_rotations(chosen[rough, :3, :3])
    return chosen
