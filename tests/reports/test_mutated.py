"""Mutated recordings and trajectories: a sample of what `python -m benchmarks.mutated` runs by thousands."""

from pathlib import Path

import numpy as np
import pytest

from ..builders.commands import fgbaseline
from ..builders.mutated_files import FAST, FULL, LIMITS, Form, case, good_distance, good_recording
from ..builders.mutations import RECORDING, TRAJECTORY

ONCE = 2 * max(len(RECORDING), len(TRAJECTORY))
"""cases in which every mutation comes up at least once"""
FEW = 40
"""cases of `make test`, in the fast form"""
FORMS = pytest.mark.parametrize("form", [FAST, pytest.param(FULL, marks=pytest.mark.full)], ids=["fast", "full"])


@pytest.mark.slow
@FORMS
@pytest.mark.parametrize("base", range(3))
def test_good_recordings_pass_what_their_mutations_must_not(base: int, form: Form, tmp_path: Path) -> None:
    np.savez(tmp_path / "drive.npz", **good_recording(base, form))
    (tmp_path / "limits.toml").write_text(LIMITS.format(estimator="isam2"))
    assert fgbaseline("diagnose", "drive.npz", cwd=tmp_path).returncode == 0
    ran = fgbaseline("run", "drive.npz", "--estimators", "isam2", "--out", "run", cwd=tmp_path, drawing=False)
    assert ran.returncode == 0
    assert fgbaseline("check", "run", "--limits", "limits.toml", cwd=tmp_path).returncode == 0


@FORMS
def test_good_files_have_errors_to_compare_with(form: Form) -> None:
    assert np.isfinite(good_distance(0, form)).all()


def test_every_case_differs_from_the_others() -> None:
    first, second = (good_recording(base, FAST)["linear_velocity"] for base in (0, len(FAST.paths)))
    assert not np.array_equal(first, second)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(FEW))
def test_a_mutated_file_ends_in_time_and_passes_no_gate_with_other_numbers(number: int) -> None:
    assert not case(number, FAST).violations


@pytest.mark.full
@pytest.mark.parametrize("number", range(3 * ONCE))
def test_every_mutated_file_ends_in_time_and_passes_no_gate_with_other_numbers(number: int) -> None:
    assert not case(number, drawing=number % 10 == 0).violations
