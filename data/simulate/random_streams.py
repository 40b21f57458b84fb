"""Random streams of a simulation, one per purpose, so that one kind of noise does not change the others."""

from enum import IntEnum

import numpy as np


class RandomStream(IntEnum):
    """Purpose of a random stream. A seed reproduces by these values, so only append."""

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


def generator(seed: int, concern: RandomStream) -> np.random.Generator:
    """Random generator of one purpose: an independent child of `seed`."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(int(concern),))))
