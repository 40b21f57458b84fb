"""The reference is trusted where its own evidence speaks for it, and says why where it does not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fgbaseline import compare, data, ekf, smoother
from fgbaseline.compare import Verdict
from fgbaseline.compare.trust import TrustLimits, motion_ratio, offered, pixel_ratio
from fgbaseline.data import Estimate, Event, Problem, Status
from fgbaseline.data.motion import Shift
from fgbaseline.geometry import disparity

from .synthetic import drive, matched, plain_problem


@cache
def clean() -> Problem:
    return matched(drive(seconds=6.0, features_per_frame=25.0))


@cache
def reference() -> Estimate:
    return smoother.isam2(clean())


def told(pixel: float = 0.5, linear: float = 0.1, angular: float = 0.01) -> Problem:
    """The same drive with another noise model, without a mask that would hide its consequences."""
    noise = data.NoiseSettings(pixel=pixel, linear_velocity=linear, angular_velocity=angular)
    problem = data.calibrated(clean().sequence, settings=data.Calibration(noise=noise, shift=Shift.AFTER))
    return replace(problem, kernel=None)


def test_a_clean_drive_is_trusted_and_its_residuals_are_as_large_as_its_noise() -> None:
    verdict = compare.trust(clean(), reference())
    assert verdict.verdict is Verdict.TRUSTED, verdict.reasons
    assert pixel_ratio(told(), smoother.isam2(told())) == pytest.approx(1.0, abs=0.15)
    assert motion_ratio(clean(), reference()) < 1.0
    assert any("not diagnosed" in reason for reason in verdict.reasons)


def test_the_pixel_ratio_is_the_square_of_how_much_too_small_the_noise_was_told() -> None:
    exact, small = told(), replace(told(), pixel_variance=(0.5 / 4) ** 2)
    estimate = smoother.isam2(exact)
    assert pixel_ratio(small, estimate) == pytest.approx(16.0 * pixel_ratio(exact, estimate))


@pytest.mark.parametrize("kernel", [None, data.HuberKernel()])
def test_pixel_noise_told_four_times_too_small_is_not_trusted(kernel: data.HuberKernel | None) -> None:
    problem = replace(told(pixel=0.5 / 4), kernel=kernel)
    verdict = compare.trust(problem, smoother.isam2(problem))
    assert verdict.verdict is Verdict.UNTRUSTED
    assert "pixel residuals" in verdict.reasons[0]


def test_velocities_that_contradict_the_pixels_are_not_trusted() -> None:
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
    assert "measured motion" in " ".join(verdict.reasons[:2])


def test_few_observations_are_not_trusted() -> None:
    rare = np.flatnonzero(reference().used)
    used = np.zeros_like(reference().used)
    used[rare[::5]] = True
    verdict = compare.trust(clean(), replace(reference(), used=used))
    assert verdict.verdict is Verdict.UNTRUSTED
    assert any("observations with a disparity" in reason for reason in verdict.reasons[:2])
    assert any("fewer than 6" in reason for reason in verdict.reasons[:2])


def test_what_failed_or_used_nothing_is_not_trusted() -> None:
    problem = clean()
    failed = Estimate.failed("isam2", "the system is indeterminate", problem.n_frames, len(problem.excluded))
    assert compare.trust(problem, failed) == compare.Trust(
        Verdict.UNTRUSTED, ("it failed: the system is indeterminate",)
    )
    assert compare.trust(problem, ekf.dead_reckoning(problem)).verdict is Verdict.UNTRUSTED


def test_frames_given_up_are_doubtful_and_many_untrusted() -> None:
    def without(n: int) -> compare.Trust:
        events = tuple(Event(k, "frame without observations", "") for k in range(n))
        return compare.trust(clean(), replace(reference(), status=Status.RECOVERED, events=events))

    assert without(1).verdict is Verdict.DOUBTFUL
    assert without(10).verdict is Verdict.UNTRUSTED
    assert "given up" in without(10).reasons[0]


def test_the_reasons_are_sorted_by_how_bad_they_are_and_the_first_one_decides() -> None:
    limits = TrustLimits(weak_frames=(-1.0, 2.0), used_share=(2.0, 2.0))
    verdict = compare.trust(clean(), reference(), limits)
    assert verdict.verdict is Verdict.UNTRUSTED
    assert "observations with a disparity" in verdict.reasons[0]
    assert "fewer than 6" in verdict.reasons[1]


def test_offered_are_the_wanted_observations_with_a_disparity() -> None:
    problem = clean()
    o = problem.sequence.observations
    np.testing.assert_array_equal(offered(problem), disparity(o.pixel) > 1.0)
    few = data.calibrated(problem.sequence, 10, settings=data.Calibration())
    np.testing.assert_array_equal(
        offered(few), (disparity(o.pixel) > 1.0) & (few.excluded != data.Excluded.FEATURE_NOT_CHOSEN)
    )


def test_a_path_with_missing_poses_is_no_evidence_and_not_trusted() -> None:
    poses = reference().world_T_imu.copy()
    poses[40:] = np.nan
    assert compare.trust(clean(), replace(reference(), world_T_imu=poses)).verdict is Verdict.UNTRUSTED
