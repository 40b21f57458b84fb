"""Writes the output of a benchmark into a page of docs/, between its mark and the next end mark."""

from collections.abc import Iterable
from pathlib import Path

END = "<!-- end -->"


def mark(benchmark: str) -> str:
    """The line above what `python -m benchmarks.NAME` writes."""
    return f"<!-- python -m benchmarks.{benchmark} -->"


def write(page: Path, benchmark: str, lines: Iterable[str]) -> None:
    """Puts lines in the place of what stands between a benchmark's mark and the end; raises ValueError without both."""
    text, start = page.read_text(encoding="utf-8"), mark(benchmark)
    before, found, behind = text.partition(start)
    _, end, behind = behind.partition(END)
    if not found or not end:
        raise ValueError(f"{page} has no '{start}' with '{END}' below it")
    page.write_text("\n".join([before + start, "", *lines, "", end + behind]), encoding="utf-8")
