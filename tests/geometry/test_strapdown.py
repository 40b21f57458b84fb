"""Strapdown integration: closed forms, composition, finite differences, and two independent witnesses in GTSAM."""

from typing import NamedTuple

import gtsam
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.geometry import FloatArray, se3, so3, strapdown
from fgbaseline.geometry.strapdown import PreintegratedImu

GRAVITY = np.array([0.0, 0.0, -9.81])
DENSITIES = np.array([2e-3, 2e-5, 2e-2, 3e-3])
SEEDS = st.integers(0, 2**32 - 1)
RATES = st.sampled_from([0.0, 1e-3, 1.0, 90.0, 110.0, 300.0])
"""rad/s: at 0.01 s on both sides of the angle where closed forms take over from the series"""
GTSAM_ORDER = np.r_[3:6, 0:3, 6:9, 12:15, 9:12]
"""[rotation, position, velocity, accelerometer bias, gyroscope bias] of ours, and the other way round"""


class Samples(NamedTuple):
    rate: FloatArray
    force: FloatArray
    dt: FloatArray

    def motion(
        self, gyroscope_bias: FloatArray | float = 0.0, accelerometer_bias: FloatArray | float = 0.0
    ) -> PreintegratedImu:
        return strapdown.integrate(self.rate - gyroscope_bias, self.force - accelerometer_bias, self.dt, DENSITIES)

    def part(self, chosen: slice) -> "Samples":
        return Samples(*(array[chosen] for array in self))

    def divided(self, m: int) -> "Samples":
        """Every sample in m equal parts."""
        return Samples(np.repeat(self.rate, m, axis=0), np.repeat(self.force, m, axis=0), np.repeat(self.dt, m) / m)


def constant(n: int = 10) -> Samples:
    return Samples(np.tile([0.3, -0.5, 0.8], (n, 1)), np.tile([1.0, 2.0, 9.8], (n, 1)), np.full(n, 0.1 / n))


def without_rotation(n: int = 10) -> Samples:
    force = np.random.default_rng(5).normal(size=(n, 3))
    return Samples(np.zeros((n, 3)), 3.0 * force + [0.0, 0.0, 9.8], np.full(n, 0.1 / n))


def random(seed: int, n: int = 10, rate: float = 1.0) -> Samples:
    rng = np.random.default_rng(seed)
    return Samples(rng.normal(size=(n, 3)) * rate, rng.normal(size=(n, 3)) * 3.0 + [0.0, 0.0, 9.8], np.full(n, 0.1 / n))


def state(seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng([seed, 1])
    return se3.exp(rng.normal(size=6)), rng.normal(size=3)


def assert_motions_agree(actual: PreintegratedImu, expected: PreintegratedImu, atol: float = 1e-12) -> None:
    for name in ("rotation", "velocity", "position", "dt", "transition"):
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), atol=atol, rtol=0.0, err_msg=name)


def test_constant_force_without_rotation_is_a_parabola() -> None:
    pose, velocity = state(0)
    samples = Samples(np.zeros((4, 3)), np.tile([0.5, -1.0, 9.0], (4, 1)), np.full(4, 0.25))
    after, v = strapdown.predict(pose, velocity, samples.motion(), GRAVITY)
    acceleration = pose[:3, :3] @ samples.force[0] + GRAVITY
    np.testing.assert_allclose(v, velocity + acceleration, atol=1e-13)
    np.testing.assert_allclose(after[:3, 3], pose[:3, 3] + velocity + 0.5 * acceleration, atol=1e-13)
    np.testing.assert_array_equal(after[:3, :3], pose[:3, :3])


@pytest.mark.parametrize("turn", [1e-6, 0.2, np.pi, 6.0])
@pytest.mark.parametrize("n", [1, 7])
def test_constant_turn_is_a_circle(turn: float, n: int) -> None:
    # x forward, y left, z up: v along x, turning left by `turn` in a second; the force points to the center.
    speed, dt = 8.0, np.full(n, 1.0 / n)
    samples = Samples(np.tile([0.0, 0.0, turn], (n, 1)), np.tile([0.0, speed * turn, 9.81], (n, 1)), dt)
    after, v = strapdown.predict(np.eye(4), np.array([speed, 0.0, 0.0]), samples.motion(), GRAVITY)
    radius = speed / turn
    np.testing.assert_allclose(v, [speed * np.cos(turn), speed * np.sin(turn), 0.0], atol=1e-12)
    center = [radius * np.sin(turn), 2.0 * radius * np.sin(0.5 * turn) ** 2, 0.0]
    np.testing.assert_allclose(after[:3, 3], center, atol=1e-11)
    np.testing.assert_allclose(after[:3, :3], so3.exp_so3([0.0, 0.0, turn]), atol=1e-13)


@given(SEEDS, RATES)
def test_a_sample_in_parts_is_the_same_motion(seed: int, rate: float) -> None:
    # The equations are exact for constant inputs; the noise is not the same, since it is held over a part.
    whole = random(seed, 3, rate)
    assert_motions_agree(whole.divided(3).motion(), whole.motion(), 1e-11)


