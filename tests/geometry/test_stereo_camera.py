"""The stereo camera: projection, its derivative, and points from pixels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, StereoCamera, disparity, se3
from fgbaseline.geometry.triangulation import triangulate_tracks

from ..builders.dense_filter import K_s, homogeneous, pi

CAMERA = StereoCamera(fu=552.6, fv=561.3, cu=682.1, cv=238.8, baseline=0.6)

POINTS = st.tuples(st.floats(-40.0, 40.0), st.floats(-20.0, 20.0), st.floats(1.0, 100.0)).map(np.array)
DEPTHS_BEHIND = st.tuples(st.floats(-40.0, 40.0), st.floats(-20.0, 20.0), st.floats(-100.0, -1.0)).map(np.array)


@given(st.one_of(POINTS, DEPTHS_BEHIND))
def test_projection_is_equation_10(point: FloatArray) -> None:
    np.testing.assert_allclose(CAMERA.project(point), K_s(CAMERA) @ pi(homogeneous(point)), rtol=1e-13, atol=1e-9)


@given(st.one_of(POINTS, DEPTHS_BEHIND))
def test_the_jacobian_is_the_slope_of_the_projection(point: FloatArray) -> None:
    h = 1e-4 * abs(point[2])
    slope = np.stack([(CAMERA.project(point + h * e) - CAMERA.project(point - h * e)) / (2 * h) for e in np.eye(3)], 1)
    np.testing.assert_allclose(CAMERA.jacobian(point), slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


@given(st.one_of(POINTS, DEPTHS_BEHIND))
def test_triangulation_undoes_projection(point: FloatArray) -> None:
    np.testing.assert_allclose(CAMERA.triangulate(CAMERA.project(point)), point, rtol=1e-9, atol=1e-9)


def test_depth_comes_from_the_disparity_and_height_from_the_left_image() -> None:
    pixel = np.array([700.0, 300.0, 690.0, 350.0])
    z = CAMERA.fu * CAMERA.baseline / 10.0
    expected = [(700.0 - CAMERA.cu) / CAMERA.fu * z, (300.0 - CAMERA.cv) / CAMERA.fv * z, z]
    np.testing.assert_allclose(CAMERA.triangulate(pixel), expected)
    assert disparity(pixel) == 10.0


def test_zero_disparity_has_no_point_and_negative_disparity_violates_cheirality() -> None:
    assert not np.isfinite(CAMERA.triangulate([700.0, 300.0, 700.0, 300.0])).any()
    assert CAMERA.triangulate([700.0, 300.0, 710.0, 300.0])[2] < 0.0


class Track:
    """One point seen from six poses of a forward drive, with noise of 0.7 px."""

    variance = 0.7**2

    def __init__(self, seed: int, wrong: int | None = None) -> None:
        random = np.random.default_rng(seed)
        self.world_T_cam = se3.compose(
            se3.exp(np.array([0.2, 0.0, 1.0, 0.0, 0.02, 0.0]) + 0.01 * random.normal(size=(5, 6)))
        )
        self.point = np.array([random.uniform(-8.0, 8.0), random.uniform(-3.0, 1.0), random.uniform(15.0, 40.0)])
        exact = CAMERA.project(se3.transform(se3.inverse(self.world_T_cam), self.point))
        self.pixel = exact + 0.7 * random.normal(size=exact.shape)
        if wrong is not None:
            self.pixel[wrong] += [9.0, -6.0, 9.0, -6.0]

    def whitened(self, point: FloatArray) -> FloatArray:
        """(6, 3) residuals of uL, uR and v in sigmas."""
        seen = CAMERA.project(se3.transform(se3.inverse(self.world_T_cam), point))
        uL, vL, uR, vR = (self.pixel - seen).T / np.sqrt(self.variance)
        return np.stack([uL, uR, (vL + vR) / np.sqrt(2.0)], axis=1)

    def cost(self, point: FloatArray, huber: float | None) -> float:
        """Huber's loss of the norm of each observation, or the sum of squares."""
        squared = (self.whitened(point) ** 2).sum(axis=1)
        if huber is None:
            return float(squared.sum())
        beyond = squared > huber**2
        return float(np.where(beyond, 2.0 * huber * np.sqrt(squared) - huber**2, squared).sum())

    def best(self, huber: float | None) -> FloatArray:
        """The minimum that scipy finds, from the true point."""

        def residuals(point: FloatArray) -> FloatArray:
            squared = (self.whitened(point) ** 2).sum(axis=1)
            if huber is None:
                return self.whitened(point).reshape(-1)
            return np.sqrt(np.where(squared > huber**2, 2.0 * huber * np.sqrt(squared) - huber**2, squared))

        found = least_squares(residuals, self.point, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
        return np.asarray(found.x)


def several(tracks: list[Track], huber: float | None) -> tuple[FloatArray, FloatArray]:
    """Position and information of all tracks at once, their observations interleaved."""
    row = np.repeat(np.arange(len(tracks)), 6)
    poses, pixel = np.concatenate([t.world_T_cam for t in tracks]), np.concatenate([t.pixel for t in tracks])
    mixed = np.random.default_rng(0).permutation(len(row))
    model = MeasurementModel(CAMERA, Track.variance, None if huber is None else HuberKernel(huber))
    found = triangulate_tracks(model, poses[mixed], row[mixed], pixel[mixed], len(tracks))
    return found.position, found.information


@pytest.mark.parametrize("huber", [None, 2.5])
def test_triangulated_tracks_are_where_scipy_finds_the_least_cost(huber: float | None) -> None:
    tracks = [Track(seed, wrong=None if seed % 2 else 3) for seed in range(12)]
    position, information = several(tracks, huber)
    for track, found, curvature in zip(tracks, position, information, strict=True):
        best = track.best(huber)
        assert track.cost(found, huber) <= track.cost(best, huber) * (1.0 + 1e-9)
        # In standard deviations. The kernel's square root has a kink, at which scipy stops a little early.
        assert np.sqrt((found - best) @ curvature @ (found - best)) < (0.1 if huber else 1e-5)
        slope = [track.cost(found + h, huber) - track.cost(found - h, huber) for h in 1e-5 * np.eye(3)] / np.float64(
            4e-5
        )
        assert np.sqrt(slope @ np.linalg.solve(curvature, slope)) < 1e-5


def test_weights_are_the_kernels_of_the_residuals_and_one_behind_a_camera() -> None:
    track = Track(0, wrong=4)
    model = MeasurementModel(CAMERA, Track.variance, HuberKernel(2.5))
    points = np.tile(track.point, (6, 1))
    expected = np.minimum(1.0, 2.5 / np.linalg.norm(track.whitened(track.point), axis=1))
    assert expected[4] < 0.3
    np.testing.assert_allclose(model.weight_at(track.world_T_cam, points, track.pixel), expected, rtol=1e-12)
    np.testing.assert_allclose(model.weight_at(track.world_T_cam[4], points[4:5], track.pixel[4:5]), expected[4:5])
    behind = np.array([[1.0, 0.5, -3.0]])
    np.testing.assert_array_equal(model.weight_at(track.world_T_cam[0], behind, track.pixel[:1]), 1.0)


def test_the_kernel_keeps_one_wrong_match_from_moving_the_point() -> None:
    tracks = [Track(seed, wrong=4) for seed in range(12)]
    clean = [Track(seed) for seed in range(12)]
    without, _ = several(clean, None)
    moved = [np.linalg.norm(several(tracks, huber)[0] - without, axis=1) for huber in (2.5, None)]
    assert np.median(moved[0]) < 0.2 * np.median(moved[1])
    assert np.max(moved[0]) < 0.2 * np.max(moved[1])


@pytest.mark.parametrize("seed", range(4))
def test_the_information_is_the_curvature_of_the_cost(seed: int) -> None:
    # Gauss-Newton's matrix equals half the Hessian where the residuals vanish.
    track = Track(seed)
    track.pixel = CAMERA.project(se3.transform(se3.inverse(track.world_T_cam), track.point))
    position, information = several([track], None)
    np.testing.assert_allclose(position[0], track.point, rtol=1e-9)
    h = 1e-3
    curvature = np.empty((3, 3))
    for i, a in enumerate(h * np.eye(3)):
        for j, b in enumerate(h * np.eye(3)):
            corners = [track.cost(track.point + s * a + t * b, None) * s * t for s in (1, -1) for t in (1, -1)]
            curvature[i, j] = 0.5 * sum(corners) / (4.0 * h * h)
    np.testing.assert_allclose(information[0], curvature, rtol=1e-4, atol=1e-4 * np.abs(curvature).max())


def test_a_point_without_a_positive_disparity_is_not_determined() -> None:
    track = Track(0)
    flipped = track.pixel[:, [2, 1, 0, 3]]
    row = np.repeat([0, 1], 6)
    poses = np.concatenate([track.world_T_cam] * 2)
    model = MeasurementModel(CAMERA, Track.variance)
    found = triangulate_tracks(model, poses, row, np.concatenate([flipped, track.pixel]), 3)
    assert np.isnan(found.position[[0, 2]]).all()
    np.testing.assert_allclose(found.position[1], several([track], None)[0][0], rtol=1e-9)
    np.testing.assert_array_equal(found.information[[0, 2]], 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_point_beyond_infinity_lies_far_along_its_ray_and_holds_no_other_up(seed: int) -> None:
    """Disparities of a point at infinity that are negative in all frames but one."""
    far, near = Track(seed), Track(seed + 10)
    ray = far.point / np.linalg.norm(far.point)
    center = far.world_T_cam[:, :3, 3]
    pixel = CAMERA.project(se3.transform(se3.inverse(far.world_T_cam), center + 1e9 * ray))
    pixel[:, 2] += 0.3 * np.array([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    far.pixel = pixel
    (position, beside), (information, _) = several([far, near], 2.5)
    away = position - center.mean(axis=0)
    assert np.linalg.norm(away) > 1e5 * CAMERA.baseline
    assert np.linalg.norm(away / np.linalg.norm(away) - ray) < 2e-3
    assert far.cost(position, 2.5) < far.cost(center[0] + 1000.0 * ray, 2.5)
    assert np.linalg.eigvalsh(information)[0] < 1e-12  # 1/m^2: nothing is known of its distance
    np.testing.assert_array_equal(beside, several([near], 2.5)[0][0])
