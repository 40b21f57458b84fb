"""Residuals in classes, against chi-square, and of points that moved; maps matched by landmark: known answers."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from fgbaseline import compare, data
from fgbaseline.compare.landmarks.map_difference import MIN_WITH_SIGMAS
from fgbaseline.compare.residuals.residual_classes import _p95
from fgbaseline.compare.residuals.whitening import whitened_rows
from fgbaseline.data import Estimate, LandmarkPrior, Landmarks, Problem, Sequence
from fgbaseline.data.triangulate_landmarks import landmarks_along
from fgbaseline.geometry import FloatArray, se3

from ..builders.synthetic import Scene, plain_problem, with_pixels

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
    table = compare.dynamic_landmarks(problem, estimate, compare.reprojection(problem.sequence, estimate))
    assert table.loc[table["moved"], "landmark"].tolist() == [which]
    assert table.loc[table["moved"], "speed"].item() == pytest.approx(speed, rel=0.1)
    assert len(table) == SCENE.n_points


def test_static_points_are_not_classified_as_dynamic() -> None:
    problem = plain_problem(recording())
    estimate = true_answer(problem)
    table = compare.dynamic_landmarks(problem, estimate, compare.reprojection(problem.sequence, estimate))
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
    table = compare.dynamic_landmarks(problem, estimate, compare.reprojection(problem.sequence, estimate))
    assert not table["moved"].any()


def test_residuals_of_the_true_path_follow_chi_square_and_others_do_not() -> None:
    assumed = {sigma: plain_problem(recording(), pixel_sigma=sigma) for sigma in (0.5, 0.25)}
    summary = {}
    for sigma, problem in assumed.items():
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


def test_unused_observations_do_not_count_in_the_whitened_residuals() -> None:
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
    by_region = patterns[patterns["by"] == "image region"].set_index("of")["v"]
    assert by_region.filter(like="right").mean() == pytest.approx(2.0, abs=0.2)
    assert by_region.drop(by_region.filter(like="right").index).abs().max() < 0.3
    ages = patterns[patterns["by"] == "track age"].set_index("of")["n"]
    assert ages.to_dict() == {
        name: n * SCENE.n_points for name, n in {"1": 1, "2 to 3": 2, "4 to 6": 3, "7 to 12": 6, "13 to 25": 4}.items()
    }
    sides = patterns[patterns["by"] == "camera"].set_index("of")
    assert sides.loc["left camera", "median"] == pytest.approx(sides.loc["right camera", "median"], rel=0.2)


def test_maps_are_matched_by_landmark_and_measured_in_meters_and_sigmas() -> None:
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


def test_a_rotated_world_has_the_same_projections() -> None:
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


def test_a_class_of_depth_begins_with_its_lower_edge() -> None:
    table = pd.DataFrame(
        {
            "depth": [0.0, 4.9, 5.0, 80.0, 1e6, -1.0, np.nan],
            "distance": [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0],
            "seen": [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0],
            "sigmas": [1.0, np.nan, np.nan, 3.0, 5.0, 7.0, 9.0],
        }
    )
    found = compare.map_by_depth(table)
    assert found.index.tolist() == ["0 to 5 m", "5 to 10 m", "10 to 20 m", "20 to 40 m", "40 to 80 m", "80 m and more"]
    assert found.index.name == "depth"
    assert found.columns.tolist() == ["n", "distance", "seen", "sigmas", "with_sigmas"]
    assert found["n"].tolist() == [2, 1, 0, 0, 0, 2]
    assert found["distance"].tolist() == pytest.approx([2.0, 5.0, np.nan, np.nan, np.nan, 8.0], nan_ok=True)
    assert found["seen"].tolist() == pytest.approx([3.0, 6.0, np.nan, np.nan, np.nan, 9.0], nan_ok=True)
    assert found["sigmas"].isna().all()
    assert found["with_sigmas"].tolist() == [1, 0, 0, 0, 0, 2]
    many = compare.map_by_depth(pd.concat([table] * MIN_WITH_SIGMAS))
    assert many["sigmas"].tolist() == pytest.approx([1.0, np.nan, np.nan, np.nan, np.nan, 4.0], nan_ok=True)


def test_the_bias_of_a_class_is_that_of_its_bulk() -> None:
    """One residual in twenty of a thousand pixels, as of a landmark behind the camera."""
    wild = np.where(np.random.default_rng(0).random(len(recording().observations)) < 0.05, 1000.0, 0.0)
    found = compare.residual_patterns(recording(), plain_table(uL=0.5 + wild, vL=0.25, uR=0.5, vR=0.25 - wild))
    by_age = found.loc[found["by"] == "track age", ["u", "v"]]
    np.testing.assert_allclose(by_age, np.tile([0.5, 0.25], (len(by_age), 1)), atol=1e-9)


def plain_table(**columns: object) -> pd.DataFrame:
    """The reprojection table of the recording with these columns instead."""
    problem = plain_problem(recording())
    return compare.reprojection(problem.sequence, true_answer(problem)).assign(**columns)


def test_residual_patterns_of_a_known_case() -> None:
    depth = np.resize([0.0, 5.0, 79.9, 80.0, -1.0, np.nan], len(recording().observations))
    table = plain_table(uL=3.0, vL=4.0, uR=6.0, vR=8.0, error=7.0, depth=depth)
    found = compare.residual_patterns(recording(), table)
    assert found.columns.tolist() == ["by", "of", "n", "median", "mean", "p95", "u", "v"]
    assert found.index.tolist() == list(range(len(found)))
    assert found["by"].drop_duplicates().tolist() == ["distance", "track age", "image region", "camera"]
    each = len(table) // 6
    by_depth = found[found["by"] == "distance"]
    assert list(zip(by_depth["of"], by_depth["n"], strict=True)) == [
        (name, each) for name in ("0 to 5 m", "5 to 10 m", "40 to 80 m", "80 m and more")
    ]
    both = found[found["by"] != "camera"][["median", "mean", "p95", "u", "v"]].to_numpy()
    np.testing.assert_allclose(both, np.tile([7.0, 7.0, 7.0, 4.5, 6.0], (len(both), 1)))
    sides = found[found["by"] == "camera"]
    assert sides["of"].tolist() == ["left camera", "right camera"]
    np.testing.assert_allclose(sides[["median", "mean", "p95", "u", "v"]], [[5, 5, 5, 3, 4], [10, 10, 10, 6, 8]])
    assert sides["n"].tolist() == [len(table)] * 2


def test_the_outermost_observations_are_in_the_outermost_regions() -> None:
    pixel, table = recording().observations.pixel, plain_table()
    for column, (lowest, highest) in enumerate((("left", "right"), ("top", "bottom"))):
        for row, name in ((np.argmin(pixel[:, column]), lowest), (np.argmax(pixel[:, column]), highest)):
            found = compare.residual_patterns(recording(), table.iloc[[row]])
            assert name in found.loc[found["by"] == "image region", "of"].item().split()
    nothing = compare.residual_patterns(replace(recording(), observations=data.Observations.none()), table.iloc[:0])
    assert len(nothing) == 0


def test_tracks_of_any_age_have_a_class() -> None:
    problem = plain_problem(Scene(frames=28, n_points=3).sequence())
    found = compare.residual_patterns(problem.sequence, compare.reprojection(problem.sequence, true_answer(problem)))
    ages = found[found["by"] == "track age"]
    assert dict(zip(ages["of"], ages["n"], strict=True)) == {
        "1": 3, "2 to 3": 6, "4 to 6": 9, "7 to 12": 18, "13 to 25": 39, "26 and more": 9
    }  # fmt: skip


def test_whitened_rows_are_in_sigmas_and_the_mean_of_both_heights_has_less_noise() -> None:
    problem = plain_problem(recording(), pixel_sigma=0.5)
    table = plain_table(uL=1.0, vL=2.0, uR=-3.0, vR=4.0)
    np.testing.assert_allclose(whitened_rows(problem, table)[0], [2.0, -6.0, 6.0 * np.sqrt(2.0)])
    summary = compare.whitened_summary(problem, table)
    spreads = [summary[f"spread_{row}"] for row in ("uL", "uR", "v")]
    np.testing.assert_allclose(spreads, [2.0, 6.0, 6.0 * np.sqrt(2.0)])
    assert summary["ratio"] == pytest.approx(112.0 * SCENE.frames / (3 * SCENE.frames - 3))
    assert summary["beyond_95"] == 1.0
    assert summary["tracks"] == SCENE.n_points


def test_a_track_is_tested_by_chi_square_unless_it_has_one_observation() -> None:
    table = plain_table(uL=0.5, vL=0.0, uR=0.0, vR=0.0)
    kept = table[(table["landmark"] > 0) | (table["frame"] == 0)]  # landmark 0 is seen once
    found = compare.track_chi_square(plain_problem(recording()), kept)
    assert found.index.name == "landmark"
    assert found.columns.tolist() == ["n", "squared", "degrees", "probability"]
    assert found.index.tolist() == list(range(1, SCENE.n_points))
    assert found["n"].tolist() == [SCENE.frames] * (SCENE.n_points - 1)
    np.testing.assert_allclose(found["squared"], SCENE.frames)
    np.testing.assert_allclose(found["probability"], chi2.sf(SCENE.frames, 3 * SCENE.frames - 3))


@pytest.mark.parametrize("reached", [16, 9])
def test_maps_are_compared_at_the_observation_nearest_to_the_camera(reached: int) -> None:
    """Driving towards all points, that is the last one for which there are both poses."""
    problem = plain_problem(recording())
    reference = true_answer(problem)
    poses = reference.world_T_imu.copy()
    poses[reached:] = np.nan
    table = compare.map_difference(problem.sequence, replace(reference, world_T_imu=poses), reference)
    camera = reference.world_T_imu[reached - 1] @ recording().imu_T_cam
    depth = se3.transform(se3.inverse(camera), reference.landmarks.position)[:, 2]
    np.testing.assert_allclose(table["depth"], depth)
    assert table.columns.tolist() == ["landmark", "distance", "seen", "depth", "sigmas", "left_out"]


def test_landmarks_without_a_counterpart_are_excluded_from_the_map_difference() -> None:
    problem = plain_problem(recording())
    reference = true_answer(problem)
    position = reference.landmarks.position.copy()
    position[4] = np.nan
    mine = replace(reference, landmarks=Landmarks(reference.landmarks.index, position))
    its = replace(reference, landmarks=Landmarks(reference.landmarks.index[1:], reference.landmarks.position[1:]))
    for pair in ((mine, its), (its, mine)):
        found = compare.map_difference(problem.sequence, *pair)["landmark"].tolist()
        assert found == [j for j in range(SCENE.n_points) if j not in (0, 4)]


def test_four_observations_can_show_a_moving_landmark_and_three_cannot() -> None:
    problem = plain_problem(recording())
    estimate = true_answer(problem)
    table = compare.reprojection(problem.sequence, estimate)
    few = table[(table["landmark"] > 1) | (table["frame"] < 4 - table["landmark"])]  # 4 sights of 0 and 3 of 1
    found = compare.dynamic_landmarks(problem, estimate, few)
    assert found.columns.tolist() == ["landmark", "n", "squared", "gain", "speed", "moved"]
    assert found["landmark"].tolist() == [0, *range(2, SCENE.n_points)]
    assert found["n"].tolist() == [4, *[SCENE.frames] * (SCENE.n_points - 2)]
    behind = compare.dynamic_landmarks(
        problem, estimate, table.assign(depth=np.where(table["landmark"] == 5, 0.0, 1.0))
    )
    assert 5 not in behind["landmark"].tolist()
    assert len(behind) == SCENE.n_points - 1