@given(SEEDS, RATES, st.integers(1, 5))
def test_one_motion_after_another_is_the_motion_over_both(seed: int, rate: float, n: int) -> None:
    samples = random(seed, 6, rate)
    first, second, both = samples.part(slice(n)).motion(), samples.part(slice(n, None)).motion(), samples.motion()
    R, F = first.rotation, second.transition
    expected = PreintegratedImu(
        R @ second.rotation,
        first.velocity + R @ second.velocity,
        first.position + first.velocity * second.dt + R @ second.position,
        first.dt + second.dt,
        F @ first.transition,
        F @ first.noise @ F.T + second.noise,
    )
    assert_motions_agree(both, expected)
    sigma = np.sqrt(np.diag(expected.noise))
    np.testing.assert_allclose(both.noise / np.outer(sigma, sigma), expected.noise / np.outer(sigma, sigma), atol=1e-12)
    np.testing.assert_array_equal(both.noise, both.noise.T)


@given(SEEDS, RATES)
def test_white_noise_acts_as_a_bias_of_its_piece_and_the_walk_follows_it(seed: int, rate: float) -> None:
    motion = random(seed, 1, rate).motion()
    by_bias = motion.transition[:9, 9:]
    variance = np.repeat(DENSITIES[[0, 2]] ** 2, 3) / motion.dt
    expected = by_bias * variance @ by_bias.T
    np.testing.assert_allclose(motion.noise[:9, :9], expected, rtol=1e-10, atol=1e-13 * expected.max())
    walk = np.diag(np.repeat(DENSITIES[[1, 3]] ** 2, 3) * motion.dt)
    np.testing.assert_allclose(motion.noise[9:, 9:], walk, rtol=1e-12)
    np.testing.assert_array_equal(motion.noise[:9, 9:], 0.0)


@given(SEEDS, RATES)
def test_the_transition_is_the_derivative_of_the_prediction(seed: int, rate: float) -> None:
    samples, (pose, velocity), step = random(seed, 5, rate), state(seed), 1e-6

    def predicted(error: FloatArray) -> tuple[FloatArray, FloatArray]:
        moved = samples.motion(error[9:12], error[12:])
        return strapdown.predict(pose @ se3.exp(error[:6]), velocity + error[6:9], moved, GRAVITY)

    after, _ = predicted(np.zeros(15))
    F, _ = strapdown.world_axes(samples.motion(), pose[:3, :3], after[:3, :3])
    numeric = np.zeros((15, 15))
    numeric[9:, 9:] = np.eye(6)
    for i, error in enumerate(step * np.eye(15)):
        (high, v_high), (low, v_low) = predicted(error), predicted(-error)
        numeric[:6, i] = (se3.log(se3.inverse(after) @ high) - se3.log(se3.inverse(after) @ low)) / (2.0 * step)
        numeric[6:9, i] = (v_high - v_low) / (2.0 * step)
    np.testing.assert_allclose(F, numeric, atol=2e-8)


@given(SEEDS)
def test_world_axes_turn_the_velocity_only(seed: int) -> None:
    motion, (pose, velocity) = random(seed).motion(), state(seed)
    after, _ = strapdown.predict(pose, velocity, motion, GRAVITY)
    F, Q = strapdown.world_axes(motion, pose[:3, :3], after[:3, :3])
    before_R, after_R = (np.kron(np.diag([0, 0, 1, 0, 0]), R) + np.diag(np.repeat([1, 1, 0, 1, 1], 3)) for R in
                         (pose[:3, :3], after[:3, :3]))  # fmt: skip
    np.testing.assert_allclose(F, after_R @ motion.transition @ before_R.T, atol=1e-14)
    np.testing.assert_allclose(Q, after_R @ motion.noise @ after_R.T, atol=1e-20)


@given(SEEDS)
def test_rotating_the_velocity_of_a_stack_rotates_each_and_the_inverse_rotation_undoes_it(seed: int) -> None:
    P = np.array([random(seed + i).motion().noise for i in range(3)])
    R = se3.exp(np.random.default_rng(seed).normal(size=(3, 6)))[:, :3, :3]
    rotated = strapdown.rotated_velocity(P, R, R)
    each = [strapdown.rotated_velocity(p, r, r) for p, r in zip(P, R, strict=True)]
    tolerance = 1e-14 * np.abs(P).max()
    np.testing.assert_allclose(rotated, each, rtol=0.0, atol=tolerance)
    back = np.swapaxes(R, 1, 2)
    np.testing.assert_allclose(strapdown.rotated_velocity(rotated, back, back), P, rtol=0.0, atol=tolerance)


def preintegrated(samples: Samples) -> gtsam.PreintegratedCombinedMeasurements:
    """GTSAM's preintegration with the noise of ours and no error of integration."""
    params = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)
    params.setGyroscopeCovariance(DENSITIES[0] ** 2 * np.eye(3))
    params.setBiasOmegaCovariance(DENSITIES[1] ** 2 * np.eye(3))
    params.setAccelerometerCovariance(DENSITIES[2] ** 2 * np.eye(3))
    params.setBiasAccCovariance(DENSITIES[3] ** 2 * np.eye(3))
    params.setIntegrationCovariance(1e-20 * np.eye(3))
    result = gtsam.PreintegratedCombinedMeasurements(params, gtsam.imuBias.ConstantBias())
    for w, a, dt in zip(*samples, strict=True):
        result.integrateMeasurement(a, w, dt)
    return result


