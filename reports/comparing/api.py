"""`compare`: everything in one call, for a notebook or a script."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fgbaseline.data import Trajectory

from .comparison import Comparison
from .computing import compare_entries
from .entries import Given, read_entries
from .settings import Delta, Settings

FILES = ("sequence", "extrinsic")


def compare(
    reference: Given,
    *estimates: Given,
    landmarks: Sequence[str | Path] = (),
    deltas: Sequence[str] = (),
    **options: Any,
) -> Comparison:
    """Estimates against a reference, each a `[NAME=]FILE` (TUM, KITTI, EuRoC, npz) or a `Trajectory`.

    The reference may be the folder of a run: then its other estimators are compared too. `landmarks` are CSV files
    (`[NAME=]FILE`), `deltas` texts such as "1s" or "10m"; the other options are the fields of `Settings`.

        result = compare("truth.tum", "mine.tum", align="se3")
        result.table, result.caption, result.verdict
        result.write("out/comparison")

    Raises InputError, in one sentence, for whatever is wrong with a file or an option.
    """
    options |= {name: Path(options[name]) for name in FILES if options.get(name) is not None}
    times = options.pop("times", None) or ()
    options["times"] = tuple(map(Path, [times] if isinstance(times, str | Path) else times))
    settings = Settings(**options, deltas=tuple(Delta.parse(text) for text in deltas))
    given = [item if isinstance(item, Trajectory) else str(item) for item in (reference, *estimates)]
    with np.errstate(all="ignore"):
        entries = read_entries(given[0], given[1:], [str(file) for file in landmarks], settings)
        return compare_entries(entries, settings)
