"""The joint filter with a gyroscope bias in its state: found, and believed no more than it is known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from fgbaseline import compare, data, diagnosis, ekf
from fgbaseline.data import Estimate, Sequence
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.ekf import GyroBiasPrior, JointSettings, Linearization
from fgbaseline.geometry import FgbaselineError, FloatArray, se3

from ..builders.synthetic import Scene, drive, matched, plain_problem, position_errors

BIAS = (0.012, -0.02, 0.015)
"""rad/s"""
SEEDS = 8


def test_the_effect_of_a_wrong_bias_is_that_of_the_transition() -> None:
    prior, dt, step = GyroBiasPrior(deviation=0.03, walk=0.02), 0.25, 1e-6
    twist = np.array([0.8, -0.2, 0.1, 0.3, -0.5, 0.4])
    transition, noise = np.diag(np.arange(1.0, 7.0)), np.diag(np.arange(2.0, 8.0))
    F, Q = prior.augment(twist, dt, transition, noise)
    for i, d in enumerate(step * np.eye(3)):
        wrong = se3.exp(twist - dt * np.concatenate([np.zeros(3), d]))
        np.testing.assert_allclose(F[:6, 6 + i], se3.log(se3.inverse(se3.exp(twist)) @ wrong) / step, atol=1e-5)
    np.testing.assert_array_equal(F[:6, :6], transition)
    np.testing.assert_array_equal(F[6:], np.eye(9)[6:])
    np.testing.assert_array_equal(Q[:6, :6], noise)
    np.testing.assert_allclose(Q[6:, 6:], 0.02**2 * 0.25 * np.eye(3), rtol=1e-12)
    assert not Q[:6, 6:].any()
    assert not Q[6:, :6].any()
    np.testing.assert_allclose(prior.covariance(), 0.03**2 * np.eye(3), rtol=1e-12)


def biased(path: PathName, seed: int, seconds: float = 15.0) -> Sequence:
    return simulate(
        Simulation(path=path, duration=seconds, features_per_frame=25.0, seed=seed, wrong_share=0.0, gyro_bias=BIAS)
    )


def bias_nees(estimate: Estimate) -> FloatArray:
    """(T,) d^T P^-1 d, d the error of the bias."""
    bias = estimate.gyro_bias
    assert bias is not None
    error = bias.mean - BIAS
    whitened = np.linalg.solve(bias.covariance, error[:, :, None])[:, :, 0]
    return np.asarray(np.einsum("ti,ti->t", error, whitened))


@given(st.integers(0, 10_000), st.floats(0.0, 3.1))
def test_the_right_jacobian_is_the_difference_of_motions(seed: int, angle: float) -> None:
    random = np.random.default_rng(seed)
    axis = random.normal(size=3)
    xi = np.concatenate([3.0 * random.normal(size=3), angle * axis / np.linalg.norm(axis)])
    h = 1e-6
    back = se3.inverse(se3.exp(xi))
    columns = [(se3.log(back @ se3.exp(xi + h * e)) - se3.log(back @ se3.exp(xi - h * e))) / (2 * h) for e in np.eye(6)]
    np.testing.assert_allclose(se3.right_jacobian(xi), np.stack(columns, axis=1), rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("path", ["town", "handheld"])
@pytest.mark.parametrize("linearization", [Linearization.INVARIANT, Linearization.FIRST_ESTIMATE])
def test_a_constant_bias_is_estimated_within_the_filters_sigma(path: PathName, linearization: Linearization) -> None:
    settings = JointSettings(linearization=linearization, gyro_bias=GyroBiasPrior())
    of_pose, of_bias = [], []
    for seed in range(SEEDS):
        sequence = biased(path, seed)
        estimate = ekf.joint_ekf(replace(matched(sequence), kernel=None), settings=settings)
        assert estimate.gyro_bias is not None
        assert sequence.truth is not None
        deviation = np.sqrt(np.diagonal(estimate.gyro_bias.covariance[-1]))
        assert np.all(np.abs(estimate.gyro_bias.mean[-1] - BIAS) < 3.0 * deviation)
        assert deviation.max() < 0.0015
        of_pose.append(compare.nees(estimate, sequence.truth)[1:])
        of_bias.append(bias_nees(estimate))
    frames = [4, 19, 49, 99, 148]
    for nees, degrees in ((of_pose, 6), (of_bias, 3)):
        low, high = chi2.ppf([0.0005, 0.9995], degrees * SEEDS) / SEEDS
        mean = np.mean(nees, axis=0)[frames]
        assert np.all((low < mean) & (mean < high))


def test_a_gyroscope_bias_bends_the_path_unless_it_is_estimated() -> None:
    # A good gyroscope and few features: what it reads counts.
    noise = diagnosis.NoiseSettings(pixel=0.5, linear_velocity=0.1, angular_velocity=0.005)
    squares = []
    for seed in range(3):
        sequence = simulate(
            Simulation(
                duration=20.0, features_per_frame=6.0, seed=seed, wrong_share=0.0, gyro_bias=BIAS, sigma_angular=0.005
            )
        )
        problem = diagnosis.calibrated(sequence, settings=diagnosis.AsRecordedSettings(noise=noise, shift=Shift.AFTER))
        plain, asked = ekf.joint_ekf(problem), ekf.joint_ekf_bias(problem)
        assert plain.gyro_bias is None
        squares.append([np.mean(position_errors(e, sequence) ** 2) for e in (plain, asked)])
    bent, straight = np.sqrt(np.mean(squares, axis=0))
    assert straight < 0.4 * bent


def test_the_final_bias_estimate_is_an_event() -> None:
    estimate = ekf.joint_ekf_bias(matched(biased("town", 1, 5.0)))
    (event,) = (event for event in estimate.events if event.kind == "estimated gyroscope bias")
    assert estimate.gyro_bias is not None
    assert event.frame == 49
    assert f"{estimate.gyro_bias.mean[-1, 0]:+.4f} ± " in event.reason
    assert estimate.status == "ok"


def test_a_bias_prior_of_zero_variance_leaves_the_estimate_unchanged() -> None:
    problem = plain_problem(Scene().sequence())
    sure = ekf.joint_ekf(problem, settings=JointSettings(gyro_bias=GyroBiasPrior(1e-9, 0.0)))
    without = ekf.joint_ekf(problem)
    np.testing.assert_allclose(sure.world_T_imu, without.world_T_imu, rtol=0, atol=1e-9)
    assert sure.covariance is not None
    assert without.covariance is not None
    np.testing.assert_allclose(sure.covariance, without.covariance, rtol=1e-6, atol=1e-12)


def test_a_path_without_a_finite_pose_determines_no_bias() -> None:
    problem = replace(plain_problem(Scene().sequence()), initial_pose=np.full((4, 4), np.nan))
    estimate = ekf.joint_ekf_bias(problem)
    assert estimate.status == "failed"
    assert not [event for event in estimate.events if event.kind == "estimated gyroscope bias"]


@pytest.mark.parametrize("wrong", [{"deviation": 0.0}, {"deviation": np.nan}, {"walk": -1.0}, {"walk": np.inf}])
def test_a_prior_that_cannot_be_is_named(wrong: dict[str, float]) -> None:
    (name,) = wrong
    with pytest.raises(FgbaselineError, match=rf"^gyro_bias.{name}: .*{wrong[name]}"):
        GyroBiasPrior(**wrong)


VARIANTS = {
    "joint-ekf-bias": JointSettings(gyro_bias=GyroBiasPrior()),
    "joint-ekf-ungated": JointSettings(gate=None),
    "joint-ekf-textbook": JointSettings.textbook(),
    "joint-ekf-first-estimate": JointSettings(linearization=Linearization.FIRST_ESTIMATE),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_other_settings_of_the_joint_filter_have_names(name: str) -> None:
    problem = matched(drive())
    estimate, expected = data.find_estimator(name)(problem, None), ekf.joint_ekf(problem, settings=VARIANTS[name])
    assert estimate.name == name
    np.testing.assert_array_equal(estimate.world_T_imu, expected.world_T_imu)


def test_the_bias_is_an_event_with_its_sigma_on_each_axis() -> None:
    estimate = ekf.joint_ekf_bias(matched(biased("town", 1, 5.0)))
    assert estimate.gyro_bias is not None
    deviation = np.sqrt(np.diagonal(estimate.gyro_bias.covariance[-1]))
    said = ", ".join(f"{m:+.4f} ± {d:.4f}" for m, d in zip(estimate.gyro_bias.mean[-1], deviation, strict=True))
    assert estimate.events[-1] == data.Event(
        49, "estimated gyroscope bias", f"gyroscope bias ({said}) rad/s in the axes of the IMU"
    )
    assert estimate.gyro_bias.mean.shape == (50, 3)
    assert np.isfinite(estimate.gyro_bias.covariance).all()
