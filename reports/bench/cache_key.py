"""The parts of a cache key that are not settings: the content of files, and the code that runs."""

import hashlib
import platform
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, entry_points, version
from importlib.util import find_spec
from pathlib import Path

from fgbaseline.data.registry import GROUP

LIBRARIES = ("gtsam", "numpy", "scipy", "pandas", "threadpoolctl")
ROOMS = ("geometry", "data", "diagnosis", "ekf", "smoother", "compare")


def content_of(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache
def code_of(estimators: tuple[str, ...], pages: bool) -> str:
    """SHA-256 of the source of ours that a job runs, of other packages' estimators, and of the libraries' versions.

    So a change to our source, released or not, runs every job anew; one to the report of a bench does not.
    """
    digest = hashlib.sha256(platform.python_version().encode())
    for library in LIBRARIES:
        digest.update(f"{library} {version(library)}\n".encode())
    for file in sorted({*_ours(pages), *_others(estimators)}):
        digest.update(f"{file.parent.name}/{file.name}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def _ours(pages: bool) -> Iterator[Path]:
    for room in ROOMS:
        yield from _folder(f"fgbaseline.{room}").rglob("*.py")
    reports = _folder("fgbaseline.reports")
    yield from reports.glob("*.py")
    yield from (reports / "bench" / name for name in ("worker.py", "job.py", "cache_key.py"))
    for part in ("results", "run", "tables", *(("figures", "html", "phrases") if pages else ())):
        yield from (file for file in (reports / part).rglob("*") if file.suffix in (".py", ".html", ".css", ".js"))


def _others(estimators: Iterable[str]) -> Iterator[Path]:
    """The Python files of the packages that estimators of others come from."""
    points = {point.name: point for point in entry_points(group=GROUP)}
    for top in sorted({points[name].module.partition(".")[0] for name in estimators} - {"fgbaseline"}):
        spec = find_spec(top)
        if spec is None:
            continue
        for folder in spec.submodule_search_locations or ():
            yield from Path(folder).rglob("*.py")
        if spec.submodule_search_locations is None and spec.origin is not None and Path(spec.origin).is_file():
            yield Path(spec.origin)


def _folder(package: str) -> Path:
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise PackageNotFoundError(package)
    return Path(spec.origin).parent
