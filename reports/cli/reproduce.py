"""`fgbaseline reproduce`: the report's figures and its claims, checked."""

from math import isfinite
from pathlib import Path

import click


class Numbers(click.ParamType[tuple[float, ...]]):
    """Positive numbers separated by commas."""

    def __init__(self, *, whole: bool) -> None:
        self.name = "N,N,..." if whole else "V,V,..."
        self._whole = whole

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """The numbers."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple((int if self._whole else float)(part) for part in str(value).split(","))
        except ValueError:
            numbers = ()
        if not numbers or not all(isfinite(number) and number > 0 for number in numbers):
            what = "whole numbers from 1 on" if self._whole else "numbers above 0"
            self.fail(f"expected {what}, separated by commas, got {value!r}", param, ctx)
        return numbers


@click.command(epilog="Example: fgbaseline reproduce 03.npz 10.npz --out out/reproduction")
@click.argument("sequence", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("out/reproduction"),
    show_default=True,
    help="Folder to write.",
)
@click.option("--force", is_flag=True, help="Replace the folder of an earlier reproduction.")
@click.option(
    "--sweep-features",
    type=Numbers(whole=True),
    default="200,400,700,1000",
    show_default=True,
    help="How many features the sweep runs with.",
)
@click.option(
    "--sweep-noise",
    type=Numbers(whole=False),
    default="0.01,1,15,100",
    show_default=True,
    help="V of the sweep, px², of each pixel row.",
)
def command(
    sequence: tuple[Path, ...],
    out: Path,
    force: bool,
    sweep_features: tuple[int, ...],
    sweep_noise: tuple[float, ...],
) -> int:
    """Draw the figures of the report on the documented filter from SEQUENCE... and test its claims.

    The report's recordings are 03.npz and 10.npz, known by their numbers of frames; others get figures of the same
    kind. One without features has its real path drawn, and features simulated along it for the rest, labelled so.
    The claims stand beside what is measured, what lies behind it, and the same filter on the repaired recording.

    Exits 0 when the reproduction is written, whatever comes of the claims, 2 on bad input.
    """
    from ..reproduction.command import reproduce
    from ..reproduction.study import SweepSettings

    return reproduce(sequence, out, SweepSettings(sweep_features, sweep_noise), force=force)
