"""The two presets: which features, where they start, what the noise is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import data, diagnosis
from fgbaseline.data import Excluded, Observations, Sequence
from fgbaseline.data.problem.documented import most_observed
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import Shift, back_project, dead_reckoned_path, increments
from fgbaseline.geometry import InputError, se3

from ..builders.synthetic import Scene, drive, with_pixels


def seen_times(counts: list[int]) -> Observations:
    """Landmark j seen in frames 0 to counts[j] - 1."""
    frame = np.concatenate([np.arange(n) for n in counts] or [[]])
    landmark = np.repeat(np.arange(len(counts)), counts)
    return Observations.sort(frame.astype(np.int64), landmark, np.zeros((len(frame), 4)))


@given(st.lists(st.integers(0, 4), min_size=1, max_size=12), st.integers(1, 14))
def test_the_features_are_those_seen_most_often_and_of_equals_the_lower_index(counts: list[int], n: int) -> None:
    chosen = most_observed(seen_times(counts), len(counts), n)
    ranked = sorted((j for j in range(len(counts)) if counts[j]), key=lambda j: (-counts[j], j))
    assert chosen.tolist() == sorted(ranked[:n])
    assert most_observed(seen_times(counts), len(counts), None).tolist() == sorted(ranked)


@pytest.mark.parametrize("n", [0, -3])
def test_no_feature_is_no_choice(n: int) -> None:
    with pytest.raises(InputError, match=f"got {n}"):
        data.documented(drive(), n)


def test_the_documented_problem_is_that_of_the_report() -> None:
    sequence = drive()
    problem = data.documented(sequence, 20)
    o = sequence.observations
    assert len(problem.features) == 20
    np.testing.assert_array_equal(problem.mask, np.isin(o.landmark, problem.features))
    assert set(problem.excluded.tolist()) == {Excluded.NO, Excluded.FEATURE_NOT_CHOSEN}
    W = np.diag([0.5, 0.5, 0.5, 0.05, 0.05, 0.05])
    np.testing.assert_array_equal(problem.increment_covariance, np.broadcast_to(W, (49, 6, 6)))
    assert (problem.pixel_variance, problem.mapping_pixel_variance) == (15.0, 1.0)
    assert problem.kernel is None
    np.testing.assert_array_equal(problem.initial_pose, np.eye(4))
    np.testing.assert_array_equal(problem.initial_covariance, np.zeros((6, 6)))
    tau_u = np.hstack([sequence.linear_velocity, sequence.angular_velocity])[:-1] * sequence.dt[:, None]
    np.testing.assert_array_equal(problem.increment, tau_u)
    assert problem.landmark_prior is not None
    np.testing.assert_array_equal(problem.landmark_prior.covariance, 0.01 * np.eye(3))


def test_a_landmark_starts_at_the_average_of_its_back_projections() -> None:
    problem = data.documented(drive())
    o = problem.sequence.observations
    points = back_project(problem.sequence, dead_reckoned_path(problem.increment))
    assert problem.landmark_prior is not None
    for j, mean in zip(problem.features, problem.landmark_prior.mean, strict=True):
        np.testing.assert_allclose(mean, points[o.landmark == j].mean(axis=0), rtol=1e-12, atol=1e-12)


def test_a_back_projection_projects_to_where_it_came_from() -> None:
    s = drive()
    path = dead_reckoned_path(increments(s))
    in_camera = se3.transform(se3.inverse(path @ s.imu_T_cam)[s.observations.frame], back_project(s, path))
    pixel = s.camera.project(in_camera)
    np.testing.assert_allclose(pixel[:, :3], s.observations.pixel[:, :3], rtol=0, atol=1e-8)


def test_an_observation_at_infinity_has_no_back_projection_and_is_left_out_with_a_remark() -> None:
    s = Scene().sequence()
    pixel = s.observations.pixel.copy()
    pixel[7, 2] = pixel[7, 0]
    problem = data.documented(with_pixels(s, pixel))
    assert np.flatnonzero(problem.excluded == Excluded.DISPARITY).tolist() == [7]
    assert any("disparity of exactly zero" in remark for remark in problem.remarks)
    assert problem.landmark_prior is not None
    assert np.isfinite(problem.landmark_prior.mean).all()


def counted(problem: data.Problem, sequence: Sequence) -> list[int]:
    return problem.observations().counts(sequence.n_landmarks).tolist()


def test_a_reduced_calibrated_problem_keeps_what_is_seen_most_after_masking() -> None:
    s = Scene(frames=10, n_points=4).sequence()
    pixel = s.observations.pixel.copy()
    # Landmark 0 is seen as often as the others, but half of its track is not its own.
    pixel[4 * np.arange(5, 10), :] += 40.0
    s = with_pixels(s, pixel)
    everything, three = (
        diagnosis.calibrated(s, settings=diagnosis.AsRecordedSettings()),
        diagnosis.calibrated(s, 3, settings=diagnosis.AsRecordedSettings()),
    )
    assert counted(everything, s) == [5, 10, 10, 10]
    assert three.features.tolist() == [1, 2, 3]
    assert counted(three, s) == [0, 10, 10, 10]
    of_0 = s.observations.landmark == 0
    assert three.excluded[of_0].tolist() == [Excluded.FEATURE_NOT_CHOSEN] * 5 + [Excluded.PREDICTION] * 5


@pytest.mark.parametrize("shift", Shift)
def test_the_calibrated_noise_is_a_velocity_noise_times_the_interval(shift: Shift) -> None:
    s = drive()
    noise = diagnosis.NoiseSettings(pixel=2.0, linear_velocity=0.4, angular_velocity=0.05)
    problem = diagnosis.calibrated(s, settings=diagnosis.AsRecordedSettings(noise=noise, shift=shift))
    for dt, covariance in zip(s.dt, problem.increment_covariance, strict=True):
        np.testing.assert_allclose(covariance, np.diag(np.repeat([0.4 * dt, 0.05 * dt], 3) ** 2), rtol=1e-12)
    assert problem.pixel_variance == 4.0
    assert problem.landmark_prior is None
    assert not problem.diagnosed
    assert problem.remarks[0].startswith("not diagnosed")


def test_as_recorded_means_that_each_velocity_holds_over_the_interval_after_its_stamp() -> None:
    s = drive()
    u = np.concatenate([s.linear_velocity, s.angular_velocity], axis=1)
    blind = replace(s, observations=data.Observations.none())
    as_recorded, not_diagnosed = (
        diagnosis.calibrated(s, settings=diagnosis.AsRecordedSettings()),
        diagnosis.calibrated(blind),
    )
    assert not not_diagnosed.diagnosed
    for problem in (as_recorded, not_diagnosed, data.documented(s)):
        np.testing.assert_array_equal(problem.increment, u[:-1] * s.dt[:, None])
    assert any("the velocity of frame k moves frame k to k + 1" in remark for remark in as_recorded.remarks)


def test_intervals_take_the_sample_after_before_or_the_mean() -> None:
    s = drive()
    after, mean, before = (increments(s, i) / s.dt[:, None] for i in (Shift.AFTER, Shift.MIDDLE, Shift.BEFORE))
    np.testing.assert_allclose(after[1:], before[:-1], rtol=1e-12)
    np.testing.assert_allclose(mean, 0.5 * (after + before), rtol=1e-12)


def test_the_interval_setting_recovers_a_recording_of_that_interval() -> None:
    for said, shift in (("after", Shift.AFTER), ("before", Shift.BEFORE)):
        s = simulate(Simulation(duration=5.0, sigma_linear=0.0, sigma_angular=0.0, velocity_of_interval=said))
        assert s.truth is not None
        path = dead_reckoned_path(increments(s, shift))
        np.testing.assert_allclose(path, s.truth.world_T_imu, rtol=0, atol=1e-9)


def test_flags_over_the_problem_spread_over_the_recording() -> None:
    problem = data.documented(drive(), 20)
    n = len(problem.observations())
    flags = np.arange(n) % 2 == 0
    spread = problem.scatter_mask(flags)
    np.testing.assert_array_equal(spread[problem.mask], flags)
    assert not spread[~problem.mask].any()
    assert problem.mask.sum() == n


def test_a_problem_does_not_use_ground_truth() -> None:
    s = drive()
    for preset in (data.documented, diagnosis.calibrated):
        with_truth, without = preset(s), preset(replace(s, truth=None))
        np.testing.assert_array_equal(with_truth.excluded, without.excluded)
        np.testing.assert_array_equal(with_truth.increment, without.increment)
