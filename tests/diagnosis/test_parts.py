"""The parts of the diagnosis: derivatives, redundancy, regression, timing, split tracks, held velocities."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from fgbaseline.data import Excluded, Observations
from fgbaseline.data.axis_conventions import axes_matrix
from fgbaseline.data.problem import NoiseSettings
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import Shift, zero_order_hold
from fgbaseline.diagnosis.conventions.axes import linear_axes
from fgbaseline.diagnosis.conventions.robust_regression import regress
from fgbaseline.diagnosis.conventions.spline import spline_through
from fgbaseline.diagnosis.conventions.velocity_time_offset import timing
from fgbaseline.diagnosis.odometry.stereo_odometry import odometry
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings, TrackConsistency, exclusions, split_tracks
from fgbaseline.diagnosis.window_adjustment import bundle_adjustment as adjustment
from fgbaseline.diagnosis.window_adjustment.bundle_adjustment import CALIBRATION_PRIOR, WindowFit, fit_each_window
from fgbaseline.diagnosis.window_adjustment.residuals import (
    N_CALIBRATION,
    WindowData,
    concatenate_windows,
    motion_terms,
    pixel_terms,
)
from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, se3
from fgbaseline.geometry.measurement_model import three_rows

from ..builders.synthetic import Scene

SIGMAS = NoiseSettings(0.5, 0.1, 0.01)
KERNEL = HuberKernel()


def window(frames: int = 6, seed: int = 0) -> tuple[Scene, WindowData, FloatArray, FloatArray]:
    """A scene, its data, and poses and points a little off the truth."""
    scene = Scene(frames=frames, seed=seed)
    sequence = scene.sequence()
    o, truth = sequence.observations, sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    twist = zero_order_hold(sequence)
    data = WindowData(o.frame, o.landmark, three_rows(o.pixel), twist, sequence.dt, np.zeros_like(twist))
    random = np.random.default_rng(seed)
    off = 0.01 * random.normal(size=(frames, 6))
    off[0] = 0.0
    return scene, data, truth.world_T_imu @ se3.exp(off), truth.landmarks + 0.05 * random.normal(size=(12, 3))


def fitted(iterations: int = 12) -> tuple[WindowFit, WindowData]:
    scene, data, poses, points = window()
    sequence = scene.sequence()
    windows, start = [(data, poses, points)], [np.zeros(N_CALIBRATION)]
    (fit,) = fit_each_window(sequence.camera, sequence.imu_T_cam, windows, SIGMAS, start, iterations)
    return fit, data


def test_windows_are_fitted_alike_by_one_process_and_by_three(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adjustment, "MAX_BATCH_OBSERVATIONS", 1)  # every window is a piece of work
    scenes = [window(seed=seed) for seed in range(5)]
    windows = [(data, poses, points) for _, data, poses, points in scenes]
    sequence, start = scenes[0][0].sequence(), [np.zeros(N_CALIBRATION)] * 5
    one, three = (
        fit_each_window(sequence.camera, sequence.imu_T_cam, windows, SIGMAS, start, 2, processes)
        for processes in (1, 3)
    )
    assert len(one) == len(three) == 5
    for fit, other in zip(one, three, strict=True):
        assert np.array_equal(fit.poses, other.poses)
        assert np.array_equal(fit.last_covariance, other.last_covariance)


def test_odometry_measures_the_pixel_noise_of_a_simulation() -> None:
    settings = Simulation(path="handheld", duration=10, features_per_frame=60, sigma_pixel=0.5)
    measured = [odometry(simulate(replace(settings, seed=seed))).pixel_sigma for seed in range(3)]
    assert np.mean(measured) == pytest.approx(0.5, rel=0.03)


def moved(poses: FloatArray, k: int, axis: int, step: float) -> FloatArray:
    delta = np.zeros(6)
    delta[axis] = step
    poses = poses.copy()
    poses[k] = poses[k] @ se3.exp(delta)
    return poses


def test_the_derivatives_of_motion_and_pixels_equal_their_finite_differences() -> None:
    scene, data, poses, points = window()
    sequence, h = scene.sequence(), 1e-6
    calibration = np.array([0.01, -0.02, 0.005, 0.03, 0.02, -0.01, 0.015, 0.3])
    one = concatenate_windows([(data, poses, points)])
    _, before, after, J_calibration = motion_terms(one, poses, SIGMAS, calibration[None])
    model = MeasurementModel(sequence.camera, 0.5**2, KERNEL)
    terms = pixel_terms(model, sequence.imu_T_cam, one, poses, points, calibration[None])
    by_point = np.moveaxis(terms.J_point, 2, 0)

    def motion(p: FloatArray, s: FloatArray = calibration) -> FloatArray:
        return motion_terms(one, p, SIGMAS, s[None]).residual

    def pixel(p: FloatArray, x: FloatArray) -> FloatArray:
        return pixel_terms(model, sequence.imu_T_cam, one, p, x, calibration[None]).residual.T

    k = 3
    for axis in range(6):
        ahead, behind = moved(poses, k, axis, h), moved(poses, k, axis, -h)
        difference = -(motion(ahead) - motion(behind)) / (2 * h)
        assert np.allclose(difference[k - 1], after[k - 1, :, axis], atol=2e-3 * np.abs(after[k - 1]).max())
        assert np.allclose(difference[k], before[k, :, axis], atol=2e-3 * np.abs(before[k]).max())
        seen = data.frame == k
        move, turn = poses[k, :3, :3] @ np.eye(6)[axis].reshape(2, 3, 1)
        as_if = -(move.T + np.cross(turn.T, terms.arm.T[seen]))
        difference = -(pixel(ahead, points) - pixel(behind, points))[seen] / (2 * h)
        assert np.allclose(difference, (by_point[seen] @ as_if[:, :, None])[:, :, 0], rtol=1e-4, atol=1e-3)
    for i in range(N_CALIBRATION):
        step = h * np.eye(N_CALIBRATION)[i]
        difference = -(motion(poses, calibration + step) - motion(poses, calibration - step)) / (2 * h)
        assert np.allclose(difference, J_calibration[:, :, i], atol=2e-2 * np.abs(J_calibration).max())
    for i in range(3):
        step = h * np.eye(3)[i]
        difference = -(pixel(poses, points + step) - pixel(poses, points - step)) / (2 * h)
        assert np.allclose(difference, by_point[:, :, i], rtol=1e-4, atol=1e-3)


def test_a_window_ends_where_scipy_ends() -> None:
    fit, data = fitted()
    sequence = window()[0].sequence()
    model = MeasurementModel(sequence.camera, SIGMAS.pixel**2, KERNEL)
    W, m = len(fit.poses), len(fit.points)
    root, one = np.sqrt(np.diag(CALIBRATION_PRIOR)), concatenate_windows([(data, fit.poses, fit.points)])

    def residual(x: FloatArray) -> FloatArray:
        poses = np.concatenate([fit.poses[:1], fit.poses[1:] @ se3.exp(x[: 6 * (W - 1)].reshape(W - 1, 6))])
        points = fit.points + x[6 * (W - 1) : 6 * (W - 1) + 3 * m].reshape(m, 3)
        calibration = fit.calibration + x[-N_CALIBRATION:]
        pixels = pixel_terms(model, sequence.imu_T_cam, one, poses, points, calibration[None])
        r = pixels.residual.T
        norm, k = np.linalg.norm(r, axis=1), KERNEL.threshold
        beyond = np.maximum(norm, k)  # the squared norm becomes Huber's cost
        r = r * np.sqrt(2.0 * k * beyond - k**2)[:, None] / beyond[:, None]
        return np.concatenate(
            [r.ravel(), motion_terms(one, poses, SIGMAS, calibration[None]).residual.ravel(), root * calibration]
        )

    start = np.zeros(6 * (W - 1) + 3 * m + N_CALIBRATION)
    best = least_squares(residual, start, x_scale="jac")
    cost = 0.5 * float(np.sum(residual(start) ** 2))
    assert best.cost <= cost * (1 + 1e-9)
    assert cost - best.cost < 1e-3


def test_redundancies_add_up_to_the_degrees_of_freedom() -> None:
    fit, data = fitted()
    assert ((fit.motion_redundancy > 0.0) & (fit.motion_redundancy < 1.0)).all()
    rows = 3 * len(data.frame) + 6 * len(data.dt)
    unknowns = 6 * len(data.dt) + 3 * len(fit.points) + N_CALIBRATION
    assert fit.degrees_of_freedom + fit.motion_redundancy.sum() == pytest.approx(rows - unknowns)


@given(st.integers(0, 1000))
def test_a_regression_ignores_a_fifth_of_outliers(seed: int) -> None:
    random = np.random.default_rng(seed)
    theta = random.normal(size=2)
    X = random.normal(size=(400, 3, 2))
    y = X @ theta + 0.1 * random.normal(size=(400, 3))
    y[:80] += random.choice([-5.0, 5.0], size=(80, 3))
    fit = regress(y, X, np.array([10.0, 10.0]))
    assert np.abs(fit.theta - theta).max() < 6.0 * np.sqrt(np.diag(fit.covariance)).max()
    # The median of all is the 62.5 % quantile of the bulk: 1.4826 * 0.887 of its deviation.
    assert (np.abs(fit.sigma / 0.1 - 1.315) < 0.35).all()


def test_a_regression_pays_no_price_for_a_calibration_error_that_is_none() -> None:
    random = np.random.default_rng(0)
    x = random.normal(size=(2000, 1, 1))
    fit = regress(x[:, :, 0] + 0.01 * random.normal(size=(2000, 1)), x, np.array([0.05]))
    assert fit.theta[0] == pytest.approx(0.15)
    assert fit.sigma[0] == pytest.approx(0.85, rel=0.1)


@pytest.mark.parametrize("noise", [0.05, 0.5])
def test_a_noisy_forward_speed_is_seen_and_a_delayed_one_too(noise: float) -> None:
    random = np.random.default_rng(1)
    k = np.arange(800)
    seen = np.column_stack([8.0 + 4.0 * np.sin(k / 20), 0.03 * np.cos(k / 7), 0.02 * np.sin(k / 5)])
    rate = 0.2 * np.column_stack([0.05 * np.sin(k / 6), 0.05 * np.sin(k / 4), np.sin(k / 30)])
    recorded = np.roll(seen, 2, axis=0) @ axes_matrix("-y,x,z") + noise * random.normal(size=(800, 3))
    seen = seen + 0.03 * random.normal(size=(800, 3))
    axes = linear_axes(seen, recorded, rate, np.ones(800, dtype=np.bool_), "x,y,z", baseline=0.5)
    assert axes.determined == (True, False, False)
    assert axes.name.split(",")[0] == "-y"


@given(st.floats(-2.0, 2.0), st.integers(0, 100))
def test_the_delay_of_a_shifted_signal_is_found(shift: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    k = np.arange(300.0)
    signal = CubicSpline(np.arange(-30.0, 340.0, 5.0), random.normal(size=(74, 3)))
    seen = signal(k) + 0.02 * random.normal(size=(300, 3))
    recorded = signal(k + shift) + 0.02 * random.normal(size=(300, 3))
    found = timing(seen, recorded, np.ones(300, dtype=np.bool_), 0.1)
    assert found.identifiable
    assert abs(found.shift / 0.1 - shift) < 0.1


@given(st.integers(4, 30), st.integers(0, 1000))
def test_the_spline_is_scipys(n: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    x = np.cumsum(random.integers(1, 4, n).astype(np.float64))
    y = random.normal(size=(n, 3))
    at = np.linspace(x[0] - 0.5, x[-1] + 0.5, 97).reshape(-1, 1)
    ours, theirs = spline_through(x, y), CubicSpline(x, y)
    assert np.allclose(ours(at), theirs(at), rtol=1e-9, atol=1e-9)
    for derivative in (1, 2):
        assert np.allclose(ours(at, derivative), theirs(at, derivative), rtol=1e-9, atol=1e-8)
    assert np.allclose(spline_through(x, y[:, 0])(at), theirs(at)[..., 0], rtol=1e-9, atol=1e-9)


def test_noise_has_no_delay() -> None:
    random = np.random.default_rng(0)
    seen, recorded = random.normal(size=(2, 200, 3))
    assert not timing(seen, recorded, np.ones(200, dtype=np.bool_), 0.1).identifiable


def test_held_velocities_at_the_usual_shifts() -> None:
    sequence = Scene(frames=8).sequence()
    u = np.concatenate([sequence.linear_velocity, sequence.angular_velocity], axis=1)
    assert np.array_equal(zero_order_hold(sequence, Shift.AFTER), u[:-1])
    assert np.array_equal(zero_order_hold(sequence, Shift.BEFORE), u[1:])
    assert np.allclose(zero_order_hold(sequence, Shift.MIDDLE), 0.5 * (u[:-1] + u[1:]))


def test_a_track_that_jumps_is_cut_and_both_segments_are_used() -> None:
    scene = Scene(frames=12, sigma_pixel=0.1).sequence()
    assert scene.truth is not None
    o = scene.observations
    pixel: FloatArray = o.pixel.copy()
    late = (o.landmark == 3) & (o.frame >= 7)
    other = (o.landmark == 5) & (o.frame >= 7)
    pixel[late] = pixel[other]
    jumped = replace(scene, observations=Observations(o.frame.copy(), o.landmark.copy(), pixel))
    none = np.zeros(len(o), dtype=np.bool_)
    test = TrackConsistency(jumped, scene.truth.world_T_imu, MaskSettings().prediction_gate)
    split = split_tracks(jumped, test, MaskSettings(), none)
    assert split.n_landmarks == scene.n_landmarks + 1
    assert (split.excluded == Excluded.NO).all()
    assert (split.landmark[late] == scene.n_landmarks).all()
    assert np.array_equal(split.landmark[~late], o.landmark[~late])
    longest_only = exclusions(jumped, scene.truth.world_T_imu, MaskSettings())
    assert (longest_only[late] == Excluded.PREDICTION).all()
