"""The workflows of docs/ci: complete, the same as in docs/ci.md, and their commands run."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from junitparser import JUnitXml

from ..builders.commands import environment, undrawn_command

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "ci"
GITHUB: dict[Any, Any] = yaml.safe_load((EXAMPLES / "github-actions.yml").read_text())
GITLAB: dict[str, Any] = yaml.safe_load((EXAMPLES / "gitlab-ci.yml").read_text())
STEPS: list[dict[str, Any]] = GITHUB["jobs"]["accuracy"]["steps"]
OURS = [step["run"] for step in STEPS if step.get("run", "").startswith("fgbaseline")]


def test_the_page_shows_the_files_whole() -> None:
    page = (ROOT / "docs" / "ci.md").read_text()
    for name in ("limits.toml", "github-actions.yml", "gitlab-ci.yml"):
        assert f"\n{(EXAMPLES / name).read_text()}```\n" in page


def test_the_github_workflow_is_complete() -> None:
    assert set(GITHUB[True]) == {"pull_request", "push"}  # "on" is a truth value in YAML 1.1
    assert GITHUB["permissions"] == {"contents": "read", "pull-requests": "write"}
    uses = [step["uses"] for step in STEPS if "uses" in step]
    assert [name.partition("@")[0] for name in uses] == [
        "actions/checkout",
        "actions/setup-python",
        "actions/upload-artifact",
    ]
    assert all(re.fullmatch(r"actions/[\w-]+@v\d+", name) for name in uses)
    after = STEPS[[step.get("name") for step in STEPS].index("Check") + 1 :]
    assert all("!cancelled()" in step["if"] for step in after)  # reported also where a limit is violated
    assert after[-1]["with"]["path"] == "out"


def test_the_gitlab_job_runs_the_same_commands() -> None:
    job = GITLAB["accuracy"]
    assert job["script"] == [step["run"] for step in STEPS if "run" in step and not step["run"].startswith("gh ")]
    assert job["artifacts"]["when"] == "always"
    assert job["artifacts"]["reports"]["junit"] == "out/check.xml"
    assert "out/check.xml" in OURS[-1]


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with limits, a pip and a gh that only say what they were asked, and a command that draws nothing."""
    (tmp_path / "accuracy").mkdir()
    shutil.copy(EXAMPLES / "limits.toml", tmp_path / "accuracy" / "limits.toml")
    (tmp_path / "accuracy" / "requirements.txt").write_text("fgbaseline\n")
    (tmp_path / "bin").mkdir()
    for name in ("pip", "gh"):
        program = tmp_path / "bin" / name
        program.write_text('#!/bin/sh\necho "$(basename "$0") $*" >> asked.txt\n')
        program.chmod(0o755)
    program = tmp_path / "bin" / "fgbaseline"
    program.write_text(f"#!{sys.executable}\n{undrawn_command()}")
    program.chmod(0o755)
    return tmp_path


def bash(command: str, repository: Path) -> subprocess.CompletedProcess[str]:
    """A step as GitHub runs it."""
    path = os.pathsep.join([str(repository / "bin"), str(Path(sys.executable).parent), os.environ["PATH"]])
    page, request = str(repository / "page.md"), "https://github.com/me/mine/pull/1"
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", command],
        cwd=repository,
        env=environment(PATH=path, GITHUB_STEP_SUMMARY=page, PULL_REQUEST=request),
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_commands_run_in_their_order_and_separate_good_from_bad(repository: Path) -> None:
    page = (ROOT / "docs" / "ci.md").read_text()
    update = next(line for line in page.splitlines() if line.endswith("--update-baseline"))
    for step in (step for step in STEPS if "run" in step):
        if step["name"] == "Check":
            assert bash(update, repository).returncode == 0
        result = bash(step["run"], repository)
        assert result.returncode == 0, f"{step['name']}: {result.stdout}{result.stderr}"
    assert (repository / "asked.txt").read_text().splitlines() == [
        "pip install -r accuracy/requirements.txt",
        "gh pr comment https://github.com/me/mine/pull/1 --body-file out/check.md --edit-last --create-if-none",
    ]
    assert (repository / "page.md").read_text().count("### Accuracy: All") == 2
    assert JUnitXml.fromfile(str(repository / "out" / "check.xml")).failures == 0

    limits = repository / "accuracy" / "limits.toml"
    limits.write_text(limits.read_text().replace("at_most = 0.5", "at_most = 0.000001"))
    assert bash(OURS[-1], repository).returncode == 1
    assert JUnitXml.fromfile(str(repository / "out" / "check.xml")).failures == 2
    assert "violated" in (repository / "out" / "check.md").read_text()


@pytest.mark.slow
def test_the_failed_test_of_the_page_prints_what_the_page_shows(repository: Path) -> None:
    page = (ROOT / "docs" / "ci.md").read_text()
    for command in OURS[:2]:  # simulate, run
        assert bash(command, repository).returncode == 0
    (test,) = re.findall(r"```python\n(def test_filter.*?)```", page, re.DOTALL)
    (repository / "test_filter.py").write_text(test)
    pytest_command = f"{sys.executable} -m pytest -p no:cacheprovider --accuracy-figures accuracy test_filter.py"
    printed = [line for line in bash(pytest_command, repository).stdout.splitlines() if line.startswith("E   ")]
    (shown,) = re.findall(r"```text\n(E   .*?)```", page, re.DOTALL)
    number = re.compile(r"\d+\.\d{3,}")  # equal up to the rounding of other processors
    assert [number.sub("#", " ".join(line.split())) for line in printed] == [
        number.sub("#", " ".join(line.split())) for line in shown.splitlines()
    ]
    found, expected = ([float(n) for n in number.findall(text)] for text in ("\n".join(printed), shown))
    assert found == pytest.approx(expected, rel=0.01)
