"""One camera: the rows of a stereo pair's left image, and points from rays alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.geometry import FgbaselineError, FloatArray, HuberKernel, MeasurementModel, StereoCamera, se3
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.measurement_model import mahalanobis_squared
from fgbaseline.geometry.monocular_camera import left_of, require_stereo
from fgbaseline.geometry.triangulation import triangulate_tracks

PAIR = StereoCamera(fu=552.6, fv=561.3, cu=682.1, cv=238.8, baseline=0.6)
CAMERA = left_of(PAIR)
POINTS = st.tuples(st.floats(-40.0, 40.0), st.floats(-20.0, 20.0), st.floats(1.0, 100.0)).map(np.array)


@given(POINTS)
def test_its_pixels_are_those_of_the_left_image(point: FloatArray) -> None:
    pixel = CAMERA.project(point)
    np.testing.assert_array_equal(pixel[:2], PAIR.project(point)[:2])
    assert np.isnan(pixel[2:]).all()


@given(st.integers(0, 2**32), st.integers(1, 5))
def test_prediction_and_jacobians_are_the_left_rows_of_a_pair(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    cam_T_imu, world_T_imu = se3.exp(0.3 * random.normal(size=(2, 6)))
    points = se3.transform(world_T_imu @ se3.inverse(cam_T_imu), random.uniform([-5, -5, 2], [5, 5, 20], (n, 3)))
    for given_points in (points, np.column_stack([points, np.ones(n)])):
        one, two = (predict(camera, cam_T_imu, world_T_imu, given_points) for camera in (CAMERA, PAIR))
        for mine, theirs in zip(
            (one.pixel, one.pose_jacobian(), one.point_jacobian()),
            (two.pixel, two.pose_jacobian(), two.point_jacobian()),
            strict=True,
        ):
            np.testing.assert_allclose(mine, theirs[:, [0, 2]], rtol=1e-12, atol=1e-9)


@given(st.integers(0, 2**32))
def test_squared_norms_of_two_rows(seed: int) -> None:
    random = np.random.default_rng(seed)
    half, residual = random.normal(size=(7, 2, 2)), random.normal(size=(7, 2))
    covariance = half @ np.swapaxes(half, 1, 2) + 0.1 * np.eye(2)
    expected = np.einsum("ni,ni->n", residual, np.linalg.solve(covariance, residual[:, :, None])[:, :, 0])
    np.testing.assert_allclose(mahalanobis_squared(residual, covariance), expected, rtol=1e-9)


def views(seed: int, n: int = 6) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Poses (n, 4, 4) of a sideways motion, a point, and its pixels (n, 4) without noise."""
    random = np.random.default_rng(seed)
    steps = np.array([0.2, 0.05, 0.0, 0.0, 0.02, 0.0]) + 0.01 * random.normal(size=(n - 1, 6))
    world_T_cam = se3.compose(se3.exp(steps), se3.exp(random.normal(size=6)))
    point = se3.transform(world_T_cam[0], np.array([0.5, -0.3, random.uniform(3.0, 9.0)]))
    return world_T_cam, point, CAMERA.project(se3.transform(se3.inverse(world_T_cam), point[None].repeat(n, 0)))


@pytest.mark.parametrize("seed", range(5))
def test_exact_rays_give_the_point(seed: int) -> None:
    world_T_cam, point, pixel = views(seed)
    model = MeasurementModel(CAMERA, 1.0, HuberKernel())
    found = triangulate_tracks(model, world_T_cam, np.zeros(len(pixel), np.int64), pixel, 1)
    np.testing.assert_allclose(found.position[0], point, atol=1e-7)


@pytest.mark.parametrize("seed", range(5))
def test_noisy_rays_give_the_minimum_of_the_whitened_residuals(seed: int) -> None:
    world_T_cam, point, pixel = views(seed)
    pixel = pixel + np.random.default_rng(seed).normal(size=pixel.shape)
    model = MeasurementModel(CAMERA, 1.0)
    found = triangulate_tracks(model, world_T_cam, np.zeros(len(pixel), np.int64), pixel, 1)

    def cost(at: FloatArray) -> float:
        seen = CAMERA.project(se3.transform(se3.inverse(world_T_cam), at[None].repeat(len(pixel), 0)))
        return float(np.sum((pixel - seen)[:, :2] ** 2))

    best, sigma = cost(found.position[0]), 1.0 / np.sqrt(np.linalg.eigvalsh(found.information[0]).max())
    assert all(cost(found.position[0] + sign * 1e-2 * sigma * e) > best for e in np.eye(3) for sign in (-1.0, 1.0))
    deviation = np.linalg.inv(found.information[0])
    error = found.position[0] - point
    assert error @ np.linalg.solve(deviation, error) < 25.0


def test_parallel_rays_have_no_point() -> None:
    world_T_cam = np.tile(np.eye(4), (4, 1, 1))
    pixel = CAMERA.project(np.array([[0.5, 0.2, 4.0]] * 4))  # a camera that does not move
    found = triangulate_tracks(MeasurementModel(CAMERA, 1.0), world_T_cam, np.zeros(4, np.int64), pixel, 1)
    assert np.isnan(found.position).all()
    assert not found.information.any()


def test_what_needs_a_pair_says_so() -> None:
    assert require_stereo(PAIR, "it") is PAIR
    with pytest.raises(FgbaselineError, match="mapping needs a stereo camera"):
        require_stereo(CAMERA, "mapping")
