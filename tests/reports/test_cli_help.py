"""Help is instant, complete and has an example of everything."""

import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from ..builders.commands import COMMAND, environment, fgbaseline, installed

COMMANDS = ("run", "compare", "estimators", "diagnose", "check", "bench", "export", "figures", "reproduce", "simulate")
FOR_GOOD_INPUT = ("scipy", "pandas", "gtsam", "matplotlib", "jinja2", "rich", "fgbaseline.data.simulate")
HEAVY = ("numpy", "pandas", "scipy", "gtsam", "matplotlib", "pydantic", "jinja2", "rich", "fgbaseline.data")


def imported_by(arguments: tuple[str, ...], code: int, place: Path) -> set[str]:
    """The modules that the command imports until it exits with this code."""
    result = subprocess.run(
        [sys.executable, "-X", "importtime", COMMAND, *arguments],
        cwd=place,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == code, result.stderr
    modules = {line.rpartition("|")[2].strip() for line in result.stderr.splitlines()}
    assert "click" in modules
    return modules


@pytest.mark.parametrize("arguments", [("--help",), *((name, "--help") for name in COMMANDS)])
def test_help_imports_nothing_heavy(arguments: tuple[str, ...], tmp_path: Path) -> None:
    assert not [module for module in imported_by(arguments, 0, tmp_path) if module.startswith(HEAVY)]


@pytest.mark.parametrize("command", ["run", "diagnose", "export --out problem"])
def test_an_unreadable_recording_is_refused_before_the_analysis_is_imported(command: str, tmp_path: Path) -> None:
    imported = imported_by((*command.split(), "missing.npz"), 2, tmp_path)
    assert "fgbaseline.data" in imported
    assert not [module for module in imported if module.startswith(FOR_GOOD_INPUT)]


def test_a_run_imports_no_package_that_only_other_commands_need() -> None:
    whole = "fgbaseline.ekf", "fgbaseline.smoother", "fgbaseline.reports.run.folder", "fgbaseline.reports.progress"
    code = f"import sys, {', '.join(whole)}; print(*sys.modules)"
    finished = subprocess.run(
        [sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=True
    )
    modules = finished.stdout.split()
    assert {"gtsam", "pandas", "matplotlib.figure"} <= set(modules)
    others = ("scipy.interpolate", "scipy.optimize", "scipy.sparse", "scipy.spatial", "fgbaseline.data.simulate")
    assert not [module for module in modules if module.startswith(others)]


def test_help_answers_at_once(tmp_path: Path) -> None:
    def seconds() -> float:
        """Of the processor's time, in children."""
        spent = os.times()
        return spent.children_user + spent.children_system

    begin = seconds()
    for _ in range(5):
        installed("--help", cwd=tmp_path)
    # Half a second is what is promised; it takes 0.15 s.
    assert (seconds() - begin) / 5 < 0.5


@pytest.mark.parametrize("arguments", [(), *((name,) for name in COMMANDS)])
def test_every_help_has_an_example(arguments: tuple[str, ...], tmp_path: Path) -> None:
    result = fgbaseline(*arguments, "--help", cwd=tmp_path)
    assert result.returncode == 0
    assert result.stderr == ""
    assert f"Example: fgbaseline {' '.join(arguments)}" in result.stdout


def test_the_group_names_every_command(tmp_path: Path) -> None:
    result = fgbaseline("--help", cwd=tmp_path)
    assert all(f"\n  {name} " in result.stdout for name in COMMANDS)


def test_without_a_command_the_help_is_shown(tmp_path: Path) -> None:
    result = fgbaseline(cwd=tmp_path)
    assert result.returncode == 2
    assert "Commands:" in result.stderr + result.stdout


def test_the_version_is_that_of_the_distribution(tmp_path: Path) -> None:
    result = fgbaseline("--version", cwd=tmp_path)
    assert result.returncode == 0
    assert version("fgbaseline") in result.stdout
