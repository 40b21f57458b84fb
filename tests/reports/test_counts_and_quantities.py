"""A sentence has the number of its noun, the sign of its word, and names exactly the quantity it holds."""

from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, data
from fgbaseline.data.wording import capitalized, noun, plural
from fgbaseline.geometry import se3
from fgbaseline.reports.comparison import compare as compared
from fgbaseline.reports.formatting import counted, number, per_cent


def test_a_count_of_one_has_a_singular() -> None:
    assert [plural(n, "frame") for n in (0, 1, 2, 1009)] == ["0 frames", "1 frame", "2 frames", "1,009 frames"]
    assert [noun(n, "match", "matches") for n in (1, 2)] == ["match", "matches"]
    assert counted(1, "error is", "errors are") == "1 error is"


def test_a_sentence_begins_with_a_capital_unless_its_first_word_is_a_symbol_or_a_name() -> None:
    texts = ("velocities shifted", "uR reduced by 0.33 px", "isam2 used 3", "w_y is zero", "", "7 tracks")
    begun = ["Velocities shifted", "uR reduced by 0.33 px", "isam2 used 3", "w_y is zero", "", "7 tracks"]
    assert list(map(capitalized, texts)) == begun


def test_a_share_that_is_nearly_nothing_is_not_printed_in_full() -> None:
    shares = (0.0, 1.17e-7, -1.17e-7, 3.5e-5, 0.12345, float("nan"))
    assert list(map(per_cent, shares)) == ["0 %", "below 0.001 %", "below 0.001 %", "0.00350 %", "12.3 %", "–"]


def path(n: int = 200, scale: float = 1.0) -> data.Trajectory:
    """A bending path of some 60 m."""
    t = 0.1 * np.arange(n)
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3] = scale * np.stack([20.0 * np.sin(0.15 * t), 10.0 * np.sin(0.3 * t), 0.1 * t], axis=1)
    return data.Trajectory(t, poses, "reference")


@pytest.mark.parametrize("scale", [0.97, 1.0, 1.04])
def test_the_length_of_a_path_is_that_of_the_path_and_not_of_a_fit(scale: float) -> None:
    reference = path()
    bent = path(scale=scale).world_T_body @ se3.exp([0.0, 0.3, 0.0, 0.0, 0.0, 0.2])
    estimate = data.Trajectory(reference.t, bent, "mine")
    result = compared(reference, estimate)
    own, its = (np.linalg.norm(np.diff(p.world_T_body[:, :3, 3], axis=0), axis=1).sum() for p in (estimate, reference))
    sentence = next((s for s in result.verdict if "Path length over the paired poses" in s), "")
    assert bool(sentence) == (number(own) != number(its))
    if sentence:
        than = "longer" if own > its else "shorter"
        assert f"{number(float(own))} m, {number(100.0 * abs(own / its - 1.0))} % {than}." in sentence


@pytest.mark.parametrize(("shift", "word"), [(0.2, "earlier"), (-0.2, "later")])
def test_a_shift_of_time_has_no_sign_beside_its_word(shift: float, word: str) -> None:
    reference = path()
    estimate = data.Trajectory(reference.t + shift, reference.world_T_body, "mine")
    result = compared(reference, estimate, search_offset=1.0)
    assert any(s.startswith(f"The stamps fit best: mine 200 ms {word} ") for s in result.verdict)


def test_paths_without_stamps_are_paired_by_their_number(tmp_path: Path) -> None:
    reference = path(30)
    for name in ("a", "b"):
        data.write_kitti(tmp_path / f"{name}.txt", reference.world_T_body)
    result = compared(tmp_path / "a.txt", tmp_path / "b.txt")
    assert "30 poses paired (by frame" in result.caption
    assert "0.01 s" not in result.caption
    assert "within 0.01 s" in compare.associate(reference, reference).caption
