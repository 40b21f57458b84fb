"""The mask takes out wrong matches and nothing else, and knows of no estimator."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fgbaseline import data, diagnosis
from fgbaseline.data import Excluded, Observations, Sequence
from fgbaseline.data.simulate import Simulation, simulate_with_labels
from fgbaseline.data.velocity_increments import dead_reckoned_path, increments
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings, exclusions
from fgbaseline.geometry import FloatArray

from ..builders.synthetic import Scene, drive, with_pixels

FRAMES, TRACKS = 10, 12
SCENE = Scene(frames=FRAMES, n_points=TRACKS).sequence()
"""Observation 12 k + j is that of track j at frame k; the largest depth is about 35 m, a disparity of 11 px."""

WRONG = st.tuples(st.floats(20.0, 100.0), st.floats(0.0, 2.0 * np.pi)).map(
    lambda polar: polar[0] * np.array([np.cos(polar[1]), np.sin(polar[1]), np.cos(polar[1]), np.sin(polar[1])])
)
"""px, the same in both images"""


def mask(sequence: Sequence, settings: MaskSettings | None = None) -> FloatArray:
    """(n,) an Excluded for each observation."""
    path = dead_reckoned_path(increments(sequence))
    return exclusions(sequence, path, settings or MaskSettings())


def at(track: int, frames: int | list[int] | slice) -> FloatArray:
    """The indices of a track's observations at some frames."""
    return (TRACKS * np.arange(FRAMES) + track)[frames]


def shifted(where: FloatArray, by: FloatArray) -> Sequence:
    """The scene with some pixels moved."""
    pixel = SCENE.observations.pixel.copy()
    pixel[where] += by
    return with_pixels(SCENE, pixel)


def expected(where: FloatArray, why: Excluded) -> FloatArray:
    """The mask that takes out these and no others."""
    excluded = np.zeros(FRAMES * TRACKS, dtype=np.uint8)
    excluded[where] = why
    return excluded


@given(st.integers(0, 1000))
def test_clean_tracks_are_untouched(seed: int) -> None:
    np.testing.assert_array_equal(mask(Scene(seed=seed, sigma_pixel=0.3).sequence()), Excluded.NO)


@given(st.integers(0, TRACKS - 1), st.integers(1, FRAMES - 2), WRONG)
def test_one_wrong_match_inside_a_track_is_masked_alone(track: int, frame: int, by: FloatArray) -> None:
    where = at(track, frame)
    np.testing.assert_array_equal(mask(shifted(where, by)), expected(where, Excluded.PREDICTION))


@given(st.integers(0, TRACKS - 1), st.sampled_from([0, FRAMES - 1]), WRONG)
def test_a_wrong_match_at_the_end_of_a_track_is_masked_alone(track: int, frame: int, by: FloatArray) -> None:
    where = at(track, frame)
    np.testing.assert_array_equal(mask(shifted(where, by)), expected(where, Excluded.PREDICTION))


@given(st.integers(0, TRACKS - 1), st.integers(1, FRAMES - 1), st.integers(1, TRACKS - 1))
def test_a_track_that_jumps_onto_another_point_keeps_its_longer_half_and_of_equal_ones_the_first(
    track: int, jump: int, offset: int
) -> None:
    pixel = SCENE.observations.pixel.copy()
    other = pixel[at((track + offset) % TRACKS, slice(None))]
    assume(np.linalg.norm(pixel[at(track, jump)] - other[jump]) > 50.0)
    pixel[at(track, slice(jump, None))] = other[jump:]
    shorter = slice(0, jump) if jump < FRAMES - jump else slice(jump, None)
    np.testing.assert_array_equal(mask(with_pixels(SCENE, pixel)), expected(at(track, shorter), Excluded.PREDICTION))


def test_several_inconsistent_wrong_matches_are_masked_alone() -> None:
    where = at(3, [2, 4, 6])
    by = np.array([[40.0, 0.0, 40.0, 0.0], [-50.0, 20.0, -50.0, 20.0], [0.0, -60.0, 0.0, -60.0]])
    np.testing.assert_array_equal(mask(shifted(where, by)), expected(where, Excluded.PREDICTION))


def test_wrong_matches_that_alternate_with_right_ones_are_masked() -> None:
    # Right and wrong ones each agree among themselves: some right ones may go with them.
    excluded = mask(shifted(at(3, [2, 4, 6]), np.full(4, 40.0)))
    assert np.all(excluded[at(3, [2, 4, 6])] == Excluded.PREDICTION)
    assert np.all(excluded[at(3, [0, 1, 7, 8, 9])] == Excluded.NO)