def test_preintegration_without_rotation_is_ours() -> None:
    ours, theirs = without_rotation().motion(), preintegrated(without_rotation())
    np.testing.assert_allclose(ours.rotation, theirs.deltaRij().matrix(), atol=1e-9)
    np.testing.assert_allclose(ours.velocity, theirs.deltaVij(), atol=1e-9)
    np.testing.assert_allclose(ours.position, theirs.deltaPij(), atol=1e-9)


@pytest.mark.parametrize("samples", [constant(), random(1), random(2)], ids=["constant", "random", "random 2"])
def test_preintegration_with_rotation_converges_to_ours_at_first_order(samples: Samples) -> None:
    # GTSAM holds the attitude of a sample's beginning over the sample, and moves the rotation vector in one Euler step.
    ours = samples.motion()

    def parts(m: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        theirs = preintegrated(samples.divided(m))
        return so3.log_so3(ours.rotation.T @ theirs.deltaRij().matrix()), theirs.deltaVij(), theirs.deltaPij()

    once, twice, four = parts(1), parts(2), parts(4)
    expected = (np.zeros(3), ours.velocity, ours.position)
    acceleration = float(np.linalg.norm(samples.force, axis=1).max())
    for whole, half, quarter, exact in zip(once, twice, four, expected, strict=True):
        assert np.abs(whole - exact).max() < acceleration * 1e-3 * 1.5  # |a| |w| dt T / 2
        extrapolated, finer = 2.0 * half - whole, 2.0 * quarter - half
        assert np.abs(extrapolated - exact).max() < 0.05 * np.abs(whole - exact).max() + 1e-9
        assert np.abs(finer - exact).max() < 0.4 * np.abs(extrapolated - exact).max() + 1e-9
    if np.ptp(samples.rate) == 0.0:  # then the rotation is exact
        np.testing.assert_allclose(once[0], 0.0, atol=1e-9)


@pytest.mark.parametrize("samples", [constant(), without_rotation(), random(1)], ids=["constant", "force", "random"])
def test_preintegrated_noise_is_ours_within_a_percent(samples: Samples) -> None:
    ours = samples.motion()
    turn = np.eye(15)
    # GTSAM's errors of position and velocity are in the first body frame, those of rotation additive in the rotation
    # vector, and those of a bias have the opposite sign.
    turn[:3, :3] = turn[6:9, 6:9] = ours.rotation.T
    turn[3:6, 3:6] = se3.right_jacobian(np.append(np.zeros(3), so3.log_so3(ours.rotation)))[3:, 3:]
    turn[9:, 9:] = -np.eye(6)
    theirs = turn @ preintegrated(samples).preintMeasCov()[np.ix_(GTSAM_ORDER, GTSAM_ORDER)] @ turn.T
    sigma = np.sqrt(np.diag(ours.noise))
    np.testing.assert_allclose(theirs / np.outer(sigma, sigma), ours.noise / np.outer(sigma, sigma), atol=0.01)


@pytest.mark.parametrize("samples", [constant(), random(1)], ids=["constant", "random"])
def test_gtsams_filter_has_our_mean_and_converges_to_our_covariance(samples: Samples) -> None:
    (pose, velocity), ours = state(0), samples.motion()
    root = 1e-2 * np.random.default_rng(0).normal(size=(9, 9))
    before, order = root @ root.T, GTSAM_ORDER[:9]
    F = ours.transition[:9, :9]
    expected = F @ before @ F.T + ours.noise[:9, :9]
    after, v = strapdown.predict(pose, velocity, ours, GRAVITY)
    sigma = np.sqrt(np.diag(expected))
    off = []
    for m in (1, 2, 4):
        params = gtsam.PreintegrationParams.MakeSharedU(9.81)
        params.setGyroscopeCovariance(DENSITIES[0] ** 2 * np.eye(3))
        params.setAccelerometerCovariance(DENSITIES[2] ** 2 * np.eye(3))
        params.setIntegrationCovariance(1e-20 * np.eye(3))
        witness = gtsam.NavStateImuEKF(
            gtsam.NavState(gtsam.Pose3(pose), velocity), before[np.ix_(order, order)], params
        )
        for w, a, dt in zip(*samples.divided(m), strict=True):
            witness.predict(w, a, dt)
        np.testing.assert_allclose(witness.state().pose().matrix(), after, atol=1e-9)
        np.testing.assert_allclose(witness.state().velocity(), v, atol=1e-9)
        theirs = witness.covariance()[np.ix_(order, order)]
        off.append(np.abs((theirs - expected) / np.outer(sigma, sigma)).max())
    assert off[0] < 0.01
    assert off[1] < 0.6 * off[0]
    assert off[2] < 0.6 * off[1]
