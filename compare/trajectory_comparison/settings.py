"""Settings of a comparison. The module imports nothing heavy, so that wrong options are reported at once."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fgbaseline.geometry import InputError

if TYPE_CHECKING:
    from fgbaseline.data import Problem, Sequence, TimeUnit
    from fgbaseline.geometry import FloatArray


Body = Literal["imu", "camera"]


@dataclass(frozen=True, slots=True)
class Delta:
    """Distance between two poses whose relative motion is compared."""

    length: float
    unit: str
    """s, m, deg or frames"""

    @staticmethod
    def parse(text: str) -> "Delta":
        """Parses a text such as `1s`, `10m`, `30deg` or `5frames`; raises InputError."""
        found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(s|m|deg|frames)\s*", text)
        try:
            length = float(found[1]) if found else 0.0
        except ValueError:
            length = 0.0
        if found is None or not 0.0 < length < float("inf"):
            raise InputError(
                f"delta: expected a length above 0 with its unit, such as 1s, 10m, 30deg or 5frames, got {text!r}"
            )
        if found[2] == "deg" and length > 180:
            raise InputError(f"delta: no two orientations are {text.strip()} apart; give one of at most 180deg")
        if found[2] == "frames" and not length.is_integer():
            raise InputError(f"delta: expected a whole number of frames, got {text!r}")
        return Delta(length, found[2])

    @property
    def text(self) -> str:
        """Text in headings and keys, such as `10 m`."""
        return f"{self.length:g} {self.unit}"


@dataclass(frozen=True, slots=True)
class Settings:
    """Options of a comparison."""

    align: str | None = None
    """none, first-pose, yaw, se3 or sim3; None for `none` from a run's reference (the worlds are one), else `se3`"""
    align_first: int | None = None
    """number of pairs of poses to align over; None for all"""
    up: tuple[float, float, float] | None = None
    """up in the reference's world; None for that of the files, the run or `sequence`, else +z"""
    association: str = "nearest"
    tolerance: float | None = None
    """largest time difference of a pair, s; None for that of the association"""
    offset: float = 0.0
    """time offset added to the stamps of the estimates, s"""
    search_offset: float | None = None
    """half width of the search for the time offset of each estimate around `offset`, s; None for no search"""
    deltas: tuple[Delta, ...] = ()
    """lengths of relative motions; empty for 1 s (1 frame without stamps) and 10 m"""
    all_pairs: bool = False
    form: Literal["tum", "kitti", "euroc", "npz"] | None = None
    times: tuple["Path | FloatArray", ...] = ()
    """stamps for KITTI files, s: a file takes the first array that is as long as its trajectory"""
    time_unit: Literal["s", "ms", "us", "ns"] | None = None
    """unit of stamps, where neither a header nor their size shows it"""
    quaternion: Literal["xyzw", "wxyz"] | None = None
    """order of quaternions that no header names"""
    lever_arm: tuple[float, float, float] | None = None
    """point that the reference follows, m, in the body of the estimates"""
    align_body: bool = False
    """removes a constant rotation between the bodies"""
    sequence: "Path | Sequence | Problem | None" = None
    """a recording, the folder of an exported problem, or either in memory"""
    held_out: float = 0.0
    """share of the tracks of a recording that is held out to rank all paths; a run with held-out tracks has its own"""
    extrinsic: "Path | FloatArray | None" = None
    """imu_T_cam (4, 4), or a KITTI file of one line; None for that of `sequence`"""
    reference_body: Body = "imu"
    estimate_body: Body = "imu"
    beside: str = "all"
    """estimators of the reference's run to compare too: names with commas, `all` or `none`"""
    seed: int = 0
    """seed of the bootstrap and of the held-out tracks"""

    @property
    def unit(self) -> "TimeUnit | None":
        """The unit of stamps, if it is given."""
        from fgbaseline.data import TimeUnit

        return None if self.time_unit is None else TimeUnit(self.time_unit)

    def record(self) -> dict[str, str | int | float | bool | None]:
        """The settings as `comparison.json` has them."""
        plain = {field.name: _plain(getattr(self, field.name)) for field in fields(self)}
        return {"format" if name == "form" else name: value for name, value in plain.items()}


def _plain(value: Any) -> Any:
    """A value as JSON has it: an empty sequence as None, others as text with commas between; arrays by their shape."""
    if hasattr(value, "shape"):
        return f"array {value.shape}"
    if isinstance(value, Iterable) and not isinstance(value, str):
        return ",".join(f"{x:g}" if isinstance(x, int | float) else str(_plain(x)) for x in value) or None
    if isinstance(value, Delta):
        return f"{value.length:g}{value.unit}"
    if hasattr(value, "observations"):  # a recording, or a problem, which has one
        recording = getattr(value, "sequence", value)
        return recording.source or recording.name
    return str(value) if isinstance(value, Path) else value