@pytest.mark.parametrize("length", [1, 2, 3])
def test_a_track_of_two_is_too_short_to_check(length: int) -> None:
    o = SCENE.observations
    keep = (o.landmark != 5) | (o.frame < length)
    sequence = replace(SCENE, observations=o.select(keep))
    why = Excluded.NO if length >= 3 else Excluded.SHORT
    np.testing.assert_array_equal(mask(sequence)[sequence.observations.landmark == 5], why)
    np.testing.assert_array_equal(mask(sequence)[sequence.observations.landmark != 5], Excluded.NO)


def test_segments_between_jumps_that_are_too_short_are_masked() -> None:
    # Three runs of 2, 2 and 2: the first is the longest, and too short.
    o = SCENE.observations
    keep = (o.landmark != 5) | (o.frame < 6)
    pixel = o.pixel.copy()
    pixel[at(5, [2, 3])] += 40.0
    pixel[at(5, [4, 5])] -= 40.0
    changed = with_pixels(SCENE, pixel)
    sequence = replace(changed, observations=changed.observations.select(keep))
    of_track = mask(sequence)[sequence.observations.landmark == 5]
    np.testing.assert_array_equal(of_track, [Excluded.SHORT] * 2 + [Excluded.PREDICTION] * 4)


@given(st.integers(0, TRACKS - 1), st.integers(0, FRAMES - 1), st.floats(-30.0, 0.999))
def test_a_small_disparity_is_masked_and_its_neighbors_are_not(track: int, frame: int, disparity: float) -> None:
    where = at(track, frame)
    pixel = SCENE.observations.pixel.copy()
    pixel[where, 2] = pixel[where, 0] - disparity
    np.testing.assert_array_equal(mask(with_pixels(SCENE, pixel)), expected(where, Excluded.DISPARITY))


@given(st.integers(0, TRACKS - 1), st.integers(0, FRAMES - 1), st.floats(5.0, 50.0), st.sampled_from([1, 3]))
def test_rows_that_disagree_are_masked(track: int, frame: int, by: float, row: int) -> None:
    where = at(track, frame)
    shift = np.zeros(4)
    shift[row] = by
    np.testing.assert_array_equal(mask(shifted(where, shift)), expected(where, Excluded.ROWS))


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_the_mask_of_a_track_depends_on_that_track_alone(seed: int, share: float) -> None:
    random = np.random.default_rng(seed)
    wrong = random.random(FRAMES * TRACKS) < share
    sequence = shifted(np.flatnonzero(wrong), 50.0 * random.normal(size=4))
    o = sequence.observations
    together = mask(sequence)
    for track in range(0, TRACKS, 5):
        alone = replace(sequence, observations=o.select(o.landmark == track))
        np.testing.assert_array_equal(mask(alone), together[o.landmark == track])


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.9))
def test_kept_segments_are_consistent_and_long_enough(seed: int, share: float) -> None:
    random = np.random.default_rng(seed)
    wrong = random.random(FRAMES * TRACKS) < share
    excluded = mask(shifted(np.flatnonzero(wrong), 60.0 * random.normal(size=4)))
    left = np.bincount(SCENE.observations.landmark[excluded == Excluded.NO], minlength=TRACKS)
    assert set(left.tolist()) <= {0, *range(3, FRAMES + 1)}
    # Masking what is left once more takes nothing out.
    kept = replace(SCENE, observations=SCENE.observations.select(excluded == Excluded.NO))
    np.testing.assert_array_equal(mask(kept), Excluded.NO)


def test_a_gap_in_a_track_is_bridged() -> None:
    o = SCENE.observations
    keep = (o.landmark != 2) | (o.frame < 3) | (o.frame > 6)
    np.testing.assert_array_equal(mask(replace(SCENE, observations=o.select(keep))), Excluded.NO)


def test_nothing_to_mask() -> None:
    assert len(mask(replace(SCENE, observations=Observations.none()))) == 0


def test_on_a_drive_with_wrong_matches_the_mask_leaves_few_of_them_and_most_of_the_right_ones() -> None:
    sequence, labels = simulate_with_labels(Simulation(duration=20.0, wrong_share=0.05, seed=3))
    left = diagnosis.calibrated(sequence, settings=diagnosis.AsRecordedSettings()).excluded == Excluded.NO
    determined = sequence.observations.pixel[:, 0] - sequence.observations.pixel[:, 2] > 3.0
    assert labels.wrong.mean() > 0.04
    assert labels.wrong[left].mean() < 0.025
    assert left[~labels.wrong & determined].mean() > 0.9


def test_the_mask_is_that_of_the_recording_whatever_is_estimated_from_it() -> None:
    sequence = drive(wrong=0.05)
    one, other = (
        diagnosis.calibrated(
            sequence,
            settings=diagnosis.AsRecordedSettings(
                noise=diagnosis.NoiseSettings(pixel, 10.0 * pixel, pixel), kernel=data.HuberKernel(pixel)
            ),
        )
        for pixel in (0.1, 5.0)
    )
    np.testing.assert_array_equal(one.excluded, other.excluded)
