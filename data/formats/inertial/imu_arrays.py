"""Raw inertial samples and the true state in an npz.

| key | shape |
|---|---|
| `imu_time_stamps` | (1, M) or (M,), in the clock and unit of `time_stamps` |
| `imu_angular_velocity` | (3, M) rad/s |
| `imu_linear_acceleration` | (3, M) m/s^2, the specific force: +gravity upward at rest |
| `imu_noise` | (4,) gyroscope density and walk, accelerometer density and walk; may be absent |
| `gravity` | () m/s^2, magnitude; may be absent |
| `true_velocity` | (3, T) m/s in the world of `ground_truth`, whose z axis points up; may be absent |
| `true_gyroscope_bias`, `true_accelerometer_bias` | (3, T) rad/s, m/s^2; may be absent |
"""

from dataclasses import replace
from typing import Any

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...imu import ASSUMED_NOISE, STANDARD_GRAVITY, ImuNoise, ImuSamples
from ...sequence import Truth
from ..files.field_checks import positive
from ..files.npz_archive import NpzArchive
from .imu_samples import RawSamples, imu_samples

STAMPS = "imu_time_stamps"
RATE, FORCE, NOISE, GRAVITY = "imu_angular_velocity", "imu_linear_acceleration", "imu_noise", "gravity"
STATE_TRUTH = ("velocity", "gyroscope_bias", "accelerometer_bias")


def read_imu_arrays(archive: NpzArchive) -> RawSamples:
    """The samples in an open npz. Raises InputError naming the key."""
    t = archive.array(STAMPS)
    if not (t.ndim == 1 or (t.ndim == 2 and t.shape[0] == 1)):
        raise InputError(f"{STAMPS}: expected shape (1, M), got {t.shape}; write one row of stamps")
    t = t.reshape(-1)
    rate, force = (_vectors(archive, key, len(t), f" for the {len(t)} stamps of {STAMPS}") for key in (RATE, FORCE))
    remarks: list[str] = []
    noise, gravity = ASSUMED_NOISE, STANDARD_GRAVITY
    if NOISE in archive.keys:
        densities = archive.array(NOISE)
        if densities.shape != (4,):
            raise InputError(f"{NOISE}: expected 4 numbers (see docs/imu.md), got shape {densities.shape}")
        noise = ImuNoise(*densities.tolist())
    else:
        remarks.append(assumed_noise(f"{NOISE} is absent"))
    if GRAVITY in archive.keys:
        gravity = positive(GRAVITY, archive.array(GRAVITY), "the magnitude of gravity in m/s^2")
    samples, findings = imu_samples(t, rate, force, noise, gravity)
    return RawSamples(samples, tuple(remarks), findings)


def assumed_noise(why: str) -> str:
    """A remark: the densities that stand in for those of the unit."""
    n = ASSUMED_NOISE
    return (
        f"{why}: gyroscope {n.gyroscope_density:g} rad/s/sqrt(Hz) with walk {n.gyroscope_walk:g}, accelerometer "
        f"{n.accelerometer_density:g} m/s^2/sqrt(Hz) with walk {n.accelerometer_walk:g} are assumed."
    )


def _vectors(archive: NpzArchive, key: str, n: int, why: str = "") -> FloatArray:
    """Vectors (n, 3) of an array (3, n)."""
    array = archive.array(key)
    if array.shape != (3, n):
        raise InputError(f"{key}: expected shape (3, {n}){why}, got {array.shape}")
    return np.ascontiguousarray(array.T)


def read_state_truth(archive: NpzArchive, truth: Truth) -> Truth:
    """The truth with the velocity and the biases of the npz, where it has them."""
    keys, T = {name: f"true_{name}" for name in STATE_TRUTH}, len(truth.world_T_imu)
    state: dict[str, Any] = {name: _vectors(archive, key, T) for name, key in keys.items() if key in archive.keys}
    return replace(truth, **state)


def imu_arrays(imu: ImuSamples) -> dict[str, FloatArray]:
    """The arrays of samples, by their keys."""
    return {
        STAMPS: imu.t[None, :],
        RATE: imu.angular_velocity.T,
        FORCE: imu.specific_force.T,
        NOISE: imu.noise.densities,
        GRAVITY: np.array(imu.gravity),
    }


def state_truth_arrays(truth: Truth) -> dict[str, FloatArray]:
    """The arrays of a true velocity and of true biases, by their keys."""
    values = {f"true_{name}": getattr(truth, name) for name in STATE_TRUTH}
    return {key: array.T for key, array in values.items() if array is not None}
