"""Simulated recording: path, tracks and sensor data."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3, so3
from fgbaseline.geometry.monocular_camera import left_of

from ..observations import BoolArray, IntArray, Observations
from ..sequence import Sequence, Truth
from ..wording import per_cent
from .camera_view import CameraView
from .inertial import recorded_samples, standing_start
from .match_errors import displaced, noisy_pixels, wrong_matches
from .random_streams import RandomStream, generator
from .roads import drive, highway_road, loop_road, town_road
from .settings import MAX_FRAMES, Simulation
from .simulated_path import Path, drone_path, followed, handheld_path, path_along, time_grid
from .tracks import Tracking, Tracks, follow
from .velocities import recorded_velocities
from .worlds.moving_objects import MovingObjects
from .worlds.room import Room
from .worlds.street import Street


@dataclass(frozen=True, eq=False, slots=True)
class Labels:
    """Labels of the errors of n simulated observations."""

    wrong: BoolArray
    """(n,) wrong matches"""
    moving: BoolArray
    """(n,) points on things that move"""


def simulate(settings: Simulation) -> Sequence:
    """Simulated recording with ground truth in the IMU frame at frame 0; equal settings give equal bytes.

    Landmarks on moving objects have no true position: their rows are NaN. Raises InputError where `along` cannot be
    followed.
    """
    return simulate_with_labels(settings)[0]


def simulate_with_labels(settings: Simulation) -> tuple[Sequence, Labels]:
    """Simulated recording, and labels of wrong and moving observations."""
    rig = settings.mount
    t, level = _path(settings)
    origin = _origin(level.at(t[:1])[0], upright=settings.imu is not None)
    path = level.moved(origin)
    poses = path.at(t)
    if settings.imu is None:
        poses[0] = np.eye(4)

    static, moving = _tracks(path.of(rig.body_pose), poses, t, settings)
    m = len(static.first)
    tracks = Tracks(
        np.concatenate([static.frame, moving.frame]),
        np.concatenate([static.track, moving.track + m]),
        np.concatenate([static.point, moving.point]),
        np.concatenate([static.first, np.full_like(moving.first, np.nan)]),
    )
    cameras = poses @ rig.imu_T_cam
    pixel = rig.camera.project(se3.transform(se3.inverse(cameras)[tracks.frame], tracks.point))
    wrong, offset = wrong_matches(tracks.frame, tracks.track, t, settings)
    pixel = displaced(noisy_pixels(pixel, settings), offset, rig)

    if settings.cameras == "left":
        pixel[:, 2:] = np.nan
    order = np.lexsort((tracks.track, tracks.frame))
    truth = Truth(poses, tracks.first, "simulated")
    linear = angular = np.empty((0, 3))
    samples = None
    if settings.imu is None:
        linear, angular = recorded_velocities(path, t, settings)
    else:
        samples, velocity, gyroscope_bias, accelerometer_bias = recorded_samples(path, t, settings)
        truth = replace(
            truth,
            velocity=velocity,
            gyroscope_bias=gyroscope_bias,
            accelerometer_bias=accelerometer_bias,
            up=np.array([0.0, 0.0, 1.0]),
        )
    sequence = Sequence(
        name=f"simulated-{settings.path}",
        t=t,
        linear_velocity=linear,
        angular_velocity=angular,
        camera=rig.camera if settings.cameras == "stereo" else left_of(rig.camera),
        imu_T_cam=rig.imu_T_cam.copy(),
        observations=Observations(tracks.frame[order], tracks.track[order], pixel[order]),
        n_landmarks=len(tracks.first),
        imu=samples,
        truth=truth,
        up_imu=poses[0, :3, :3].T @ origin[:3, 2],
        form="simulated",
        source=f"simulated: {_described(settings)}",
        remarks=_remarks(settings, wrong),
    )
    return sequence, Labels(wrong[order], tracks.track[order] >= m)


def _origin(first: FloatArray, *, upright: bool) -> FloatArray:
    """`world_T_level` (4, 4) for the first pose (4, 4) in a level world: the world is the first IMU frame.

    An upright world has its z axis up and is turned from that frame by the smallest rotation.
    """
    if not upright:
        return se3.inverse(first)
    world_T_imu = np.eye(4)
    world_T_imu[:3, :3] = so3.rotation_to_z(first[2, :3])
    return world_T_imu @ se3.inverse(first)


def _path(settings: Simulation) -> tuple[FloatArray, Path]:
    """The frames' times (T,) s, and the IMU's path in a level world: z up."""
    t, path = _moving_path(settings)
    return t, standing_start(path, settings.standing) if settings.standing else path


def _moving_path(settings: Simulation) -> tuple[FloatArray, Path]:
    imu_T_body = settings.mount.body_pose
    if settings.path == "along":
        velocities = followed(settings)
        path = path_along(velocities).moved(se3.inverse(imu_T_body))
        if settings.frame_rate is None:
            return velocities.t, path
        frames = velocities.t[-1] * settings.frame_rate
        if not frames < MAX_FRAMES:
            raise InputError(
                f"frame_rate: {settings.frame_rate:g} Hz are {frames:.3g} frames over the {velocities.t[-1]:g} s of "
                f"along, at most {MAX_FRAMES} are simulated; give a duration"
            )
        t = np.arange(0.0, velocities.t[-1] + 1e-9, 1.0 / settings.frame_rate)
        if len(t) < 2:
            raise InputError(
                f"frame_rate: {settings.frame_rate:g} Hz leaves one frame of the {velocities.t[-1]:g} s of along"
            )
        return t, path
    t = np.arange(round(settings.seconds * settings.rate)) / settings.rate
    grid = time_grid(float(t[-1]), settings.rate)
    rng = generator(settings.seed, RandomStream.PATH)
    if settings.path in ("handheld", "drone"):
        shape = handheld_path if settings.path == "handheld" else drone_path
        return t, shape(grid, rng).of(se3.inverse(imu_T_body))
    seconds = float(grid[-1] - grid[0])
    if settings.path == "town":
        road = town_road(13.0 * seconds + 100.0, rng)
    elif settings.path == "highway":
        road = highway_road(34.0 * seconds + 100.0, rng)
    else:
        lap = float(t[-1]) / max(1, round(float(t[-1]) / 60.0))
        road = loop_road(max(8.0, 200.0 / lap) * seconds + 100.0, lap)
    return t, drive(road, grid, rng).of(se3.inverse(imu_T_body))


def _tracks(body: Path, poses: FloatArray, t: FloatArray, settings: Simulation) -> tuple[Tracks, Tracks]:
    """Tracks of what stands still, and of what moves, seen along the IMU's poses (T, 4, 4)."""
    rig = settings.mount
    nearest, farthest = settings.depths
    seeing = np.ones(len(t), dtype=np.bool_)
    for start, end in settings.blackouts:
        seeing &= (t < start) | (t > end)
    # px: noise never moves a pixel out of the image; constant for small noise, so that tracks do not depend on it
    border = max(5.0, 5.0 * settings.sigma_pixel)
    sight = CameraView(rig, se3.inverse(poses @ rig.imu_T_cam), nearest, border, seeing)
    scenery = generator(settings.seed, RandomStream.SCENERY)
    if settings.scene == "room":
        points: Callable[[FloatArray, np.random.Generator], FloatArray] = Room(body, rig).points
    else:
        points = Street(body, rig.imu_above_ground, settings.path == "highway", scenery).points

    def standing(birth: IntArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        return points(t[birth], rng), np.zeros((len(birth), 3))

    how = Tracking(
        settings.features_per_frame,
        settings.track_length,
        farthest,
        settings.returning_share,
        max(1, round(settings.return_after / float(np.median(np.diff(t))))),
    )
    static = follow(
        standing,
        sight,
        t,
        how,
        generator(settings.seed, RandomStream.TRACKS),
        generator(settings.seed, RandomStream.RETURNS),
    )
    traffic = generator(settings.seed, RandomStream.TRAFFIC)
    share = settings.moving_share
    how = Tracking(settings.features_per_frame * share / (1.0 - share), settings.track_length, farthest)
    moving = follow(MovingObjects(body, t, settings.scene, traffic).points, sight, t, how, traffic, traffic)
    return static, moving


def _described(settings: Simulation) -> str:
    """The settings that are not at their defaults, and the seed."""
    parts: list[str] = [settings.path]
    for field in fields(settings):
        value = getattr(settings, field.name)
        if field.name not in ("path", "along", "rig") and (value != field.default or field.name == "seed"):
            parts.append(f"{field.name} {value}")
    return ", ".join(parts)


def _remarks(settings: Simulation, wrong: BoolArray) -> tuple[str, ...]:
    share = float(wrong.mean()) if len(wrong) else 0.0
    imu = settings.imu
    if imu is not None:
        return (
            f"simulated: raw inertial samples at {imu.rate:g} Hz with {imu.gyroscope_density:g} rad/s/sqrt(Hz) and "
            f"{imu.accelerometer_density:g} m/s^2/sqrt(Hz), pixels with {settings.sigma_pixel:g} px a row, "
            f"{per_cent(share)} wrong matches",
        )
    return (
        f"simulated: velocities with noise of {settings.sigma_linear:g} m/s and {settings.sigma_angular:g} rad/s a "
        f"sample, pixels with {settings.sigma_pixel:g} px a row, {per_cent(share)} wrong matches",
    )
