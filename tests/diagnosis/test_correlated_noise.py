"""Time-correlated errors, disparity offsets, visual dropouts, and delays of recordings without turns."""

from dataclasses import replace

import numpy as np
import pytest

from fgbaseline.data import Observations, Sequence
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.diagnosis import calibrated, diagnose, findings_of
from fgbaseline.diagnosis.conventions.integer_time_offset import integer_time_offset
from fgbaseline.diagnosis.repairs.visual_dropouts import averaged_over_dropouts, dropout_intervals
from fgbaseline.geometry import FloatArray

RATE = 10.0


def shifted(sequence: Sequence, by: FloatArray) -> Sequence:
    """With `by` (n, 4) added to all pixels."""
    o = sequence.observations
    return replace(sequence, observations=replace(o, pixel=o.pixel + by))


def town(seed: int, **settings: float) -> Sequence:
    return simulate(Simulation(duration=40.0, seed=seed, wrong_share=0.0, **settings))


def test_a_disparity_offset_is_estimated_reported_and_subtracted() -> None:
    sequence = town(3)
    by = np.zeros((len(sequence.observations), 4))
    by[:, 2] = 0.4
    diagnosis = diagnose(shifted(sequence, by))
    offset, deviation = diagnosis.disparity_offset
    assert offset == pytest.approx(0.4, abs=4.0 * deviation)
    assert deviation < 0.06
    reported = [finding for finding in findings_of(diagnosis) if finding.code == "disparity_offset"]
    assert len(reported) == 1
    assert "too small" in reported[0].sentence
    problem = calibrated(diagnosis.sequence, diagnosis=diagnosis)
    row = problem.sequence.observations.pixel[:, 2]
    assert np.mean(row) == pytest.approx(np.mean(sequence.observations.pixel[:, 2]), abs=4.0 * deviation)
    assert any("uR reduced by" in sentence for sentence in problem.repairs)


def test_white_noise_is_not_inflated_and_time_correlated_errors_are() -> None:
    sequence = town(5)
    white = diagnose(sequence)
    assert white.fit is not None
    assert white.fit.inflation.pixel < 1.4
    assert white.fit.inflation.velocity < 1.4
    random, o = np.random.default_rng(0), sequence.observations
    # as a tracker drifts: each track away from its first frame on, left and right image together
    first = np.zeros(sequence.n_landmarks, dtype=np.int64)
    order = o.by_track()[::-1]
    first[o.landmark[order]] = o.frame[order]
    drift = 0.15 * random.normal(size=(sequence.n_landmarks, 2))[o.landmark] * (o.frame - first[o.landmark])[:, None]
    lasting = diagnose(shifted(sequence, drift[:, [0, 1, 0, 1]]))
    assert lasting.fit is not None
    assert lasting.fit.inflation.halves > 1.5
    assert lasting.fit.sigmas.pixel > 1.5 * white.fit.sigmas.pixel
    assert lasting.fit.inflation.velocity == 1.0


def test_time_correlated_velocity_errors_inflate_the_velocity_noise_alone() -> None:
    sequence = town(7, sigma_angular=0.002)
    turn = 0.03 * np.sin(2.0 * np.pi * np.arange(sequence.n_frames) / 50.0)[:, None] * [1.0, -1.0, 1.0]
    found = diagnose(replace(sequence, angular_velocity=sequence.angular_velocity + turn)).fit
    assert found is not None
    assert found.inflation.velocity > 1.3
    assert found.inflation.pixel < 1.4


