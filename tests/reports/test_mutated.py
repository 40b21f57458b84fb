"""Mutated recordings and trajectories: a sample of what `python -m benchmarks.mutated` runs by thousands."""

from pathlib import Path

import numpy as np
import pytest

from ..builders.commands import fgbaseline
from ..builders.mutated_files import LIMITS, case, good_distance, good_recording
from ..builders.mutations import RECORDING, TRAJECTORY

ONCE = 2 * max(len(RECORDING), len(TRAJECTORY))
"""cases in which every mutation comes up at least once"""
NAMES = [
    f"{number}: {(RECORDING, TRAJECTORY)[number % 2][number // 2 % (len(RECORDING), len(TRAJECTORY))[number % 2]].name}"
    for number in range(ONCE)
]
SAMPLE = [10, 11, 35]
"""those of `make test`: stamps in ns of a recording and of a trajectory"""


@pytest.mark.slow
def test_the_good_recording_passes_what_its_mutations_must_not(tmp_path: Path) -> None:
    np.savez(tmp_path / "drive.npz", **good_recording(0))
    (tmp_path / "limits.toml").write_text(LIMITS)
    assert fgbaseline("diagnose", "drive.npz", cwd=tmp_path).returncode == 0
    ran = fgbaseline("run", "drive.npz", "--estimators", "isam2", "--out", "run", cwd=tmp_path, drawing=False)
    assert ran.returncode == 0
    assert fgbaseline("check", "run", "--limits", "limits.toml", cwd=tmp_path).returncode == 0


def test_good_files_have_errors_to_compare_with() -> None:
    assert np.isfinite(good_distance(0)).all()


@pytest.mark.slow
@pytest.mark.parametrize("number", SAMPLE, ids=[NAMES[number] for number in SAMPLE])
def test_every_command_ends_on_a_mutated_file(number: int) -> None:
    assert not [violation for violation in case(number).violations if "passes" not in violation]


@pytest.mark.full
@pytest.mark.parametrize("number", range(3 * ONCE))
def test_every_mutated_file_ends_in_time_and_passes_no_gate_with_other_numbers(number: int) -> None:
    assert not case(number, drawing=number % 10 == 0).violations
