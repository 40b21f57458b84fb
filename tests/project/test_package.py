"""`import fgbaseline` is instant; its packages and functions are there at their first use."""

import os
import subprocess
import sys
from importlib.metadata import version

import pytest

import fgbaseline

from ..builders.commands import environment

HEAVY = ("numpy", "pandas", "scipy", "gtsam", "matplotlib", "pydantic", "jinja2", "rich", "click", "importlib.metadata")


def modules_after(code: str) -> list[str]:
    """Names of the modules that a fresh Python has imported after the code."""
    command = [sys.executable, "-c", f"import sys\n{code}\nprint(*sys.modules)"]
    result = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)
    return result.stdout.split()


def test_the_import_loads_nothing_heavy_and_no_room() -> None:
    modules = modules_after("import fgbaseline; dir(fgbaseline)")
    assert "fgbaseline" in modules
    assert not [name for name in modules if name.startswith((*HEAVY, "fgbaseline."))]


def test_the_import_takes_less_than_a_tenth_of_a_second() -> None:
    def seconds(code: str) -> float:
        """CPU time of ten processes."""
        before = os.times()
        for _ in range(10):
            subprocess.run([sys.executable, "-c", code], env=environment(), check=True)
        after = os.times()
        return after.children_user + after.children_system - before.children_user - before.children_system

    assert (seconds("import fgbaseline") - seconds("pass")) / 10 < 0.1


def test_a_room_is_imported_at_its_first_use_with_what_is_below_it_alone() -> None:
    modules = modules_after("import fgbaseline; fgbaseline.geometry.se3.exp")
    assert "fgbaseline.geometry.se3" in modules
    rooms = {name.split(".")[1] for name in modules if name.startswith("fgbaseline.")}
    assert rooms == {"geometry"}


@pytest.mark.parametrize("name", fgbaseline.__all__)
def test_every_public_name_is_there_and_is_completed(name: str) -> None:
    assert getattr(fgbaseline, name) is not None
    assert name in dir(fgbaseline)


def test_the_version_is_that_of_the_distribution() -> None:
    assert fgbaseline.__version__ == version("fgbaseline")


def test_any_other_name_is_missing_as_in_every_module() -> None:
    with pytest.raises(AttributeError, match="module 'fgbaseline' has no attribute 'nothing'"):
        fgbaseline.nothing  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(ImportError, match="cannot import name 'nothing'"):
        from fgbaseline import nothing  # type: ignore[attr-defined]  # noqa: F401
