"""Held-out tracks never reach diagnosis or estimators, and are cut where they stop being one point's."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import data, diagnosis
from fgbaseline.data import Estimate, Observations, Problem, Sequence
from fgbaseline.diagnosis.track_holdout import MIN_PIECE
from fgbaseline.ekf import dead_reckoning, ekf, joint_ekf
from fgbaseline.geometry import FloatArray, InputError
from fgbaseline.smoother import isam2

from ..builders.synthetic import drive, with_pixels


def recording() -> Sequence:
    return drive(seconds=8.0, features_per_frame=30.0, wrong=0.02)


def bits(problem: Problem, estimate: Estimate) -> list[FloatArray]:
    assert estimate.covariance is not None
    landmarks = estimate.landmarks
    return [
        problem.increment,
        problem.sequence.observations.pixel,
        problem.excluded,
        estimate.world_T_imu,
        estimate.covariance,
        landmarks.index,
        landmarks.position,
        estimate.used,
    ]


def test_other_pixels_in_held_out_tracks_change_no_bit_of_problem_or_estimates() -> None:
    """The diagnosis is part of it: the calibrated problem rests on what it finds."""
    sequence = recording()
    kept, held = diagnosis.hold_out(sequence, 0.3, seed=4)
    o = sequence.observations
    out = np.isin(o.landmark, held.observations.landmark)
    pixel = o.pixel.copy()
    pixel[out] += np.random.default_rng(0).normal(scale=50.0, size=(int(out.sum()), 4))
    kept_of_other, held_of_other = diagnosis.hold_out(with_pixels(sequence, pixel), 0.3, seed=4)
    np.testing.assert_array_equal(held.observations.landmark, held_of_other.observations.landmark)
    assert not np.array_equal(held.observations.pixel, held_of_other.observations.pixel)
    one, other = diagnosis.calibrated(kept), diagnosis.calibrated(kept_of_other)
    assert one.diagnosed
    assert one.remarks == other.remarks
    for solve in (dead_reckoning, ekf, joint_ekf, isam2):
        for a, b in zip(bits(one, solve(one)), bits(other, solve(other)), strict=True):
            np.testing.assert_array_equal(a, b)


def test_every_track_is_on_one_side_and_the_share_is_what_was_asked_for() -> None:
    sequence = recording()
    kept, held = diagnosis.hold_out(sequence, 0.25, seed=1)
    o = sequence.observations
    assert held.n_tracks == round(0.25 * len(np.unique(o.landmark)))
    assert not np.intersect1d(kept.observations.landmark, held.observations.landmark).size
    assert len(kept.observations) + len(held.observations) == len(o)
    assert kept.n_landmarks == sequence.n_landmarks
    again, other = diagnosis.hold_out(sequence, 0.25, seed=1)[1], diagnosis.hold_out(sequence, 0.25, seed=2)[1]
    np.testing.assert_array_equal(again.observations.landmark, held.observations.landmark)
    assert not np.array_equal(np.unique(other.observations.landmark), np.unique(held.observations.landmark))


def test_a_track_is_cut_where_it_jumps_and_where_its_frame_is_a_copy() -> None:
    sequence = drive(seconds=6.0, features_per_frame=40.0)
    o = sequence.observations
    _, held = diagnosis.hold_out(sequence, 0.5)
    counts = np.bincount(held.observations.landmark)
    long_tracks = np.flatnonzero(counts >= 16)
    jumping, copied = long_tracks[:2]
    pixel = o.pixel.copy()
    mine = np.flatnonzero(o.landmark == jumping)
    pixel[mine[8:]] += [30.0, 0.0, 30.0, 0.0]
    its = np.flatnonzero(o.landmark == copied)
    pixel[its[8]] = pixel[its[7]]
    _, cut = diagnosis.hold_out(with_pixels(sequence, pixel), 0.5)
    pieces = cut.piece[cut.observations.landmark == jumping]
    assert len(set(pieces[:8])) == 1
    assert len(set(pieces[8:])) == 1
    assert -1 not in pieces
    assert pieces[0] != pieces[8]
    assert cut.piece[cut.observations.landmark == copied][8] == -1
    assert cut.n_pieces == cut.piece.max() + 1
    assert np.bincount(cut.piece[cut.piece >= 0]).min() >= MIN_PIECE


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, float("nan")])
def test_no_other_share_is_taken(share: float) -> None:
    with pytest.raises(InputError, match="held-out: expected a share above 0 and below 1"):
        diagnosis.hold_out(recording(), share)


def test_a_recording_without_tracks_has_none_to_hold_out() -> None:
    with pytest.raises(InputError, match="the recording has 0 tracks"):
        diagnosis.hold_out(replace(recording(), observations=Observations.none()), 0.2)


def test_copied_frames_of_a_real_recording_are_in_no_piece(recordings: Callable[[str], Path]) -> None:
    sequence = data.read(recordings("03.npz"))
    _, held = diagnosis.hold_out(sequence, 0.2)
    o = held.observations
    order = np.lexsort((o.frame, held.piece))
    order = order[held.piece[order] >= 0]
    same = (held.piece[order][1:] == held.piece[order][:-1]) & (o.pixel[order][1:] == o.pixel[order][:-1]).all(axis=1)
    assert not same.any()
    assert np.mean(held.piece >= 0) > 0.5
