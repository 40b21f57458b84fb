"""Velocity, gravity and accelerometer bias in closed form, with their metric scale, from rays and inertial samples.

With known rotations the camera centers are linear in velocity v, gravity g and accelerometer bias at the first
keyframe: c = v t + g t^2 / 2 + (what the samples integrate to). The points minimize their squared distances from the
rays and are eliminated (Martinelli, IJCV 2014; Dong-Si and Mourikis, IROS 2012). Scale enters by the samples, so that
no structure from motion up to scale is needed, as in VINS-Mono (Qin, Li and Shen, IEEE T-RO 2018); as there, gravity is
then held to its magnitude.
"""

import numpy as np

from fgbaseline.data.observations import BoolArray
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.geometry import FloatArray, so3, strapdown

from ...inertial_initialization.least_squares import ACCELEROMETER_BIAS_SIGMA
from ...inertial_initialization.states import Motions, States
from ...robust_constants import MAD_TO_SIGMA
from .window_tracks import Rays

ROUNDS = 5
"""rounds of depths, weights and gravity on the tangent plane of its sphere"""
PARALLEL = 1e-7
"""rad^2, smallest mean squared angle of a point's rays about their mean"""
HUBER = 2.0
NEAREST = 0.1
"""m, depth in the weights"""
UNKNOWN = 9
VELOCITY, GRAVITY, BIAS = slice(0, 3), slice(3, 6), slice(6, 9)


def closed_form(imu: ImuIntervals, rays: Rays, motions: Motions, lever: FloatArray, ray_sigma: float) -> States:
    """States of the keyframes in a world with z up; `motions` are at the gyroscope's bias, `lever` (3,) m is the camera
    on the IMU and `ray_sigma` rad the noise of a ray.

    Raises ValueError where the rays have no parallax.
    """
    R, offset, by = _linear_positions(motions)
    center = offset + R @ lever
    depth = np.ones(len(rays.point))
    weight = np.ones(len(rays.point))
    direction = (R[rays.keyframe] @ rays.direction[:, :, None])[:, :, 0]
    across = np.eye(3) - direction[:, :, None] * direction[:, None, :]
    y: FloatArray = np.zeros(UNKNOWN)
    # Only rotation separates accelerometer bias from gravity, which at first opposes the mean specific force.
    y[GRAVITY] = -_direction(np.einsum("nij,nj->i", R[:-1], motions.velocity)) * imu.gravity
    for _ in range(ROUNDS):
        scale = weight / (ray_sigma * np.maximum(depth, NEAREST)) ** 2
        H, b = _without_points(rays, across, center, by, scale)
        H[BIAS, BIAS] += np.eye(3) * ACCELEROMETER_BIAS_SIGMA**-2
        y = _held(H, b, y)
        y[GRAVITY] = _direction(y[GRAVITY]) * imu.gravity
        moved = center + by @ y
        point = _points(rays, across, moved, scale)
        apart = point[rays.point] - moved[rays.keyframe]
        depth = np.einsum("ni,ni->n", apart, direction)
        miss = np.linalg.norm((across @ apart[:, :, None])[:, :, 0], axis=1) / np.maximum(depth, NEAREST)
        bulk = max(ray_sigma, MAD_TO_SIGMA * float(np.nanmedian(miss)))
        weight = np.nan_to_num(np.minimum(1.0, HUBER * bulk / np.maximum(miss, 1e-12)))
    return _states(motions, R, y)


def _direction(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-9), dtype=np.float64)


def _linear_positions(motions: Motions) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rotations (n, 3, 3), and positions offset (n, 3) + by (n, 3, 9) y (9,) of keyframes in the first one's axes."""
    n = len(motions.dt) + 1
    R, p, v = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), np.zeros(3)
    by_p, by_v = np.zeros((n, 3, UNKNOWN)), np.zeros((3, UNKNOWN))
    by_v[:, VELOCITY] = np.eye(3)
    for i, dt in enumerate(motions.dt.tolist()):
        turn, F = motions.rotation[i], motions.transition[i]
        R[i + 1] = R[i] @ turn
        p[i + 1] = p[i] + v * dt + R[i] @ motions.position[i]
        by_p[i + 1] = by_p[i] + by_v * dt
        by_p[i + 1, :, GRAVITY] += 0.5 * dt**2 * np.eye(3)
        by_p[i + 1, :, BIAS] += R[i + 1] @ F[strapdown.TRANSLATION, strapdown.ACCELEROMETER_BIAS]
        v = v + R[i] @ motions.velocity[i]
        by_v = by_v.copy()
        by_v[:, GRAVITY] += dt * np.eye(3)
        by_v[:, BIAS] += R[i + 1] @ F[strapdown.VELOCITY, strapdown.ACCELEROMETER_BIAS]
    return R, p, by_p


