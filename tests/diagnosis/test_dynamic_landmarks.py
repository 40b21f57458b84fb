"""Moving and undetermined points take no part in the problem."""

import numpy as np

from fgbaseline.data import Excluded
from fgbaseline.data.simulate import Simulation, simulate_with_labels
from fgbaseline.diagnosis import calibrated, diagnose
from fgbaseline.diagnosis.repairs.landmark_mask import PIECE, _pieces, exclude_landmarks
from fgbaseline.geometry import se3

from ..builders.synthetic import Scene, drive


def test_dynamic_landmarks_are_masked_and_static_ones_are_kept() -> None:
    settings = Simulation(duration=20.0, seed=4, wrong_share=0.0, moving_share=0.08)
    sequence, labels = simulate_with_labels(settings)
    problem = calibrated(sequence, diagnosis=diagnose(sequence))
    original, kept = sequence.observations, problem.sequence.observations
    place = {(int(k), p.tobytes()): i for i, (k, p) in enumerate(zip(original.frame, original.pixel, strict=True))}
    moves = labels.moving[[place[int(k), p.tobytes()] for k, p in zip(kept.frame, kept.pixel, strict=True)]]
    out = problem.excluded != Excluded.NO
    assert moves.sum() > 500
    assert (problem.excluded == Excluded.MOVING).sum() > 20
    assert np.mean(moves[problem.excluded == Excluded.MOVING]) > 0.8
    assert np.mean(out[moves]) > 0.55  # the others move by less than the tracks scatter
    assert np.mean(out[~moves]) < 0.06


def test_in_a_static_scene_no_landmark_is_dynamic() -> None:
    sequence = drive(seconds=10.0, features_per_frame=60.0)
    excluded = calibrated(sequence, diagnosis=diagnose(sequence)).excluded
    assert np.mean(excluded == Excluded.MOVING) < 0.002


def test_points_behind_or_without_a_distance_are_undetermined() -> None:
    scene = Scene()
    sequence = scene.sequence()
    assert sequence.truth is not None
    excluded = np.zeros(len(sequence.observations), dtype=np.uint8)
    path = sequence.truth.world_T_imu
    np.testing.assert_array_equal(exclude_landmarks(sequence, path, excluded, 0.5), excluded)
    vague = exclude_landmarks(sequence, path, excluded, 500.0)
    assert (vague == Excluded.GEOMETRY).all()
    turned = path.copy()
    turned[5:] = turned[5:] @ se3.exp(np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.pi]))
    assert (exclude_landmarks(sequence, turned, excluded, 0.5) != Excluded.NO).all()


def test_masked_observations_keep_their_reason() -> None:
    sequence = Scene().sequence()
    assert sequence.truth is not None
    excluded = np.full(len(sequence.observations), Excluded.COPIED, dtype=np.uint8)
    np.testing.assert_array_equal(exclude_landmarks(sequence, sequence.truth.world_T_imu, excluded, 500.0), excluded)


def test_pieces_are_runs_of_eight_to_fifteen() -> None:
    random = np.random.default_rng(0)
    lengths = random.integers(1, 60, 40)
    row, frame = np.repeat(np.arange(40), lengths), np.concatenate([np.arange(n) for n in lengths])
    shuffled = random.permutation(len(row))
    piece, n_pieces = _pieces(row[shuffled], frame[shuffled])
    size = np.bincount(piece, minlength=n_pieces)
    assert size.sum() == len(row)
    assert size.max() < 2 * PIECE
    assert (size[np.unique(piece[lengths[row[shuffled]] >= PIECE])] >= PIECE).all()
    for p in range(n_pieces):
        inside = np.sort(frame[shuffled][piece == p])
        assert (np.diff(inside) == 1).all()
        assert len(np.unique(row[shuffled][piece == p])) == 1
