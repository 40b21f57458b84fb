"""Reprojection tables are measured minus predicted, row by row, and their summaries plain statistics."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from fgbaseline import compare, ekf
from fgbaseline.data import Estimate, Landmarks, Sequence, Status
from fgbaseline.geometry import se3

from ..builders.synthetic import Scene, drive, matched, with_pixels

EXACT = Scene(sigma_pixel=0.0).sequence()


def true_answer(sequence: Sequence) -> Estimate:
    truth = sequence.truth
    assert truth is not None
    assert truth.landmarks is not None
    return Estimate(
        name="truth",
        world_T_imu=truth.world_T_imu,
        used=np.ones(len(sequence.observations), dtype=np.bool_),
        landmarks=Landmarks(np.arange(sequence.n_landmarks), truth.landmarks),
    )


def test_the_truth_explains_every_exact_pixel() -> None:
    table = compare.reprojection(EXACT, true_answer(EXACT))
    assert len(table) == len(EXACT.observations)
    np.testing.assert_allclose(table[["uL", "vL", "uR", "vR", "error"]], 0.0, atol=1e-9)
    assert (table["depth"] > 0).all()
    assert table["used"].all()


@pytest.mark.parametrize("row", range(4))
def test_one_moved_pixel_is_one_residual_of_that_size_and_sign(row: int) -> None:
    pixel = EXACT.observations.pixel.copy()
    pixel[17, row] += 2.5
    table = compare.reprojection(with_pixels(EXACT, pixel), true_answer(EXACT))
    expected = np.zeros((len(pixel), 4))
    expected[17, row] = 2.5
    np.testing.assert_allclose(table[["uL", "vL", "uR", "vR"]], expected, atol=1e-9)
    np.testing.assert_allclose(table["error"], expected.sum(axis=1), atol=1e-9)
    summary = compare.reprojection_summary(table)
    assert summary["max"] == pytest.approx(2.5)
    assert summary["under_3px"] == 1.0
    assert summary["n"] == 120
    components = compare.component_summary(table)
    assert all(abs(c["bias"]) < 1e-9 and c["spread"] < 1e-9 for c in components.values())


@pytest.mark.parametrize("outliers", [0.0, 0.02])
def test_bias_and_spread_are_those_of_the_bulk_whatever_the_outliers(outliers: float) -> None:
    rng = np.random.default_rng(0)
    residual = rng.normal(0.3, 0.7, size=(20_000, 4))
    residual[: round(outliers * len(residual))] = 76_945.0
    found = compare.component_summary(pd.DataFrame(residual, columns=["uL", "vL", "uR", "vR"]))
    for of in found.values():
        assert of["bias"] == pytest.approx(0.3, abs=0.05)
        assert of["spread"] == pytest.approx(0.7, rel=0.05)


def test_the_error_is_the_norm_of_all_four_differences() -> None:
    pixel = EXACT.observations.pixel + np.array([1.0, -2.0, 4.0, 2.0])
    table = compare.reprojection(with_pixels(EXACT, pixel), true_answer(EXACT))
    np.testing.assert_allclose(table["error"], 5.0)
    assert compare.reprojection_summary(table)["under_3px"] == 0.0
    biases = [c["bias"] for c in compare.component_summary(table).values()]
    np.testing.assert_allclose(biases, [1.0, -2.0, 4.0, 2.0])


def test_only_landmarks_and_poses_the_estimate_has_are_in_the_table() -> None:
    answer = true_answer(EXACT)
    kept = np.array([1, 4, 5])
    poses = answer.world_T_imu.copy()
    poses[7:] = np.nan
    partial = replace(answer, world_T_imu=poses, landmarks=Landmarks(kept, answer.landmarks.position[kept]))
    table = compare.reprojection(EXACT, partial)
    o = EXACT.observations
    np.testing.assert_array_equal(table["observation"], np.flatnonzero(np.isin(o.landmark, kept) & (o.frame < 7)))
    np.testing.assert_array_equal(table["frame"], o.frame[table["observation"]])
    np.testing.assert_array_equal(table["landmark"], o.landmark[table["observation"]])


def test_points_behind_the_camera_are_projected_by_the_formula_and_counted() -> None:
    answer = true_answer(EXACT)
    behind = answer.landmarks.position.copy()
    camera = answer.world_T_imu[0] @ EXACT.imu_T_cam
    behind[3] = se3.transform(camera, [0.0, 0.0, -200.0])
    table = compare.reprojection(EXACT, replace(answer, landmarks=Landmarks(np.arange(EXACT.n_landmarks), behind)))
    summary = compare.reprojection_summary(table)
    assert summary["behind_camera"] == 10
    assert (table.loc[table["landmark"] == 3, "depth"] < 0).all()
    assert np.isfinite(table["error"]).all()
    assert compare.reprojection_by(table, "landmark").loc[3, "behind_camera"] == 10
    assert (compare.reprojection_by(table, "frame")["behind_camera"] == 1).all()


def test_used_observations_are_those_of_the_estimator() -> None:
    used = np.random.default_rng(1).random(len(EXACT.observations)) < 0.5
    table = compare.reprojection(EXACT, replace(true_answer(EXACT), used=used))
    np.testing.assert_array_equal(table["used"], used)


@pytest.mark.parametrize("what", ["frame", "landmark"])
def test_the_tables_by_frame_and_landmark_are_the_summaries_of_their_rows(what: str) -> None:
    sequence = drive(wrong=0.05)
    table = compare.reprojection(sequence, ekf.dead_reckoning(matched(sequence)))
    grouped = compare.reprojection_by(table, what)
    assert list(grouped.index) == sorted(set(table[what]))
    for key, row in grouped.iterrows():
        alone = compare.reprojection_summary(table[table[what] == key])
        for name in ("median", "mean", "rmse", "under_3px", "behind_camera", "n"):
            assert row[name] == pytest.approx(alone[name], rel=1e-12), (key, name)


def test_residuals_of_a_filter_are_those_of_a_loop_over_its_observations() -> None:
    sequence = drive()
    estimate = ekf.ekf(matched(sequence))
    table = compare.reprojection(sequence, estimate)
    where = {int(j): p for j, p in zip(estimate.landmarks.index, estimate.landmarks.position, strict=True)}
    o, rows = sequence.observations, []
    for frame, landmark, pixel in zip(o.frame, o.landmark, o.pixel, strict=True):
        if int(landmark) in where:
            cam_T_world = np.linalg.inv(estimate.world_T_imu[frame] @ sequence.imu_T_cam)
            x, y, z = (cam_T_world @ [*where[int(landmark)], 1.0])[:3]
            c = sequence.camera
            predicted = [c.fu * x / z + c.cu, c.fv * y / z + c.cv, c.fu * (x - c.baseline) / z + c.cu]
            rows.append(pixel - [*predicted, predicted[1]])
    np.testing.assert_allclose(table[["uL", "vL", "uR", "vR"]], rows, atol=1e-6)


def test_no_landmarks_make_an_empty_table_and_a_summary_without_numbers() -> None:
    table = compare.reprojection(EXACT, replace(true_answer(EXACT), landmarks=Landmarks.none()))
    summary = compare.reprojection_summary(table)
    assert len(table) == 0
    assert summary["n"] == summary["behind_camera"] == 0
    assert np.isnan(summary["median"])
    assert np.isnan(summary["under_3px"])
    assert all(np.isnan(c["bias"]) for c in compare.component_summary(table).values())
    assert len(compare.reprojection_by(table, "frame")) == 0


def test_a_landmark_at_the_camera_is_an_infinite_error_and_no_warning() -> None:
    answer = true_answer(EXACT)
    position = answer.landmarks.position.copy()
    position[0] = (answer.world_T_imu[2] @ EXACT.imu_T_cam)[:3, 3]
    table = compare.reprojection(EXACT, replace(answer, landmarks=Landmarks(np.arange(EXACT.n_landmarks), position)))
    summary = compare.reprojection_summary(table)
    compare.component_summary(table)
    assert (summary["n"], summary["missing"]) == (120, 0)
    assert summary["rmse"] == summary["mean"] == summary["max"] == np.inf
    assert np.isfinite(summary["median"])


def test_used_by_all_is_what_all_that_use_any_have_used() -> None:
    random = np.random.default_rng(3)
    n = len(EXACT.observations)
    a, b = random.random(n) < 0.7, random.random(n) < 0.7
    answer = true_answer(EXACT)
    none = replace(answer, used=np.zeros(n, dtype=np.bool_))
    common = compare.used_by_all([replace(answer, used=a), none, replace(answer, used=b)])
    assert common is not None
    np.testing.assert_array_equal(common, a & b)
    assert compare.used_by_all([none, none]) is None
    assert compare.used_by_all([]) is None


def test_a_point_in_the_camera_plane_counts_as_behind_and_three_pixels_as_far() -> None:
    table = pd.DataFrame({"error": [1.0, 3.0, 5.0], "depth": [1.0, 0.0, -1.0], "frame": [4, 4, 7]})
    summary = compare.reprojection_summary(table)
    assert (summary["behind_camera"], summary["n"]) == (2, 3)
    assert summary["under_3px"] == pytest.approx(1 / 3)
    by_frame = compare.reprojection_by(table, "frame")
    assert by_frame.index.name == "frame"
    assert by_frame.columns.tolist() == ["median", "mean", "rmse", "under_3px", "behind_camera", "n", "missing"]
    assert by_frame.loc[4].tolist() == pytest.approx([2.0, 2.0, 5**0.5, 0.5, 1, 2, 0])
    assert by_frame.loc[7].tolist() == pytest.approx([5.0, 5.0, 5.0, 0.0, 1, 1, 0])


def test_the_columns_of_the_table_are_named() -> None:
    table = compare.reprojection(EXACT, true_answer(EXACT))
    assert table.columns.tolist() == [
        "observation", "frame", "landmark", "uL", "vL", "uR", "vR", "error", "depth", "used"
    ]  # fmt: skip
    assert list(compare.component_summary(table)) == ["uL", "vL", "uR", "vR"]


def test_an_infinite_residual_has_an_infinite_spread_and_raises_no_warning() -> None:
    table = pd.DataFrame({"uL": [np.inf, 1.0], "vL": 1.0, "uR": [1.0, 3.0], "vR": [-np.inf, np.inf]})
    found = compare.component_summary(table)
    assert found["uL"]["bias"] == np.inf
    assert found["uL"]["spread"] == np.inf
    assert found["uR"] == {"bias": 2.0, "spread": 1.4826}


def test_a_failed_estimator_does_not_narrow_the_common_observations() -> None:
    answer = true_answer(EXACT)
    half = np.arange(len(EXACT.observations)) % 2 == 0
    failed = replace(answer, used=half, status=Status.FAILED, reason="it failed")
    common = compare.used_by_all([answer, failed])
    assert common is not None
    assert common.all()
    assert compare.used_by_all([failed]) is None