def _scatter(rays: Rays, across: FloatArray, scale: FloatArray) -> FloatArray:
    """Information matrices (m, 3, 3) of the points."""
    A = np.zeros((int(rays.point.max()) + 1, 3, 3))
    np.add.at(A, rays.point, scale[:, None, None] * across)
    return A


def _solvable(A: FloatArray) -> FloatArray:
    """Inverses (m, 3, 3) of the information; zero for points without parallax. Raises ValueError where none has any."""
    eigenvalue = np.linalg.eigvalsh(A)
    good: BoolArray = np.asarray(eigenvalue[:, 0] > PARALLEL * eigenvalue[:, 2], dtype=np.bool_)
    if not good.any():
        raise ValueError("no track has parallax")
    inverse = np.zeros_like(A)
    inverse[good] = np.linalg.inv(A[good])
    return inverse


def _without_points(
    rays: Rays, across: FloatArray, center: FloatArray, by: FloatArray, scale: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Normal equations (9, 9), (9,) after the elimination of the points."""
    inverse = _solvable(_scatter(rays, across, scale))
    good = np.asarray(inverse.any(axis=(1, 2)))[rays.point]
    scaled = (scale * good)[:, None, None] * across
    C, c = by[rays.keyframe], center[rays.keyframe]
    PC, Pc = scaled @ C, (scaled @ c[:, :, None])[:, :, 0]
    sum_C, sum_c = np.zeros((len(inverse), 3, UNKNOWN)), np.zeros((len(inverse), 3))
    np.add.at(sum_C, rays.point, PC)
    np.add.at(sum_c, rays.point, Pc)
    H = np.einsum("nij,nik->jk", C, PC) - np.einsum("mij,mia,mak->jk", sum_C, inverse, sum_C)
    b = -np.einsum("nij,ni->j", C, Pc) + np.einsum("mij,mia,ma->j", sum_C, inverse, sum_c)
    return H, b


def _held(H: FloatArray, b: FloatArray, y: FloatArray) -> FloatArray:
    """Solution with gravity moved in the tangent plane at `y`."""
    tangent = np.linalg.svd(y[None, GRAVITY])[2][1:].T
    basis = np.zeros((UNKNOWN, UNKNOWN - 1))
    basis[VELOCITY, :3], basis[GRAVITY, 3:5], basis[BIAS, 5:] = np.eye(3), tangent, np.eye(3)
    fixed = np.zeros(UNKNOWN)
    fixed[GRAVITY] = y[GRAVITY]
    return np.asarray(fixed + basis @ np.linalg.solve(basis.T @ H @ basis, basis.T @ (b - H @ fixed)))


def _points(rays: Rays, across: FloatArray, moved: FloatArray, scale: FloatArray) -> FloatArray:
    """Points (m, 3) nearest to their rays from centers (n, 3); NaN without parallax."""
    inverse = _solvable(_scatter(rays, across, scale))
    sums = np.zeros((len(inverse), 3))
    np.add.at(sums, rays.point, scale[:, None] * (across @ moved[rays.keyframe][:, :, None])[:, :, 0])
    points = (inverse @ sums[:, :, None])[:, :, 0]
    points[~inverse.any(axis=(1, 2))] = np.nan
    return np.asarray(points, dtype=np.float64)


def _states(motions: Motions, R: FloatArray, y: FloatArray) -> States:
    """States along the motions from the solution, turned so that z is up."""
    gravity, bias = y[GRAVITY], y[BIAS]
    biases = motions.biases.copy()
    biases[:, 3:] += bias
    at = motions.at(biases)
    n = len(R)
    position, velocity = np.zeros((n, 3)), np.zeros((n, 3))
    velocity[0] = y[VELOCITY]
    for i, dt in enumerate(motions.dt.tolist()):
        position[i + 1] = position[i] + velocity[i] * dt + 0.5 * gravity * dt**2 + R[i] @ at.position[i]
        velocity[i + 1] = velocity[i] + gravity * dt + R[i] @ at.velocity[i]
    world_R = so3.rotation_to_z(-gravity)
    pose = np.tile(np.eye(4), (n, 1, 1))
    pose[:, :3, :3], pose[:, :3, 3] = world_R @ R, position @ world_R.T
    return States(pose, velocity @ world_R.T, np.tile(motions.biases[0, :3], (n, 1)), np.tile(bias, (n, 1)))