def velocities(n: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Slowly changing velocities (n, 6) and noisy records of them."""
    random, t = np.random.default_rng(seed), np.arange(n) / RATE
    phase = random.uniform(0.0, 6.0, 6)
    true = np.sin(0.5 * t[:, None] + phase) * np.repeat([2.0, 0.2], 3)
    return true, true + np.repeat([0.5, 0.05], 3) * random.normal(size=(n, 6))


@pytest.mark.parametrize("length", [1, 3])
def test_a_bridged_dropout_is_more_accurate_than_its_sample_and_its_variance_is_consistent(length: int) -> None:
    whitened, own = [], []
    for seed in range(40):
        true, recorded = velocities(300, seed)
        blind = np.zeros(300, dtype=np.bool_)
        for start in range(30, 270, 40):
            blind[start : start + length] = True
        seen = np.where(blind[:, None], np.nan, true)
        result = averaged_over_dropouts(recorded, seen, blind, np.repeat([0.5, 0.05], 3))
        np.testing.assert_array_equal(result.blind, np.flatnonzero(blind))
        np.testing.assert_array_equal(result.twist[~blind], recorded[~blind])
        sums = (result.twist - true)[blind].reshape(-1, length, 6).sum(axis=1)
        claimed = (result.deviation[blind] ** 2).reshape(-1, length, 6).sum(axis=1)
        whitened.append(sums**2 / claimed)
        own.append((recorded - true)[blind].reshape(-1, length, 6).sum(axis=1) ** 2 / claimed)
    assert np.mean(whitened) == pytest.approx(1.0, abs=0.15)
    assert np.mean(own) > 2.0


def test_a_velocity_without_noise_is_unchanged() -> None:
    true, _ = velocities(100, 0)
    blind = np.zeros(100, dtype=np.bool_)
    blind[50] = True
    result = averaged_over_dropouts(true, np.where(blind[:, None], np.nan, true), blind, np.full(6, 1e-6))
    assert len(result.blind) == 0
    np.testing.assert_array_equal(result.twist, true)


def test_blind_intervals_have_too_few_landmarks_in_common() -> None:
    frame, landmark = np.repeat(np.arange(5), 10), np.tile(np.arange(10), 5)
    landmark[frame >= 3] += 10
    landmark[(frame == 4) & (landmark > 14)] += 100
    observations = Observations(frame, landmark, np.zeros((50, 4)))
    assert dropout_intervals(observations, 5).tolist() == [False, False, True, True]


def test_an_integer_time_offset_is_the_minimum_of_the_fit_or_undetermined() -> None:
    dt = 0.1

    def parabola(depth: float, at: float) -> float | None:
        found = integer_time_offset(lambda shift: depth * (shift - at) ** 2, dt)
        return None if found is None else found.shift

    assert parabola(100.0, -0.9) == pytest.approx(-0.09)
    assert parabola(100.0, 0.1) == pytest.approx(0.01)
    assert parabola(1.0, -1.0) is None
    assert parabola(100.0, -2.4) is None


def test_a_cost_that_is_no_parabola_determines_whole_intervals_alone() -> None:
    """As where motion changes too much between frames: away from the true shift, any cost is as bad as any other."""
    dt = 0.1
    for floor, before, after in ((100.0, 4e5, 1e5), (100.0, 5e3, 4e5)):

        def cost(shift: float, floor: float = floor, before: float = before, after: float = after) -> float:
            return floor if shift == 0.0 else before if shift < 0.0 else after

        found = integer_time_offset(cost, dt)
        assert found is not None
        assert found.shift == 0.0
        assert found.deviation > 0.2 * dt


def test_braking_determines_the_interval_of_a_velocity() -> None:
    still = town(2)
    n, t = still.n_frames, still.t
    velocity = np.column_stack([8.0 + 4.0 * np.sin(1.2 * t), np.zeros((n, 2))])
    straight = replace(still, linear_velocity=velocity, angular_velocity=np.zeros((n, 3)))
    sequence = simulate(Simulation(path="along", along=straight, seed=2, wrong_share=0.0))
    late = np.roll(np.arange(n), 1)
    late[0] = 0
    held = replace(
        sequence, linear_velocity=sequence.linear_velocity[late], angular_velocity=sequence.angular_velocity[late]
    )
    for recording, shift in ((sequence, 0.0), (held, -1.0)):
        diagnosis = diagnose(recording)
        assert diagnosis.timing.identifiable
        assert diagnosis.shift == shift
        assert len(diagnosis.timing.shifts) == 4
