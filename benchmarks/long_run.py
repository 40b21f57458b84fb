"""A run of 10,000 frames, `python -m benchmarks.long_run`: what `fgbaseline run` holds at most, and how large a page.

`fixed-lag` is left out, which holds little (see benchmarks.growth) and takes long, and so is `batch`.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import click

from .claim_table import Row, table
from .subprocess_cost import MB, apart

FRAMES, FEATURES = 10_000, 20
ESTIMATORS = "dead-reckoning,ekf,joint-ekf,isam2,isam2-online"
MOST_MEMORY = 2000.0
"""MB"""


def rows(frames: int = FRAMES) -> list[Row]:
    """Memory and page of one run; it is long, so it is made once."""
    peak, page = apart("benchmarks.long_run:run", frames).answer
    what = f"`fgbaseline run` on {frames:,} simulated frames, {FEATURES} features a frame ({ESTIMATORS})"
    wanted = f"below {MOST_MEMORY:.0f} MB"
    return [
        Row(f"{what}: peak memory", wanted, f"{peak:.0f} MB", "one run", peak < MOST_MEMORY),
        Row("its report.html", "", f"{page:.1f} MB", "one run", None),
    ]


def run(frames: int) -> tuple[float, float]:
    """Work of a separate process: MB that the run held at most, and MB of its page."""
    with tempfile.TemporaryDirectory() as folder:
        recording, out = Path(folder) / "long.npz", Path(folder) / "out"
        drive = ("--path", "town", "--duration", str(frames / 10.0), "--features-per-frame", str(FEATURES))
        peak_of("simulate", recording, *drive, "--seed", "1")
        peak = peak_of("run", recording, "--estimators", ESTIMATORS, "--out", out)
        return peak, (out / "report.html").stat().st_size / MB


def peak_of(*arguments: str | Path) -> float:
    """MB that a command of ours held at most. Raises RuntimeError where it fails.

    By its `ru_maxrss`, which is at least what the process held that started it: call it from a lean one.
    """
    command = [str(Path(sys.executable).with_name("fgbaseline")), *map(str, arguments)]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} ended with {process.returncode}")
    return usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / MB


@click.command()
@click.option("--frames", type=click.IntRange(min=50), default=FRAMES, show_default=True)
def main(frames: int) -> None:
    """Print the table."""
    click.echo(table(rows(frames)))


if __name__ == "__main__":
    main()
