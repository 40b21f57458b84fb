"""Cars on roads: a road is a curvature and a speed limit per meter; a drive turns it into a path."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray

from .simulated_path import Path

STEP = 0.1
"""m between the stations of a road"""


@dataclass(frozen=True, eq=False, slots=True)
class Road:
    """Center line that a car follows, at stations every `STEP` m."""

    curvature: FloatArray
    """(n,) 1/m, positive to the left"""
    speed: FloatArray
    """(n,) m/s, at most"""
    stops: tuple[tuple[float, float], ...] = ()
    """(station in m, seconds) of red lights"""
    period: float | None = None
    """m, where the road closes on itself"""
    cruise: float = 10.0
    """m/s, at which the bumps of the road are felt as on the real recordings"""


def town_road(length: float, rng: np.random.Generator) -> Road:
    """Blocks of 60 to 130 m; at a crossing the car turns by a right angle, waits at a light or drives on."""
    n = int(length / STEP) + 1
    station = np.arange(n) * STEP
    curvature = 5e-4 * np.sin(2.0 * np.pi * station / rng.uniform(150.0, 250.0) + rng.uniform(0.0, 6.28))
    speed = 11.0 + 1.5 * np.sin(2.0 * np.pi * station / rng.uniform(180.0, 320.0) + rng.uniform(0.0, 6.28))
    stops = []
    here, heading = 0.0, 0
    actions: list[str] = []
    while True:
        here += rng.uniform(60.0, 130.0)
        if here > length - 60.0:
            break
        actions = actions or list(rng.permutation(["turn", "light", "turn", "on"]))
        action = actions.pop()
        if action == "light":
            stops.append((here, rng.uniform(3.0, 7.0)))
        elif action == "turn":
            # Streets lead ahead, left and right of where the drive began, never back.
            turn = -heading if heading else int(rng.choice([-1, 1]))
            heading += turn
            arc = 22.0 if turn < 0 else 28.0
            inside = (station >= here) & (station < here + arc)
            angle = turn * (0.5 * np.pi + rng.normal(0.0, 0.03))
            curvature[inside] += angle / arc * (1.0 - np.cos(2.0 * np.pi * (station[inside] - here) / arc))
            speed[inside] = 4.5 if turn < 0 else 5.5
            here += arc
    return Road(curvature, speed, tuple(stops))


def highway_road(length: float, rng: np.random.Generator) -> Road:
    """Long bends of 600 m radius and more at 25 to 33 m/s."""
    station = np.arange(int(length / STEP) + 1) * STEP
    bends = sum(
        np.sin(2.0 * np.pi * station / rng.uniform(900.0, 3000.0) + rng.uniform(0.0, 6.28)) / 2400.0 for _ in range(4)
    )
    speed = 29.0 + 4.0 * np.sin(2.0 * np.pi * station / rng.uniform(800.0, 1500.0) + rng.uniform(0.0, 6.28))
    return Road(np.asarray(bends), speed, cruise=30.0)


def loop_road(length: float, lap_seconds: float) -> Road:
    """Round a block, for `length` m, at the constant speed that closes a lap in `lap_seconds`: 8 m/s or faster."""
    arc = 40.0
    lap = max(8.0 * lap_seconds, 5.0 * arc)
    long, short = (0.3 * (lap - 4.0 * arc), 0.2 * (lap - 4.0 * arc))
    station = np.arange(int(length / STEP) + 1) * STEP
    curvature = np.zeros(len(station))
    along = station % lap
    corner = 0.5 * long
    for leg in (short, long, short, long):
        inside = (along >= corner) & (along < corner + arc)
        curvature[inside] = 0.5 * np.pi / arc * (1.0 - np.cos(2.0 * np.pi * (along[inside] - corner) / arc))
        corner += arc + leg
    return Road(curvature, np.full(len(station), lap / lap_seconds), period=lap)


def drive(road: Road, t: FloatArray, rng: np.random.Generator) -> Path:
    """The path (times (g,), evenly spaced) of a car on a road: it slows for corners, rolls, pitches, climbs."""
    s = _traveled(road, t)
    station = np.arange(len(road.curvature)) * STEP
    yaw_at = np.concatenate([[0.0], np.cumsum(0.5 * (road.curvature[1:] + road.curvature[:-1]) * STEP)])
    yaw = np.interp(s, station, yaw_at)
    # bumps of 12 to 80 m felt as about 0.012 rad/s RMS in pitch and roll, hills of 150 to 500 m and 1 %
    waves = np.geomspace(12.0, 80.0, 6)
    bumps = 0.012 / np.sqrt(3.0) * waves / (2.0 * np.pi * road.cruise)
    pitch = _sines(s, waves, bumps, road.period, rng)
    roll = _sines(s, waves, bumps, road.period, rng)
    slope = _sines(s, np.array([150.0, 260.0, 500.0]), np.full(3, 0.006), road.period, rng)

    h = float(t[1] - t[0])
    speed = np.gradient(s, h)
    braking = -np.gradient(speed, h)
    sideways = speed * np.gradient(yaw, h)
    pitch = pitch + 0.003 * braking - slope
    roll = roll + 0.003 * sideways

    poses = np.zeros((len(t), 4, 4))
    poses[:, :3, :3] = _rotation(yaw, pitch, roll)
    mid_yaw, mid_slope = 0.5 * (yaw[1:] + yaw[:-1]), 0.5 * (slope[1:] + slope[:-1])
    forward = np.stack(
        [np.cos(mid_yaw) * np.cos(mid_slope), np.sin(mid_yaw) * np.cos(mid_slope), np.sin(mid_slope)], axis=1
    )
    poses[1:, :3, 3] = np.cumsum(np.diff(s)[:, None] * forward, axis=0)
    poses[:, 3, 3] = 1.0
    return Path.through(t, poses)


def _traveled(road: Road, t: FloatArray) -> FloatArray:
    """Meters along the road (g,) at times (g,): within the limits, 1.5 m/s^2 up and 2 m/s^2 down, no sudden jerk."""
    station = np.arange(len(road.speed)) * STEP
    square = road.speed**2
    for where, _ in road.stops:
        square[round(where / STEP)] = 0.2**2
    up = np.minimum.accumulate(square - 3.0 * station) + 3.0 * station
    down = (np.minimum.accumulate((square + 4.0 * station)[::-1]))[::-1] - 4.0 * station
    speed = np.sqrt(np.minimum(up, down))
    when = np.concatenate([[0.0], np.cumsum(2.0 * STEP / (speed[1:] + speed[:-1]))])
    for where, seconds in reversed(road.stops):
        i = round(where / STEP)
        when = np.concatenate([when[: i + 1], when[i:] + seconds])
        station = np.concatenate([station[: i + 1], station[i:]])
    traveled = np.interp(t - t[0], when, station)
    h = float(t[1] - t[0])
    window = np.hanning(2 * round(0.6 / h) + 1)[1:-1]
    half = len(window) // 2
    velocity = np.pad(np.diff(traveled) / h, half, mode="edge")
    smooth = np.convolve(velocity, window / window.sum(), mode="valid")
    return np.concatenate([[0.0], np.cumsum(np.maximum(smooth, 0.0) * h)])


def _sines(
    s: FloatArray, wavelength: FloatArray, amplitude: FloatArray, period: float | None, rng: np.random.Generator
) -> FloatArray:
    """A sum of sines of the station (g,), with random phases and wavelengths near the given ones that fit `period`."""
    wavelength = wavelength * rng.uniform(0.9, 1.1, len(wavelength))
    phase = rng.uniform(0.0, 2.0 * np.pi, len(wavelength))
    if period is not None:
        wavelength = period / np.maximum(np.round(period / wavelength), 1.0)
    total = np.zeros(len(s))
    for size, length, start in zip(amplitude, wavelength, phase, strict=True):
        total += size * np.sin(2.0 * np.pi * s / length + start)
    return total


def _rotation(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """Rotations (g, 3, 3) about z, then y, then x; with y to the left, a positive pitch looks down."""
    cy, sy, cp, sp, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(rows), -1, 0)
