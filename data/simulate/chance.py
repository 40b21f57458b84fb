"""One random generator per concern, so that turning on one kind of noise leaves all the others as they were."""

from enum import IntEnum

import numpy as np


class Concern(IntEnum):
    """What random numbers are drawn for; the values are part of what makes a seed repeat, so only ever append."""

    PATH = 0
    SCENERY = 1
    TRACKS = 2
    PIXELS = 3
    VELOCITIES = 4
    WRONG_MATCHES = 5
    BURSTS = 6
    TRAFFIC = 7
    RETURNS = 8
    IMU_NOISE = 9
    IMU_BIAS = 10


def generator(seed: int, concern: Concern) -> np.random.Generator:
    """The generator of one concern: an independent child of `seed`."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(int(concern),))))
