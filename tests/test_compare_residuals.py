"""Residuals in classes, against chi-square, and of points that moved; maps matched by landmark: known answers."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import compare
from fgbaseline.compare.residual_patterns import _p95
from fgbaseline.data import Estimate, LandmarkPrior, Landmarks, Problem, Sequence
from fgbaseline.data.triangulated import landmarks_along
from fgbaseline.geometry import FloatArray, se3

from .synthetic import Scene, plain_problem, with_pixels

SCENE = Scene(frames=16, n_points=60, seed=4)


@cache
def recording() -> Sequence:
    return SCENE.sequence()


def true_answer(problem: Problem, **changes: object) -> Estimate:
    """The true path, with the landmarks that its observations give."""
    assert problem.sequence.truth is not None
    path = problem.sequence.truth.world_T_imu
    used = np.ones(len(problem.excluded), dtype=np.bool_)
    return replace(Estimate("true", path, used, landmarks=landmarks_along(problem, path)), **changes)  # type: ignore[arg-type]


def moving(speed: float, which: int) -> Sequence:
    """The recording with one point that moves sideways at `speed` m/s."""
    sequence = recording()
    o, truth = sequence.observations, sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    mine = np.flatnonzero(o.landmark == which)
    cam_T_world = se3.inverse(truth.world_T_imu[o.frame[mine]] @ sequence.imu_T_cam)
    seconds = sequence.t[o.frame[mine]] - sequence.t.mean()
    standing = np.tile(truth.landmarks[which], (len(mine), 1))
    path: FloatArray = standing + seconds[:, None] * np.array([0.0, speed, 0.0])
    pixel = o.pixel.copy()
    camera = sequence.camera
    before, after = (camera.project(se3.transform(cam_T_world, points)) for points in (standing, path))
    pixel[mine] += after - before
    return with_pixels(sequence, pixel)


def test_a_point_that_moves_is_found_with_its_speed_and_no_other_is() -> None:
    which, speed = 7, 1.5
    problem = plain_problem(moving(speed, which))
    estimate = true_answer(problem)
    table = compare.moved_points(problem, estimate, compare.reprojection(problem.sequence, estimate))
    assert table.loc[table["moved"], "landmark"].tolist() == [which]
    assert table.loc[table["moved"], "speed"].item() == pytest.approx(speed, rel=0.1)
    assert len(table) == SCENE.n_points


def test_points_that_stand_are_not_called_moving() -> None:
    problem = plain_problem(recording())
    estimate = true_answer(problem)
    table = compare.moved_points(problem, estimate, compare.reprojection(problem.sequence, estimate))
    assert not table["moved"].any()
    # position and velocity beside position alone: three degrees of freedom
    assert table["gain"].mean() == pytest.approx(3.0, rel=0.3)


def test_a_jump_is_not_explained_by_a_motion() -> None:
    """Noise that is far too large everywhere is no motion either."""
    sequence = recording()
    pixel = sequence.observations.pixel.copy()
    mine = sequence.observations.landmark == 3
    pixel[mine] += 8.0 * np.random.default_rng(2).normal(size=(int(mine.sum()), 4))
    problem = plain_problem(with_pixels(sequence, pixel))
    estimate = true_answer(problem)
    table = compare.moved_points(problem, estimate, compare.reprojection(problem.sequence, estimate))
    assert not table["moved"].any()


def test_residuals_of_the_true_path_follow_chi_square_and_others_do_not() -> None:
    told = {sigma: plain_problem(recording(), pixel_sigma=sigma) for sigma in (0.5, 0.25)}
    summary = {}
    for sigma, problem in told.items():
        estimate = true_answer(problem)
        summary[sigma] = compare.whitened_summary(problem, compare.reprojection(problem.sequence, estimate))
    assert summary[0.5]["ratio"] == pytest.approx(1.0, abs=0.06)
    assert summary[0.5]["beyond_95"] == pytest.approx(0.05, abs=0.06)
    assert summary[0.25]["ratio"] == pytest.approx(4.0, abs=0.3)
    assert summary[0.25]["beyond_95"] > 0.9
    expected = np.sqrt(1.0 - 1.0 / SCENE.frames)
    spreads = [summary[0.5][f"spread_{row}"] for row in ("uL", "uR", "v")]
    np.testing.assert_allclose(spreads, expected, atol=0.06)


def test_tracks_have_three_degrees_of_freedom_less_than_rows_unless_landmarks_have_a_prior() -> None:
    problem = plain_problem(recording())
    table = compare.reprojection(problem.sequence, true_answer(problem))
    assert (compare.track_chi_square(problem, table)["degrees"] == 3 * SCENE.frames - 3).all()
    prior = LandmarkPrior(np.zeros((SCENE.n_points, 3)), np.eye(3))
    with_prior = compare.track_chi_square(replace(problem, landmark_prior=prior), table)
    assert (with_prior["degrees"] == 3 * SCENE.frames).all()


def test_what_an_estimator_did_not_use_is_not_held_against_it() -> None:
    problem = plain_problem(recording())
    estimate = true_answer(problem)
    pixel = recording().observations.pixel.copy()
    wild = recording().observations.landmark % 2 == 0
    pixel[wild] += 100.0
    wrong = plain_problem(with_pixels(recording(), pixel))
    table = compare.reprojection(wrong.sequence, replace(estimate, used=~wild))
    assert compare.whitened_summary(wrong, table)["ratio"] == pytest.approx(1.0, abs=0.1)
    nothing = compare.reprojection(wrong.sequence, replace(estimate, used=np.zeros_like(wild)))
    assert compare.whitened_summary(wrong, nothing)["tracks"] == SCENE.n_points  # all of the problem's, then
    assert compare.whitened_summary(wrong, nothing)["ratio"] > 100.0
    empty = compare.whitened_summary(replace(wrong, excluded=np.ones_like(wrong.excluded)), nothing)
    assert empty["tracks"] == 0
    assert np.isnan([empty[key] for key in ("ratio", "beyond_95", "spread_uL", "spread_uR", "spread_v")]).all()


def test_classes_hold_every_observation_once_and_show_where_a_bias_is() -> None:
    sequence = recording()
    o = sequence.observations
    pixel = o.pixel.copy()
    right_third = pixel[:, 0] > pixel[:, 0].min() + 2.0 / 3.0 * np.ptp(pixel[:, 0])
    pixel[right_third, 1] += 2.0
    pixel[right_third, 3] += 2.0
    problem = plain_problem(with_pixels(sequence, pixel))
    clean = true_answer(plain_problem(sequence))
    table = compare.reprojection(problem.sequence, clean)
    patterns = compare.residual_patterns(problem.sequence, table)
    for _, classes in patterns.groupby("by"):
        assert classes["n"].sum() in (len(o), 2 * len(o))
    by_region = patterns[patterns["by"] == "region"].set_index("of")["v"]
    assert by_region.filter(like="right").mean() == pytest.approx(2.0, abs=0.2)
    assert by_region.drop(by_region.filter(like="right").index).abs().max() < 0.3
    ages = patterns[patterns["by"] == "track age"].set_index("of")["n"]
    assert ages.to_dict() == {
        name: n * SCENE.n_points for name, n in {"1": 1, "2 to 3": 2, "4 to 6": 3, "7 to 12": 6, "13 to 25": 4}.items()
    }
    sides = patterns[patterns["by"] == "side"].set_index("of")
    assert sides.loc["left camera", "median"] == pytest.approx(sides.loc["right camera", "median"], rel=0.2)


def test_maps_are_matched_by_landmark_and_measured_in_metres_and_sigmas() -> None:
    problem = plain_problem(recording())
    reference = true_answer(problem)
    index, position = reference.landmarks.index, reference.landmarks.position
    P_ref, P = np.tile(0.01 * np.eye(3), (len(index), 1, 1)), np.tile(0.05 * np.eye(3), (len(index), 1, 1))
    P[5] = 0.005 * np.eye(3)  # surer than the reference: no covariance of a difference
    reference = replace(reference, landmarks=Landmarks(index, position, P_ref))
    mine = replace(reference, landmarks=Landmarks(index[3:], position[3:] + np.array([0.3, 0.0, 0.4]), P[3:]))
    table = compare.map_difference(problem.sequence, mine, reference)
    assert table["landmark"].tolist() == index[3:].tolist()
    np.testing.assert_allclose(table["distance"], 0.5)
    np.testing.assert_allclose(table["seen"], 0.5)
    np.testing.assert_allclose(table["sigmas"].drop(2), 0.5 / np.sqrt(0.04))
    assert np.isnan(table["sigmas"][2])
    assert table["left_out"].tolist() == [i == 2 for i in range(len(table))]
    by_depth = compare.map_by_depth(table)
    assert by_depth["n"].sum() == len(table)
    assert by_depth["with_sigmas"].sum() == len(table) - 1
    np.testing.assert_allclose(by_depth.loc[by_depth["n"] > 0, "distance"], 0.5)


def test_a_world_that_is_turned_as_a_whole_looks_the_same_from_the_camera() -> None:
    problem = plain_problem(recording())
    reference = true_answer(problem)
    T = se3.exp([3.0, 0.0, 0.0, 0.0, 0.0, 0.2])
    moved = Landmarks(reference.landmarks.index, se3.transform(T, reference.landmarks.position))
    table = compare.map_difference(
        problem.sequence, replace(reference, world_T_imu=T @ reference.world_T_imu, landmarks=moved), reference
    )
    assert table["distance"].min() > 1.0
    np.testing.assert_allclose(table["seen"], 0.0, atol=1e-9)
    assert table["sigmas"].isna().all()


@given(st.lists(st.floats(0.0, 1e6), min_size=1, max_size=40), st.integers(0, 3))
def test_a_class_with_infinite_errors_has_a_quantile_and_no_nan(finite: list[float], infinite: int) -> None:
    errors = pd.Series([*finite, *[np.inf] * infinite])
    rank = 0.95 * (len(errors) - 1)
    expected = np.inf if math.ceil(rank) >= len(finite) else np.quantile(finite + [1e9] * infinite, 0.95)
    assert _p95(errors.groupby(np.zeros(len(errors)))).to_list() == [pytest.approx(expected)]
