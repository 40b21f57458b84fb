"""Environments in which a revision of this project is installed as a user has it: `environment(folder, "179d7a6")`.

Both sides of a comparison are installed in the same way, with the versions of the dependencies that the environment of
the benchmark has, and with compiled bytecode. `None` is the working tree as it stands.
"""

import io
import subprocess
import sys
import tarfile
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BEFORE = "179d7a6"
"""the revision that today's is compared with"""


class NoHistoryError(Exception):
    """The revision is not at hand: a copy without git, or a shallow clone."""


@cache
def environment(folder: Path, revision: str | None) -> Path:
    """Folder of the Python environment, whose sources are in `source` beside it. Raises NoHistoryError."""
    place = folder / (revision or "today")
    _extract(place / "source", revision)
    versions = place / "versions.txt"
    listed = _uv("pip", "list", "--format", "freeze", "--exclude-editable", "--python", sys.executable)
    versions.write_text(listed, encoding="utf-8")
    _uv("venv", "--quiet", "--python", sys.executable, place / "environment")
    python = place / "environment" / "bin" / "python"
    _uv("pip", "install", "--quiet", "--compile-bytecode", "--python", python, "-c", versions, place / "source")
    return place / "environment"


def _extract(source: Path, revision: str | None) -> None:
    """The files of a revision, or of the working tree: those that git knows."""
    stashed = _git("stash", "create").decode().strip() or "HEAD" if revision is None else revision
    with tarfile.open(fileobj=io.BytesIO(_git("archive", stashed))) as archive:
        archive.extractall(source, filter="data")


def _git(*arguments: str) -> bytes:
    try:
        return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        raise NoHistoryError(
            f"git {arguments[0]} fails in {ROOT}, so {BEFORE} cannot be installed; clone the project with its history"
        ) from error


def _uv(*arguments: str | Path) -> str:
    command = [Path(sys.executable).with_name("uv"), *arguments]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
