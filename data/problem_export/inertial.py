"""Raw inertial samples and the start of an exported problem."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FloatArray, InputError

from ..formats.files.field_checks import positive
from ..imu import ImuNoise, ImuSamples
from ..problem import InverseDepthPrior, Problem
from ..problem.inertial import ImuIntervals, InertialStart, imu_intervals
from ..sequence import Sequence

START = "start_covariance"
DEPTHS = "inverse_depth_prior"
Real = Callable[..., FloatArray]
"""an array of the archive by its key and shape"""


def inertial_arrays(problem: Problem) -> dict[str, NDArray[Any]]:
    """Samples, noise and start of a problem with raw inertial data; nothing for another."""
    imu, start, cut = problem.sequence.imu, problem.start, problem.imu
    arrays: dict[str, NDArray[Any]] = {}
    if imu is not None:
        arrays |= {
            "imu_time_stamps": imu.t,
            "imu_angular_velocity": imu.angular_velocity,
            "imu_linear_acceleration": imu.specific_force,
            "imu_noise": imu.noise.densities,
            "gravity": np.array(imu.gravity),
            "up_imu": np.asarray(problem.sequence.up_imu),
        }
    if problem.inverse_depth_prior is not None:
        arrays[DEPTHS] = np.array([problem.inverse_depth_prior.mean, problem.inverse_depth_prior.sigma])
    if cut is not None:
        arrays["interval_noise"] = cut.densities
    if start is not None:
        arrays |= {
            "start_velocity": start.velocity,
            "start_gyroscope_bias": start.gyroscope_bias,
            "start_accelerometer_bias": start.accelerometer_bias,
            START: start.covariance,
        }
    return arrays


def inertial_scalars(problem: Problem) -> dict[str, Any]:
    """Method of the start, and values that are small enough for the JSON."""
    imu, start = problem.sequence.imu, problem.start
    if imu is None or start is None:
        return {}
    return {"start": start.source, "imu_noise": imu.noise.densities.tolist(), "gravity": imu.gravity}


def read_samples(real: Real) -> ImuSamples:
    """The samples of an exported problem. Raises InputError as `ImuSamples`."""
    t = real("imu_time_stamps", None)
    return ImuSamples(
        t,
        real("imu_angular_velocity", len(t), 3),
        real("imu_linear_acceleration", len(t), 3),
        ImuNoise(*real("imu_noise", 4).tolist()),
        float(real("gravity")),
    )


def interval_noise(real: Real, sequence: Sequence) -> ImuIntervals:
    """The samples cut at the frames, with the exported noise of each interval."""
    assert sequence.imu is not None
    densities = real("interval_noise", sequence.n_frames - 1, 4)
    if (densities[:, [0, 2]] <= 0.0).any() or (densities < 0.0).any():
        raise InputError("interval_noise: densities must be positive, and walks not negative; export the problem again")
    return replace(imu_intervals(sequence.imu, sequence.t), densities=densities)


def read_depths(real: Real) -> InverseDepthPrior:
    """The prior of inverse depths of an exported problem."""
    mean, sigma = real(DEPTHS, 2).tolist()
    return InverseDepthPrior(positive(DEPTHS, np.array(mean), "1/m"), positive(DEPTHS, np.array(sigma), "1/m"))


def read_start(real: Real, source: str) -> InertialStart:
    """The start of an exported problem."""
    return InertialStart(
        velocity=real("start_velocity", 3),
        gyroscope_bias=real("start_gyroscope_bias", 3),
        accelerometer_bias=real("start_accelerometer_bias", 3),
        covariance=real(START, 15, 15),
        source=source,
    )
