"""Time and memory of reading a file of the shape of 10.npz, in a separate process: `python -m benchmarks.reader_cost`.

10.npz itself is at hand nowhere but at its course. What is written here has its shape, and tracks as long as its.
"""

import os
import re
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import click
import numpy as np
from numpy.lib import format as npy

from fgbaseline import data
from fgbaseline.geometry import FloatArray, InputError

from .claim_table import Row, row, table
from .subprocess_cost import apart

LANDMARKS, FRAMES = 13_289, 3_026
TRACK = 15
"""frames a landmark is seen in: 66 a frame"""
GIGABYTES = 4 * LANDMARKS * FRAMES * 8 / 1e9
MOST_MEMORY, MOST_SECONDS = 400.0, 10.0
"""MB and s"""
AT_A_TIME = 256
"""landmarks, written"""


def rows(runs: int) -> list[Row]:
    """Memory and seconds of reading the file compressed and stored, and whether one that lies is refused."""
    measured = []
    with tempfile.TemporaryDirectory() as folder:
        for kind, method in (("compressed", zipfile.ZIP_DEFLATED), ("uncompressed", zipfile.ZIP_STORED)):
            path = Path(folder) / f"{kind}.npz"
            write(path, method)
            size = path.stat().st_size / 1e6
            taken = [apart("benchmarks.reader_cost:read", str(path)) for _ in range(runs)]
            what = f"reading 4 x {LANDMARKS:,} x {FRAMES} doubles ({GIGABYTES:.2f} GB), {kind} ({size:,.0f} MB on disk)"
            measured += [
                row(f"{what}: peak memory", [t.peak for t in taken], " MB", most=MOST_MEMORY),
                row(f"{what}: time", [t.answer["seconds"] for t in taken], " s", most=MOST_SECONDS),
            ]
            path.unlink()
        measured.append(_refused(Path(folder) / "lie.npz"))
    return measured


def read(path: str) -> dict[str, float]:
    """Work of a separate process."""
    import time

    start = time.perf_counter()
    sequence = data.read(path)
    seconds = time.perf_counter() - start
    if len(sequence.observations) != LANDMARKS * TRACK:
        raise RuntimeError(f"{len(sequence.observations)} observations in place of {LANDMARKS * TRACK}")
    return {"seconds": seconds}


def write(path: Path, method: int) -> None:
    """The file, its block made a few landmarks at a time."""
    with zipfile.ZipFile(path, "w", method) as archive:
        for key, array in _small(FRAMES).items():
            _write(archive, key, array.shape, [array])
        _write(archive, "features", (4, LANDMARKS, FRAMES), _block())


def _small(frames: int) -> dict[str, FloatArray]:
    """All but the features of a course file."""
    return {
        "time_stamps": 0.1 * np.arange(frames)[None, :],
        "linear_velocity": np.tile([[10.0], [0.0], [0.0]], frames),
        "angular_velocity": np.zeros((3, frames)),
        "K": np.array([[552.0, 0.0, 682.0], [0.0, 552.0, 238.0], [0.0, 0.0, 1.0]]),
        "b": np.array(0.6),
        "imu_T_cam": np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    }


def _block() -> Iterator[FloatArray]:
    """The features in C order: each row of all landmarks, with the same frames in all four rows."""
    first = np.sort(np.random.default_rng(0).integers(0, FRAMES - TRACK, LANDMARKS))
    for of_four in range(4):
        random = np.random.default_rng(of_four + 1)
        for begin in range(0, LANDMARKS, AT_A_TIME):
            start = first[begin : begin + AT_A_TIME]
            piece = np.full((len(start), FRAMES), -1.0)
            columns = start[:, None] + np.arange(TRACK)
            piece[np.arange(len(start))[:, None], columns] = random.uniform(0.0, 1000.0, columns.shape)
            yield piece


def _write(
    archive: zipfile.ZipFile,
    key: str,
    shape: tuple[int, ...],
    pieces: Iterator[FloatArray] | Sequence[FloatArray],
) -> None:
    with archive.open(f"{key}.npy", "w", force_zip64=True) as member:
        npy.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": shape})
        for piece in pieces:
            member.write(piece.tobytes())


def _refused(path: Path) -> Row:
    """Cost of refusing a file whose header claims twice the memory of this machine."""
    frames = 1000
    claimed = 2 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    landmarks = claimed // (4 * frames * 8)
    with zipfile.ZipFile(path, "w") as archive:
        for key, array in _small(frames).items():
            _write(archive, key, array.shape, [array])
        _write(archive, "features", (4, landmarks, frames), [np.full((10, frames), -1.0)])
    what = f"a block that claims {claimed / 1e9:.0f} GB, twice this machine's memory"
    wanted = "refused with its size"
    try:
        data.read(path)
    except InputError as error:
        said = str(error).partition("features: ")[2] or str(error)
        return Row(what, wanted, f"refused: {said}", "", re.search(r"\d+ bytes|[\d.]+ [GT]B", said) is not None)
    return Row(what, wanted, "read", "", False)


@click.command()
@click.option("--runs", type=click.IntRange(min=1), default=3, show_default=True)
def main(runs: int) -> None:
    """Print the table."""
    click.echo(table(rows(runs)))


if __name__ == "__main__":
    main()
