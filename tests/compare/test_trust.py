"""The reference is trusted where its own evidence speaks for it, and says why where it does not."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fgbaseline import compare, data, diagnosis, ekf, smoother
from fgbaseline.compare import Verdict
from fgbaseline.compare.reference_trust import TrustLimits, _verdict_above, _verdict_below, expected_observations
from fgbaseline.compare.residuals.cost import cost
from fgbaseline.compare.residuals.noise_scale import expected_square, motion_scale, pixel_scale
from fgbaseline.data import Estimate, Event, Problem, Status
from fgbaseline.data.triangulate_landmarks import landmarks_along
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.data.wording import number, per_cent
from fgbaseline.geometry import disparity
from fgbaseline.smoother.batch.full_graph import full_graph
from fgbaseline.smoother.graph.gtsam_conversions import values_from_state

from ..builders.synthetic import Scene, drive, matched, plain_problem, with_pixels


@cache
def clean() -> Problem:
    return matched(drive(seconds=6.0, features_per_frame=25.0))


@cache
def reference() -> Estimate:
    return smoother.isam2(clean())


def assumed_noise(pixel: float = 0.5, linear: float = 0.1, angular: float = 0.01) -> Problem:
    """The same drive with another noise model, without a mask that would hide its consequences."""
    noise = diagnosis.NoiseSettings(pixel=pixel, linear_velocity=linear, angular_velocity=angular)
    problem = diagnosis.calibrated(
        clean().sequence, settings=diagnosis.AsRecordedSettings(noise=noise, shift=Shift.AFTER)
    )
    return replace(problem, kernel=None)


def test_a_clean_drive_is_trusted_and_its_residuals_are_as_large_as_its_noise() -> None:
    verdict = compare.trust(clean(), reference())
    assert verdict.verdict is Verdict.TRUSTED, verdict.reasons
    assert motion_scale(clean(), reference()) < 1.0
    assert any("not diagnosed" in reason for reason in verdict.reasons)


@pytest.mark.parametrize("kernel", [None, data.HuberKernel()])
@pytest.mark.parametrize("features_per_frame", [8.0, 25.0])
@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0, 3.0, 5.0])
def test_the_pixel_scale_is_that_of_the_noise_within_a_tenth(
    scale: float, features_per_frame: float, kernel: data.HuberKernel | None
) -> None:
    sequence = drive(seconds=6.0, features_per_frame=features_per_frame)
    noise = diagnosis.NoiseSettings(pixel=0.5 / scale, linear_velocity=0.1, angular_velocity=0.01)
    problem = diagnosis.calibrated(sequence, settings=diagnosis.AsRecordedSettings(noise=noise, shift=Shift.AFTER))
    problem = replace(problem, kernel=kernel, excluded=np.zeros_like(problem.excluded))
    assert problem.mask.all()
    estimate = smoother.isam2(problem)
    found = pixel_scale(problem, estimate)
    assert found == pytest.approx(scale, rel=0.1)
    said = f"normalized pixel residual RMS {number(found)} (limit 1.6; 1 is expected)"
    assert said in compare.trust(problem, estimate).reasons


@pytest.mark.parametrize("threshold", [None, 2.5, 1.0])
@pytest.mark.parametrize("scale", [0.0, 1e-3, 0.3, 1.0, 3.0, 100.0])
def test_the_expected_square_is_the_mean_of_the_weighted_ones(scale: float, threshold: float | None) -> None:
    squared = np.sum((scale * np.random.default_rng(1).normal(size=(200_000, 3))) ** 2, axis=1)
    kernel = None if threshold is None else data.HuberKernel(threshold)
    weighted = squared if kernel is None else kernel.weighted(squared)
    assert float(expected_square(scale, threshold)) == pytest.approx(weighted.mean(), rel=0.01, abs=1e-30)


def test_an_infinite_residual_has_an_infinite_scale_and_a_missing_one_none() -> None:
    problem = clean()
    for value, verdict in ((np.inf, "inf"), (np.nan, "nan")):
        points = reference().landmarks.position.copy()
        points[0] = value
        broken = replace(reference(), landmarks=replace(reference().landmarks, position=points))
        assert str(pixel_scale(problem, broken)) == verdict
        assert compare.trust(problem, broken).verdict is Verdict.UNTRUSTED


@pytest.mark.parametrize("kernel", [None, data.HuberKernel()])
def test_a_pixel_sigma_four_times_too_small_is_not_trusted(kernel: data.HuberKernel | None) -> None:
    problem = replace(assumed_noise(pixel=0.5 / 4), kernel=kernel)
    verdict = compare.trust(problem, smoother.isam2(problem))
    assert verdict.verdict is Verdict.UNTRUSTED
    assert "pixel residual RMS" in verdict.reasons[0]


def test_velocities_inconsistent_with_the_pixels_are_not_trusted() -> None:
    sequence = clean().sequence
    flipped = replace(sequence, angular_velocity=-sequence.angular_velocity)
    problem = replace(
        plain_problem(flipped),
        excluded=clean().excluded,
        features=clean().features,
        increment_covariance=clean().increment_covariance,
        initial_covariance=np.zeros((6, 6)),
    )
    verdict = compare.trust(problem, smoother.isam2(problem))
    assert verdict.verdict is not Verdict.TRUSTED
    assert "motion residual RMS" in " ".join(verdict.reasons[:2])


def test_few_observations_are_not_trusted() -> None:
    rare = np.flatnonzero(reference().used)
    used = np.zeros_like(reference().used)
    used[rare[::5]] = True
    verdict = compare.trust(clean(), replace(reference(), used=used))
    assert verdict.verdict is Verdict.UNTRUSTED
    assert any("of the recorded ones except far points (disparity of 0 to 1 px)" in r for r in verdict.reasons[:2])
    assert any("fewer than 6" in reason for reason in verdict.reasons[:2])


def test_a_failed_reference_or_one_without_observations_is_not_trusted() -> None:
    problem = clean()
    failed = Estimate.failed("isam2", "the system is indeterminate", problem.n_frames, len(problem.excluded))
    assert compare.trust(problem, failed) == compare.Trust(
        Verdict.UNTRUSTED, ("it failed: the system is indeterminate",)
    )
    assert compare.trust(problem, ekf.dead_reckoning(problem)).verdict is Verdict.UNTRUSTED


def test_dropped_frames_lower_the_trust_to_doubtful_and_many_to_untrusted() -> None:
    def without(n: int) -> compare.Trust:
        events = tuple(Event(k, "frame without observations", "") for k in range(n))
        return compare.trust(clean(), replace(reference(), status=Status.RECOVERED, events=events))

    assert without(1).verdict is Verdict.DOUBTFUL
    assert without(10).verdict is Verdict.UNTRUSTED
    assert "of the frames were dropped" in without(10).reasons[0]
    assert not any("dropped" in reason for reason in without(0).reasons)


def test_the_reasons_are_sorted_by_how_bad_they_are_and_the_first_one_decides() -> None:
    limits = TrustLimits(weak_frames=(-1.0, 2.0), weak_below=1000, used_share=(2.0, 2.0))
    verdict = compare.trust(clean(), reference(), limits=limits)
    assert verdict.verdict is Verdict.UNTRUSTED
    assert "of the recorded ones except far points (disparity of 0 to 1 px)" in verdict.reasons[0]
    assert "fewer than 1000" in verdict.reasons[1]


def test_expected_are_the_observations_of_the_chosen_features_but_for_excluded_far_points() -> None:
    problem = clean()
    d = disparity(problem.sequence.observations.pixel)
    np.testing.assert_array_equal(expected_observations(problem), problem.mask | (d > 1.0) | (d <= 0.0))
    pixel = problem.sequence.observations.pixel.copy()
    pixel[::7, 3] += 10.0  # not on one row: excluded
    few = diagnosis.calibrated(with_pixels(problem.sequence, pixel), 10, settings=diagnosis.AsRecordedSettings())
    chosen = np.isin(few.sequence.observations.landmark, few.features)
    assert (~chosen & (few.excluded != data.Excluded.FEATURE_NOT_CHOSEN)).any()  # excluded ones of other tracks
    np.testing.assert_array_equal(expected_observations(few), few.mask | (((d > 1.0) | (d <= 0.0)) & chosen))


@pytest.mark.parametrize("preset", [data.documented, diagnosis.calibrated])
def test_no_estimator_uses_more_than_was_offered(preset: Callable[[data.Sequence], Problem]) -> None:
    far = drive("loop", seconds=6.0, features_per_frame=25.0)
    pixel = far.observations.pixel.copy()
    pixel[::3, 2:] = pixel[::3, :2] - [0.5, 0.0]  # a third of the points is far away
    problem = preset(with_pixels(far, pixel))
    for estimate in (smoother.isam2(problem), ekf.ekf(problem)):
        assert not (estimate.used & ~expected_observations(problem)).any()
        share = next(r for r in compare.trust(problem, estimate).reasons if "except far points" in r)
        assert all(float(part.split()[-1]) <= 100.0 for part in share.split("%")[:-1])


def test_impossible_observations_are_counted_and_named() -> None:
    problem = clean()
    pixel = problem.sequence.observations.pixel.copy()
    rest = np.random.default_rng(0).random(len(pixel)) < 0.6
    pixel[rest] = 0.0
    sequence = with_pixels(problem.sequence, pixel)
    excluded = np.where(rest, data.Excluded.DISPARITY, problem.excluded).astype(np.uint8)
    broken = replace(problem, sequence=sequence, excluded=excluded)
    verdict = compare.trust(broken, replace(reference(), used=reference().used & ~rest))
    assert verdict.verdict is Verdict.UNTRUSTED
    said = "of the observations have no positive disparity, though every point in view has one (limit 20 %)"
    assert any(reason.endswith(said) for reason in verdict.reasons[:2])


def test_a_path_with_missing_poses_is_no_evidence_and_not_trusted() -> None:
    poses = reference().world_T_imu.copy()
    poses[40:] = np.nan
    assert compare.trust(clean(), replace(reference(), world_T_imu=poses)).verdict is Verdict.UNTRUSTED


@cache
def solved_as_a_batch() -> Estimate:
    return smoother.batch(clean(), given={"isam2": reference()})


def test_an_agreeing_batch_solution_is_reported() -> None:
    verdict = compare.trust(clean(), reference(), solved_as_a_batch())
    assert verdict.verdict is Verdict.TRUSTED, verdict.reasons
    assert any("a batch solution agrees" in reason for reason in verdict.reasons)
    assert any("not compared with a batch" in reason for reason in compare.trust(clean(), reference()).reasons)


@pytest.mark.parametrize(
    ("sideways", "expected"), [(0.01, Verdict.TRUSTED), (0.3, Verdict.DOUBTFUL), (3.0, Verdict.UNTRUSTED)]
)
def test_a_reference_away_from_the_batch_solution_is_not_trusted(sideways: float, expected: Verdict) -> None:
    batch = solved_as_a_batch()
    moved = batch.world_T_imu.copy()
    moved[:, 1, 3] += sideways
    points = replace(batch.landmarks, position=batch.landmarks.position + np.array([0.0, sideways, 0.0]))
    # All of it together: the cost stays, but for the first pose, which is held.
    shifted = replace(batch, name="isam2", world_T_imu=moved, landmarks=points)
    verdict = compare.trust(clean(), shifted, batch)
    assert verdict.verdict is expected, verdict.reasons
    if expected is not Verdict.TRUSTED:
        assert "a batch solution disagrees" in verdict.reasons[0]


def test_a_cost_above_that_of_the_batch_solution_is_not_trusted() -> None:
    batch = solved_as_a_batch()
    random = np.random.default_rng(0)
    points = replace(
        batch.landmarks, position=batch.landmarks.position * random.normal(1.0, 0.02, (len(batch.landmarks), 1))
    )
    verdict = compare.trust(clean(), replace(batch, name="isam2", landmarks=points), batch)
    assert verdict.verdict is Verdict.UNTRUSTED


def test_a_batch_solution_from_one_start_is_doubtful_also_as_the_reference_itself() -> None:
    failed = Estimate.failed("isam2", "indeterminate", clean().n_frames, len(clean().excluded))
    alone = smoother.batch(clean(), given={"isam2": failed})
    assert compare.trust(clean(), alone, alone).verdict is Verdict.DOUBTFUL
    batch = solved_as_a_batch()
    assert "it is the batch solution itself" in compare.trust(clean(), batch, batch).reasons


@pytest.mark.parametrize("kernel", [None, data.HuberKernel(1.0)])
def test_the_cost_is_that_of_the_four_rows_and_of_the_graph(kernel: data.HuberKernel | None) -> None:
    problem = plain_problem(Scene().sequence(), kernel)
    estimate = smoother.isam2(problem)
    # But for the prior of the first pose, which it leaves out.
    graph, values = full_graph(problem), values_from_state(estimate.world_T_imu, estimate.landmarks)
    expected = graph.error(values) - graph.at(0).error(values)
    assert cost(problem, estimate, problem.mask) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("value", "high", "low"), [(2.0, 0, 1), (2.1, 1, 1), (4.0, 1, 0), (4.1, 2, 0), (1.9, 0, 2), (np.nan, 2, 2)]
)
def test_a_metric_at_its_limit_holds_and_a_missing_one_does_not(value: float, high: int, low: int) -> None:
    assert _verdict_above(value, (2.0, 4.0)) == high
    assert _verdict_below(value, (4.0, 2.0)) == low


def true_answer(problem: Problem) -> Estimate:
    assert problem.sequence.truth is not None
    path = problem.sequence.truth.world_T_imu
    return Estimate("true", path, problem.mask, landmarks=landmarks_along(problem, path))


def test_six_observations_are_enough_for_a_frame_and_five_are_not() -> None:
    for n, weak in ((6, False), (5, True)):
        problem = plain_problem(Scene(n_points=n).sequence())
        reasons = compare.trust(problem, true_answer(problem)).reasons
        assert ("100 % of the frames have fewer than 6 used observations (limit 5 %)" in reasons) == weak
        assert any("fewer than 6" in reason for reason in reasons) == weak


def test_intervals_without_common_landmarks_are_reported() -> None:
    problem = plain_problem(Scene().sequence())
    answer = true_answer(problem)
    frame = problem.sequence.observations.frame
    said = "have no used landmark in common; there only the velocities constrain the motion"
    for seen, untied in ((3, 7), (8, 2), (10, 0)):
        reasons = compare.trust(problem, replace(answer, used=answer.used & (frame < seen))).reasons
        pairs = f"{untied} of 9 pairs of consecutive frames ({per_cent(untied / 9)})"
        limit = " (limit 25 %)" if untied / 9 > 0.25 else ""
        assert (f"{pairs} {said}{limit}" in reasons) == (untied > 0)
        assert any("no used landmark in common" in reason for reason in reasons) == (untied > 0)
    limits = TrustLimits(*[(np.inf, np.inf)] * 2, (0.0, 0.0), (1.0, 1.0), given_up_frames=(1.0, 1.0))
    verdicts = [
        compare.trust(problem, replace(answer, used=answer.used & (frame < seen)), limits=limits).verdict
        for seen in (8, 7, 3)
    ]
    assert verdicts == [Verdict.TRUSTED, Verdict.DOUBTFUL, Verdict.UNTRUSTED]  # 2, 3 and 7 of 9 intervals


def test_the_reasons_of_trust_state_their_figures() -> None:
    problem = clean()
    pixel, motion = pixel_scale(problem, reference()), motion_scale(problem, reference())
    n = reference().used.sum()
    of_recorded, of_unmasked = (per_cent(n / whole.sum()) for whole in (expected_observations(problem), problem.mask))
    assert set(compare.trust(problem, reference()).reasons) == {
        f"normalized pixel residual RMS {number(pixel)} (limit 1.6; 1 is expected)",
        f"normalized motion residual RMS {number(motion)} (limit 1.4; at most 1 is expected)",
        f"{reference().name} used {n:,} observations: {of_recorded} of the recorded ones except far points (disparity "
        f"of 0 to 1 px), {of_unmasked} of the unmasked ones",
        "the recording was not diagnosed: its noise is assumed",
        "not compared with a batch solution",
    }
    diagnosed = compare.trust(replace(problem, diagnosed=True), reference())
    assert not any("not diagnosed" in reason for reason in diagnosed.reasons)
    failed = Estimate.failed("batch", "indeterminate", problem.n_frames, len(problem.excluded))
    beside = compare.trust(problem, reference(), failed)
    assert "not compared with a batch solution: that failed, indeterminate" in beside.reasons
    assert beside.verdict is Verdict.TRUSTED


def test_an_estimate_without_used_observations_is_reported() -> None:
    nothing = replace(reference(), used=np.zeros_like(reference().used))
    assert compare.trust(clean(), nothing) == compare.Trust(Verdict.UNTRUSTED, ("it used no observation",))


def test_a_disparity_of_one_pixel_is_not_above_it() -> None:
    sequence = Scene().sequence()
    pixel = sequence.observations.pixel.copy()
    pixel[0], pixel[1] = [100.0, 50.0, 99.0, 50.0], [100.0, 50.0, 98.5, 50.0]
    pixel[2], pixel[3] = [100.0, 50.0, 100.0, 50.0], [100.0, 50.0, 99.5, 50.0]
    problem = plain_problem(with_pixels(sequence, pixel))
    nothing = replace(problem, excluded=np.full_like(problem.excluded, data.Excluded.DISPARITY))
    assert expected_observations(nothing)[:4].tolist() == [False, True, True, False]


def test_the_worst_criterion_decides_the_verdict_and_each_has_its_value_beside_its_limits() -> None:
    answer = compare.trust(clean(), reference())
    assert {c.code for c in answer.criteria} <= set(TrustLimits.__dataclass_fields__)
    assert answer.verdict >= max(c.verdict for c in answer.criteria)
    for c in answer.criteria:
        beyond = (c.value < c.doubtful) if c.at_least else (c.value > c.doubtful)
        assert beyond == (c.verdict is not Verdict.TRUSTED), c
    tight = compare.trust(clean(), reference(), limits=TrustLimits(pixel_scale=(0.0, 0.1)))
    pixel = next(c for c in tight.criteria if c.code == "pixel_scale")
    assert tight.verdict is pixel.verdict is Verdict.UNTRUSTED
    assert pixel.value == pytest.approx(pixel_scale(clean(), reference()))


def test_what_speaks_against_a_reference_has_its_limit_and_is_apart_from_the_other_reasons() -> None:
    found = compare.trust(clean(), reference(), limits=TrustLimits(weak_frames=(0.05, 0.9), weak_below=10**6))
    assert found.verdict is Verdict.UNTRUSTED
    assert found.against == ("100 % of the frames have fewer than 1000000 used observations (limit 5 %)",)
    assert found.reasons[0] == found.against[0]
    assert compare.trust(clean(), reference()).against == ()
