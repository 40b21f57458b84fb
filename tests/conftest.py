"""What several tests share: the real recordings, where they are, and a small recording of the course's form."""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):  # before numpy: small matrices wait for each other in threads
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
os.environ.pop("GITHUB_STEP_SUMMARY", None)  # what tests of `check` say is not for the page of our own job

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from .builders.course_file import course_arrays

settings.register_profile("fgbaseline", deadline=None)  # a busy machine is no failure
settings.load_profile("fgbaseline")

RECORDINGS = Path(os.environ.get("FGBASELINE_RECORDINGS", Path(__file__).parents[2] / "shared" / "data"))


LONGEST = (
    "test_packaging",
    "test_bench_runs",
    "test_docs",
    "test_docs_site",
    "test_reproduce",
    "test_check_ourselves",
    "test_hostile_recordings",
    "test_joint_ekf_consistency",
    "test_bench_report",
    "test_reference_real",
    "test_causality",
    "test_invariance",
    "test_inertial",
    "test_joint_ekf_real",
    "test_page_look",
    "test_run_command",
    "test_inertial_problem",
)
"""files that take half a minute and more: where they are shared out whole, none of them may be the last that runs"""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, the others in their order."""
    items.sort(key=lambda item: item.path.stem not in LONGEST)


@pytest.fixture(scope="session")
def recordings() -> Callable[[str], Path]:
    """The path of a real recording, such as `recordings("03.npz")`; the test is skipped where it is missing."""

    def path(name: str) -> Path:
        if not (RECORDINGS / name).is_file():
            pytest.skip(f"{name} is not in {RECORDINGS} (set FGBASELINE_RECORDINGS)")
        return RECORDINGS / name

    return path


@pytest.fixture(name="course_arrays")
def _course_arrays() -> dict[str, Any]:
    """The arrays of a later course file: 6 frames, 5 landmarks, 7 observations."""
    return course_arrays()
