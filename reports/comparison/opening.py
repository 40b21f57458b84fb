"""Comparison in one call. All files are opened, and faults in them reported, before anything heavy is imported."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings
from fgbaseline.data.formats.named_file import shown
from fgbaseline.data.formats.trajectory_text import OpenedTrajectory, open_trajectory
from fgbaseline.geometry import InputError

if TYPE_CHECKING:
    from fgbaseline.data import Trajectory

    from .report import ComparisonReport

    Input = str | Path | Trajectory
    Given = Path | OpenedTrajectory | Trajectory

FILES = ("sequence", "extrinsic")


def compare(
    reference: "Input",
    *estimates: "Input",
    landmarks: Sequence[str | Path] = (),
    deltas: Sequence[str] = (),
    **options: Any,
) -> "ComparisonReport":
    """Compares estimates with a reference, each a `[NAME=]FILE` (TUM, KITTI, EuRoC, npz) or a `Trajectory`.

    The reference may be the folder of a run: then its other estimators are compared too. `landmarks` are CSV files
    (`[NAME=]FILE`), `deltas` are texts such as "1s" or "10m"; the other options are the fields of `Settings`.

        result = compare("truth.tum", "mine.tum", align="se3")
        result.table, result.caption, result.verdict
        result.write("out/comparison")

    Raises InputError, in one sentence, for an invalid file or option.
    """
    options |= {name: Path(options[name]) for name in FILES if options.get(name) is not None}
    times = options.pop("times", None) or ()
    options["times"] = tuple(map(Path, [times] if isinstance(times, str | Path) else times))
    settings = Settings(**options, deltas=tuple(Delta.parse(text) for text in deltas))
    inputs = [opened(given, settings, may_be_run=i == 0) for i, given in enumerate((reference, *estimates))]
    from .report import report_of

    return report_of(inputs, [str(file) for file in landmarks], settings)


def opened(given: "Input", settings: Settings, *, may_be_run: bool = False) -> "Given":
    """An input that is open: the folder of a run, a trajectory file, or a trajectory in memory as it is."""
    if not isinstance(given, str | Path):
        return given
    if may_be_run and Path(given).is_dir():
        return Path(given)
    name, file = split_name(str(given))
    return open_trajectory(file, settings.form, name)


def split_name(given: str) -> tuple[str | None, str]:
    """Name and file of `NAME=FILE`; an existing file of that whole name has no name part."""
    name, mark, file = given.partition("=")
    if not mark or Path(given).exists() or "/" in name:
        return None, given
    if not name or not file:
        raise InputError(f"{shown(given)}: expected FILE or NAME=FILE")
    return name, file
