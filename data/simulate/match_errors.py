"""Errors of simulated matches: pixel noise on all, and a share of wrong matches."""

import numpy as np

from fgbaseline.geometry import FloatArray

from ..observations import BoolArray, IntArray
from .random_streams import RandomStream, generator
from .rig import Rig
from .settings import Simulation


def noisy_pixels(pixel: FloatArray, settings: Simulation) -> FloatArray:
    """Pixels (n, 4) with noise of `sigma_pixel` on every row, that of vL and vR with `row_correlation`."""
    noise: FloatArray = generator(settings.seed, RandomStream.PIXELS).standard_normal(pixel.shape)
    shared = settings.row_correlation
    if shared:
        noise[:, 3] = shared * noise[:, 1] + np.sqrt(1.0 - shared**2) * noise[:, 3]
    return pixel + settings.sigma_pixel * noise


def wrong_matches(
    frame: IntArray, track: IntArray, t: FloatArray, settings: Simulation
) -> tuple[BoolArray, FloatArray]:
    """Mask (n,) of wrong observations, and their offsets (n, 4), px."""
    rng = generator(settings.seed, RandomStream.WRONG_MATCHES)
    n, m = len(frame), int(track.max(initial=-1)) + 1
    single = rng.random(n) < 0.5 * settings.wrong_share
    offset = displacements(n, rng)
    length = np.bincount(track, minlength=m)
    # A track of n observations that slips has (n - 1) / 2 wrong ones on average: its first is where it was found.
    slips, when = rng.random(m) < settings.wrong_share * n / max(n - m, 1), rng.random(m)
    slip_offset = displacements(m, rng)
    age = np.arange(n) - (np.cumsum(length) - length)[track]
    slipped = slips[track] & (age >= np.maximum(when * length, 1e-9)[track])
    wrong = single | slipped
    offset[slipped] = slip_offset[track[slipped]]

    rng = generator(settings.seed, RandomStream.BURSTS)
    chance, burst_offset = rng.random(n), displacements(n, rng)
    for start, end, share in settings.bursts:
        hit = (t[frame] >= start) & (t[frame] <= end) & (chance < share) & ~wrong
        offset[hit] = burst_offset[hit]
        wrong |= hit
    offset[~wrong] = 0.0
    return wrong, offset


def displacements(n: int, rng: np.random.Generator) -> FloatArray:
    """Errors of wrong matches (n, 4), px: seven in ten in both images alike, by 8 to 100 px; the rest along the right
    image's row only, by 5 to 60 px, which spoils the depth."""
    size = rng.lognormal(np.log(28.0), 0.6, n).clip(8.0, 100.0)
    angle = rng.uniform(0.0, 2.0 * np.pi, n)
    du, dv = size * np.cos(angle), 0.6 * size * np.sin(angle)
    both = np.stack([du, dv, du, dv], axis=1)
    right = np.zeros((n, 4))
    right[:, 2] = np.where(rng.random(n) < 0.5, 1.0, -1.0) * rng.lognormal(np.log(18.0), 0.5, n).clip(5.0, 60.0)
    return np.where((rng.random(n) < 0.7)[:, None], both, right)


def displaced(pixel: FloatArray, offset: FloatArray, rig: Rig) -> FloatArray:
    """Pixels (n, 4) moved by offsets (n, 4) and kept inside the images: where they would leave, the other way."""
    bound = np.array([rig.width, rig.height, rig.width, rig.height]) - 2.0
    out = (pixel + offset < 1.0) | (pixel + offset > bound)
    # Both offsets of a pair change sign together, so that their disparity and row difference remain.
    u_out, v_out = out[:, 0] | out[:, 2], out[:, 1] | out[:, 3]
    turned = np.where(np.stack([u_out, v_out, u_out, v_out], axis=1), -offset, offset)
    return np.where(offset != 0.0, np.clip(pixel + turned, 1.0, bound), pixel)
