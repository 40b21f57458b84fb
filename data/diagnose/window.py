"""Bundle adjustment of a short window of frames: poses and landmarks from pixels and velocities together.

Dense and exact: landmarks are eliminated by the Schur complement, poses are few. It gives what frame-to-frame odometry
cannot, residuals with the right number of degrees of freedom, so that noise can be told from error.
"""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray, StereoCamera, se3

from .window_system import add_motion, add_pixels, eliminated, landmark_steps, motion_redundancy
from .window_terms import OFFSET, SHARED, Sigmas, WindowData, motion_terms, pixel_terms

SHARED_PRIOR = np.diag(1.0 / np.array([0.1] * 3 + [0.3] + [0.1] * 3 + [1.0]) ** 2)
"""keeps what a window cannot know (a rotation about the direction of travel) from running away"""


@dataclass(frozen=True, eq=False, slots=True)
class WindowFit:
    """The solution, and what is left of every measurement."""

    poses: FloatArray
    """(W, 4, 4) of the IMU, the first being the identity"""
    points: FloatArray
    """(m, 3) m"""
    shared: FloatArray
    """(8,) what all windows share: see `window_terms.SHARED`"""
    shared_information: FloatArray
    """(8, 8) what the window knows of it, the poses and landmarks being unknown too, without any prior"""
    motion_residual: FloatArray
    """(W-1, 6) velocity residuals, m/s and rad/s"""
    motion_redundancy: FloatArray
    """(W-1, 6) share of each residual's variance that the fit did not absorb"""
    pixel_squared: FloatArray
    """(n,) kernel-weighted squared residual of three whitened rows"""
    degrees_of_freedom: float
    """of the pixel residuals"""
    last_covariance: FloatArray
    """(6, 6) of the right perturbation of the last pose"""


def fit_window(
    camera: StereoCamera,
    imu_T_cam: FloatArray,
    data: WindowData,
    poses: FloatArray,
    points: FloatArray,
    sigmas: Sigmas,
    shared: FloatArray,
    iterations: int,
) -> WindowFit:
    """Gauss-Newton from poses (W, 4, 4) and points (m, 3); `shared` (8,) is free too, under a wide prior."""
    m = len(points)
    n_pose = 6 * (len(poses) - 1)
    for step in range(iterations + 1):
        turn = poses[1:, :3, :3]
        pixels = pixel_terms(camera, imu_T_cam, data, poses, points, sigmas.pixel, float(shared[OFFSET]))
        residual, *J = motion_terms(data, poses, sigmas, shared)
        H = np.zeros((n_pose + SHARED, n_pose + SHARED))
        g = np.zeros(n_pose + SHARED)
        H[n_pose:, n_pose:] += SHARED_PRIOR
        g[n_pose:] -= SHARED_PRIOR @ shared
        add_motion(H, g, residual, *J)
        system = eliminated(data, pixels, turn, sigmas.pixel, m)
        add_pixels(H, g, system)
        if step == iterations:
            break
        delta = np.linalg.solve(H, g)
        points = points + landmark_steps(system, turn, np.append(delta[:n_pose], delta[n_pose + OFFSET]))
        poses = np.concatenate([poses[:1], poses[1:] @ se3.exp(delta[:n_pose].reshape(-1, 6))])
        shared = shared + delta[n_pose:]
    covariance = np.asarray(np.linalg.inv(H), dtype=np.float64)
    redundancy = motion_redundancy(covariance, *J)
    absorbed = n_pose + 3 * m + SHARED
    return WindowFit(
        poses=poses,
        points=points,
        shared=shared,
        shared_information=np.linalg.inv(covariance[n_pose:, n_pose:]) - SHARED_PRIOR,
        motion_residual=residual * np.repeat([sigmas.linear, sigmas.angular], 3),
        motion_redundancy=redundancy,
        pixel_squared=pixels.weight * (pixels.residual**2).sum(axis=0),
        degrees_of_freedom=3.0 * len(data.frame) + n_pose - absorbed - float(redundancy.sum()),
        last_covariance=covariance[n_pose - 6 : n_pose, n_pose - 6 : n_pose],
    )
