"""Coverage-guided fuzzing of every reader: `make fuzz`, or `python -m benchmarks.fuzz --seconds 60 --readers npz,TUM`.

Each reader runs in a process of its own under atheris (libFuzzer), which may have 1 GB and 10 s an input. Whatever is
raised other than an InputError, and any file touched outside the scratch folder, is a crash: its input is kept in
out/fuzz/READER, beside the corpus, and the exit code is 1.
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import click
from rich.console import Console
from rich.table import Table

OUT, MEMORY = Path("out/fuzz"), Path("/dev/shm")
MEGABYTES, SECONDS_EACH, MAX_STEP_SCALE = 1024, 10, 8192
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def fuzz(name: str, arguments: list[str]) -> None:
    """Feeds one reader in this process until libFuzzer ends it."""
    import atheris

    with atheris.instrument_imports(include=["fgbaseline", "json", "tomllib", "zipfile"]):
        from fgbaseline.geometry import InputError
        from tests.builders.readers import readers

    reader = readers()[name]
    scratch = Path(mkdtemp(prefix="fgbaseline-fuzz-", dir=MEMORY if MEMORY.is_dir() else None))

    def once(content: bytes) -> None:
        try:
            reader.read(content, scratch)
        except InputError as error:
            if "\n" in str(error):
                raise RuntimeError("more than one line is said") from error

    atheris.Setup([sys.argv[0], *arguments], once)
    sys.addaudithook(_only_in(scratch))
    atheris.Fuzz()


def _only_in(scratch: Path) -> Any:
    """An audit hook that lets nothing be written elsewhere, no process be started and nothing be unpickled."""

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str) and arguments[2] & WRITING:
            inside = Path(arguments[0]).resolve().is_relative_to(scratch)
            if not inside:
                raise RuntimeError(f"a file is written outside: {arguments[0]}")
        elif event in ("subprocess.Popen", "os.system", "pickle.find_class", "os.remove", "os.rename", "os.rmdir"):
            raise RuntimeError(f"{event} {arguments}")

    return hook


def run(name: str, seconds: int) -> dict[str, Any]:
    """One reader in a process of its own; gives the counts."""
    from tests.builders.readers import readers

    corpus = OUT / name.replace(" ", "-")
    corpus.mkdir(parents=True, exist_ok=True)
    for i, seed in enumerate(readers()[name].seeds()):
        (corpus / f"seed-{i}").write_bytes(seed)
    options = {
        "max_total_time": seconds,
        "rss_limit_mb": MEGABYTES,
        "timeout": SECONDS_EACH,
        "max_len": MAX_STEP_SCALE,
        "print_final_stats": 1,
        "artifact_prefix": f"{corpus}-",
    }
    start = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.fuzz", "--only", name, *(f"-{k}={v}" for k, v in options.items()), corpus],
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    (OUT / f"{corpus.name}.log").write_text(done.stdout + done.stderr)

    def stat(pattern: str) -> int:
        found = re.findall(pattern, done.stderr)
        return int(found[-1]) if found else 0

    return {
        "inputs": stat(r"number_of_executed_units:\s+(\d+)") or stat(r"#(\d+)\s"),
        "coverage": stat(r"cov: (\d+)"),
        "MB": stat(r"peak_rss_mb:\s+(\d+)"),
        "slowest": stat(r"slowest_unit_time_sec:\s+(\d+)"),
        "seconds": time.monotonic() - start,
        "crashed": done.returncode != 0,
    }


@click.command(context_settings={"ignore_unknown_options": True})
@click.option("--seconds", default=60, show_default=True, help="For each reader.")
@click.option("--readers", "chosen", help="Names, separated by commas.  [default: all]")
@click.option("--only", hidden=True)
@click.argument("libfuzzer", nargs=-1, type=click.UNPROCESSED)
def main(seconds: int, chosen: str | None, only: str | None, libfuzzer: tuple[str, ...]) -> None:
    """Feed every reader mutated files, and count."""
    if only is not None:
        fuzz(only, list(libfuzzer))
        return
    from tests.builders.readers import readers

    names = list(readers()) if chosen is None else chosen.split(",")
    table = Table("reader", *(["inputs", "coverage", "peak MB", "slowest, s", "crash"]), box=None)
    total, crashed = 0, False
    for name in names:
        counts = run(name, seconds)
        total += counts["inputs"]
        crashed |= counts["crashed"]
        click.echo(f"{name}: {counts['inputs']:,} inputs in {counts['seconds']:.0f} s", err=True)
        table.add_row(
            name,
            f"{counts['inputs']:,}",
            str(counts["coverage"]),
            str(counts["MB"]),
            str(counts["slowest"]),
            "yes" if counts["crashed"] else "no",
        )
    table.add_row("all", f"{total:,}", "", "", "", "")
    Console().print(table)
    sys.exit(int(crashed))


if __name__ == "__main__":
    main()
