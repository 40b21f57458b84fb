"""Held-out tracks rank a wrong path below the true one, and report a tie where the data do not decide."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest

from fgbaseline import compare, data, diagnosis
from fgbaseline.compare.residuals.held_out_tracks import HeldOutErrors, cross_prediction_errors
from fgbaseline.data import HeldOut, Sequence
from fgbaseline.geometry import FgbaselineError, FloatArray, se3

from ..builders.synthetic import drive, with_pixels


@cache
def held() -> tuple[Sequence, HeldOut]:
    return diagnosis.hold_out(drive(seconds=12.0, features_per_frame=30.0), 0.4, seed=1)


def true_path() -> FloatArray:
    sequence, _ = held()
    assert sequence.truth is not None
    return sequence.truth.world_T_imu


def bent(rate: float, noise: float = 0.0) -> FloatArray:
    """The true path with a heading that drifts by `rate` rad/s, and steps that are wrong by `noise` m."""
    steps = se3.relative(true_path())
    random = np.random.default_rng(0)
    wrong = np.zeros((len(steps), 6))
    wrong[:, :3] = noise * random.normal(size=(len(steps), 3))
    wrong[:, 5] = rate * np.diff(held()[0].t)
    return se3.compose(steps @ se3.exp(wrong))


def ranking(**paths: FloatArray) -> "compare.HeldOutErrors":
    sequence, out = held()
    return compare.held_out_errors(sequence, out, paths, 0.25)


def test_worse_paths_rank_lower_and_the_true_one_first() -> None:
    errors = ranking(worse=bent(0.05), true=true_path(), bad=bent(0.02), jumpy=bent(0.0, 0.05))
    table = compare.held_out_ranking(errors)
    assert table.index[0] == "true"
    assert list(table.index).index("bad") < list(table.index).index("worse")
    assert table["behind"].is_monotonic_increasing
    assert (table["behind_low"].drop("true") > 0.0).all()
    assert table.loc["true", "behind"] == table.loc["true", "behind_low"] == table.loc["true", "behind_high"] == 0.0
    assert (table["low"] <= table["median"]).all()
    assert (table["median"] <= table["high"]).all()
    # 0.5 px in four rows, and what predicting from the other half adds to that
    assert 0.9 < table.loc["true", "median"] < 1.5


def test_held_out_ranking_is_invariant_to_a_rigid_motion_of_the_world() -> None:
    """Drift over longer times than a track lasts, and any motion of the world, are out of sight."""
    moved = se3.exp([100.0, 20.0, 5.0, 0.1, 0.2, 1.0]) @ true_path()
    table = compare.held_out_ranking(ranking(true=true_path(), moved=moved))
    np.testing.assert_allclose(table.loc["true"], table.loc["moved"], rtol=1e-4, atol=1e-4)


def test_all_paths_have_one_mask_and_a_track_inconsistent_with_all_of_them_is_excluded() -> None:
    sequence, out = held()
    o = out.observations
    long_pieces = np.flatnonzero(np.bincount(out.piece[out.piece >= 0]) >= 12)
    bad = np.flatnonzero(out.piece == long_pieces[0])
    pixel = o.pixel.copy()
    pixel[bad] += 40.0 * np.random.default_rng(1).normal(size=(len(bad), 4))
    spoiled = HeldOut(data.Observations(o.frame, o.landmark, pixel), out.piece, out.n_pieces, out.share, out.seed)
    errors = compare.held_out_errors(sequence, spoiled, {"true": true_path(), "bent": bent(0.05)}, 0.25)
    assert long_pieces[0] not in errors.table["piece"].to_numpy()
    assert errors.inliers == errors.pieces - 1
    assert len(errors.error) == len(errors.table)
    assert errors.gate == pytest.approx(np.clip(errors.gate, 3.0, 12.0))
    # what one path explains stays in, however bad the others are
    alone = compare.held_out_errors(sequence, spoiled, {"true": true_path()}, 0.25)
    np.testing.assert_array_equal(alone.table["piece"], errors.table["piece"])


def test_the_gate_is_six_times_what_a_piece_errs_by_as_a_rule() -> None:
    errors = ranking(true=true_path(), bent=bent(0.01))
    assert errors.inliers == errors.pieces > 50
    squares = (errors.error**2).groupby(errors.table["piece"].to_numpy()).mean()
    assert errors.gate == pytest.approx(6.0 * np.median(np.sqrt(squares.min(axis=1))), rel=1e-12)
    assert 3.0 < errors.gate < 12.0


def test_the_order_of_the_paths_changes_nothing_but_ties() -> None:
    one = compare.held_out_ranking(ranking(a=true_path(), b=bent(0.02)))
    other = compare.held_out_ranking(ranking(b=bent(0.02), a=true_path()))
    np.testing.assert_array_equal(one, other.loc[one.index])


def test_only_frames_that_every_path_has_count() -> None:
    short = true_path().copy()
    short[60:] = np.nan
    errors = ranking(short=short, true=true_path())
    assert errors.table["frame"].max() < 60
    np.testing.assert_allclose(errors.error["short"], errors.error["true"])


def test_without_observations_the_ranking_is_empty_and_without_paths_there_is_none() -> None:
    sequence, out = held()
    nothing = HeldOut(out.observations, np.full_like(out.piece, -1), 0, 0.2, 0)
    errors = compare.held_out_errors(sequence, nothing, {"true": true_path()}, 0.25)
    assert errors.pieces == errors.inliers == 0
    assert compare.held_out_ranking(errors).empty
    with pytest.raises(FgbaselineError, match="no trajectory to evaluate"):
        compare.held_out_errors(sequence, out, {}, 0.25)


def test_a_point_behind_the_camera_counts_as_infinitely_wrong_and_stays_a_number_in_the_ranking() -> None:
    backwards = true_path().copy()
    backwards[::2] = backwards[::2] @ se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.pi - 0.1])
    table = compare.held_out_ranking(ranking(true=true_path(), backwards=backwards))
    assert table.loc["backwards", "median"] > 100.0
    assert table.loc["true", "median"] < 1.5
    assert not table.isna().any().any()


def test_other_pixels_of_the_held_out_tracks_cannot_change_which_are_held_out() -> None:
    sequence = drive(seconds=12.0, features_per_frame=30.0)
    other = diagnosis.hold_out(with_pixels(sequence, sequence.observations.pixel + 1.0), 0.4, seed=1)[1]
    np.testing.assert_array_equal(other.observations.landmark, held()[1].observations.landmark)


@pytest.mark.parametrize(
    ("sights", "spoiled", "touched"),
    [(4, 1, [1, 2, 3]), (4, 2, [0, 1, 2]), (5, 2, [2, 3, 4]), (5, 3, [0, 1, 2, 3]), (2, 0, [0, 1])],
)
def test_a_corrupted_observation_raises_its_own_error_and_that_of_the_half_predicted_from_it(
    sights: int, spoiled: int, touched: list[int]
) -> None:
    """The middle sight of an odd number belongs to the first half."""
    sequence, out = held()
    piece = int(np.argmax(np.bincount(out.piece[out.piece >= 0])))
    chosen = np.flatnonzero(out.piece == piece)[:sights]
    o = out.observations
    pixel = o.pixel.copy()
    pixel[chosen[spoiled]] += [3.0, 1.0, -1.0, 2.0]
    other = replace(out, observations=data.Observations(o.frame, o.landmark, pixel))
    before, after = (cross_prediction_errors(sequence, each, chosen, true_path(), 0.25) for each in (out, other))
    assert np.flatnonzero(before != after).tolist() == touched


def test_the_errors_come_with_where_they_are() -> None:
    errors = ranking(true=true_path(), bent=bent(0.01))
    sequence, out = held()
    assert errors.table.columns.tolist() == ["piece", "landmark", "frame", "start"]
    assert errors.error.columns.tolist() == ["true", "bent"]
    assert errors.table.index.tolist() == errors.error.index.tolist() == list(range(len(errors.error)))
    of_piece = out.piece >= 0
    rows = sorted(
        zip(out.piece[of_piece], out.observations.frame[of_piece], out.observations.landmark[of_piece], strict=True)
    )
    assert list(zip(*(errors.table[c] for c in ("piece", "frame", "landmark")), strict=True)) == rows  # all are inliers
    first = errors.table.groupby("piece")["frame"].transform("min")
    np.testing.assert_array_equal(errors.table["start"], sequence.t[first] - sequence.t[0])


def test_the_ranking_of_a_known_case() -> None:
    values = pd.DataFrame({"a": [1.0, 2.0, 3.0, 4.0], "b": [2.0, 2.0, 2.0, 2.0]})

    def ranked(start: list[float]) -> pd.DataFrame:
        table = pd.DataFrame({"piece": 0, "landmark": 0, "frame": 0, "start": start})
        return compare.held_out_ranking(HeldOutErrors(table, values, 3.0, 1, 1))

    table = ranked([0.0, 1.0, 2.0, 4.9])  # one block of five seconds: every draw is the same
    assert table.index.name == "estimator"
    assert table.to_dict("index") == {
        "b": {"median": 2.0, "low": 2.0, "high": 2.0, "behind": 0.0, "behind_low": 0.0, "behind_high": 0.0,
              "p95": 2.0, "under_3px": 1.0},
        "a": {"median": 2.5, "low": 2.5, "high": 2.5, "behind": 0.5, "behind_low": 0.5, "behind_high": 0.5,
              "p95": 4.0, "under_3px": 0.5},
    }  # fmt: skip
    two = ranked([0.0, 1.0, 4.9, 5.0])  # and two, the second one of the last value
    assert two.loc["a", ["low", "high", "behind_low", "behind_high"]].tolist() == [2.0, 4.0, 0.0, 2.0]
    empty = compare.held_out_ranking(HeldOutErrors(table.iloc[:0], values.iloc[:0], 3.0, 0, 0))
    assert empty.columns.tolist() == table.columns.tolist()
    assert empty.index.name == "estimator"


def test_without_predictable_segments_the_gate_is_the_smallest() -> None:
    backwards = true_path() @ se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    backwards[1::2] = backwards[1::2] @ se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.pi])
    errors = ranking(backwards=backwards)
    assert errors.gate == 3.0
    assert errors.pieces > 50


def test_the_ranking_is_the_same_every_time_and_its_intervals_hold_the_median() -> None:
    errors = ranking(true=true_path(), jumpy=bent(0.0, 0.02))
    table = compare.held_out_ranking(errors)
    assert table.equals(compare.held_out_ranking(errors))
    np.testing.assert_allclose(table["median"], errors.error.median()[table.index])
    np.testing.assert_allclose(table["under_3px"], (errors.error < 3.0).mean()[table.index])
    np.testing.assert_allclose(table["behind"], table["median"] - table["median"].iloc[0])
    assert (table["low"] < table["high"]).all()
    assert table.loc["jumpy", "behind_low"] < table.loc["jumpy", "behind"] < table.loc["jumpy", "behind_high"]
