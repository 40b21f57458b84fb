"""The resolution of two paths bounds the distances that the rounding of their files alone makes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.compare.trajectory_comparison.decimal_resolution import (
    decimal_step,
    position_resolution,
    truth_resolution,
)
from fgbaseline.data import Truth


@given(seed=st.integers(0, 1000), decimals=st.integers(3, 9), other=st.integers(3, 9))
def test_two_roundings_of_one_path_are_nearer_than_their_resolution(seed: int, decimals: int, other: int) -> None:
    path = np.random.default_rng(seed).normal(size=(50, 3)) * 100.0
    one, two = np.round(path, decimals), np.round(path, other)
    assert np.linalg.norm(one - two, axis=1).max() <= position_resolution(one, two)


def test_the_step_is_the_last_decimal_and_that_of_floats_without_one() -> None:
    path = np.random.default_rng(1).normal(size=(50, 3)) * 100.0
    assert decimal_step(np.round(path, 6)) == pytest.approx(1e-6)
    assert decimal_step(path) < 1e-12
    assert decimal_step(np.arange(30.0).reshape(10, 3)) == pytest.approx(1e-3)


def test_rounding_moves_no_true_position_by_more_than_the_resolution_of_the_truth() -> None:
    poses = np.repeat(np.eye(4)[None], 50, axis=0)
    path = np.random.default_rng(2).normal(size=(50, 3)) * 10.0
    poses[:, :3, 3] = np.round(path, 3)
    resolution = truth_resolution(Truth(poses))
    assert resolution == pytest.approx(0.5e-3 * np.sqrt(3.0))
    assert np.linalg.norm(poses[:, :3, 3] - path, axis=1).max() <= resolution
    assert truth_resolution(None) == 0.0
    assert truth_resolution(Truth(np.full((50, 4, 4), np.nan))) == 0.0
